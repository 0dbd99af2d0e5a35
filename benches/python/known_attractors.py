"""Verdicts on attractors of known kind, with other origins and units, of `lyapunov_spectrum` and `basins`.

Prints each wrong one. `python known_attractors.py 200 7` draws 200 with the seed 7.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

import udd

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

from known_attractors import Case, drawn

OF_BASINS = {
    "equilibrium": {"equilibrium"},
    "periodic orbit": {"periodic"},
    "torus": {"aperiodic"},
    "chaos": {"aperiodic"},
    "escapes": {"escaped", "failed", "time ran out"},
}


def verdict(case: Case) -> str:
    """The verdict of the spectrum from a case's start."""
    return udd.lyapunov_spectrum(case.model, state0=case.start).verdict


def endings(case: Case) -> set[str]:
    """The kinds of attractors, and other endings, of starts around that of a case."""
    name = case.model.state_names[0]
    grid = {name: case.start[0] + case.spread[0] * np.array([-1.0, 0.0, 1.0])}
    basins = udd.basins(case.model, grid, state0=case.start, section=case.section)
    kinds = basins["kind"].attrs["flag_meanings"].split()
    others = [ending for ending in basins["ending"].to_numpy().tolist() if "attractor" not in ending]
    return {kinds[k] for k in basins["kind"].to_numpy().tolist()} | set(others)


def main(count: int, seed: int) -> None:
    """Print what is wrong, and how many are right."""
    warnings.simplefilter("ignore")
    tally: Counter[str] = Counter()
    begin = time.perf_counter()
    for case in drawn(count, seed):
        try:
            said, ends = verdict(case), endings(case)
        except udd.UddError as error:
            said, ends = f"error: {error}", set()
        good, fine = said == case.kind, ends <= OF_BASINS[case.kind]
        open_ = not fine and ends <= OF_BASINS[case.kind] | {"undecided", "time ran out"}
        tally.update(spectrum_right=good, basins_right=fine, basins_open=open_, all=1)
        tally["spectrum_open"] += said == "undecided"
        if not (good and fine):
            print(f"{case.name}: {case.kind}; spectrum {said}, basins {sorted(ends)}", flush=True)
    print(dict(tally), f"{time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main(int((sys.argv[1:] or ["200"])[0]), int((sys.argv[2:] or ["7"])[0]))
