"""PySINDy on the disk, the plain disk's equations and numbers given to it as constraints.

    python benches/python/discovery/pysindy_disk.py [--records 20] [--seed 20261121] [--defects]

Records of a minute at 25 Hz with noise of 0.5 mm and 0.01 rad, drives and starts drawn: with nothing hidden,
and with a relaxation of the rolling constraint of 5 /m. Unlike udd it gets W, k0, k1, k2, and its settings
are chosen on other records with a known truth.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import dataclass, replace

import numpy as np
import pysindy_peer
from camera import Camera, drawn, film
from laws import LIBRARY, Law
from motion import Device, World, staying
from pysindy_peer import MODELS, Settings, Term

DURATION = 60.0
RELAXATION = 5.0  # 1/m
GRID = [
    Settings(t, w, s, models=0) for t, w, s in itertools.product((0.05, 0.1, 0.15, 0.2), (0.3, 0.5), (5, 7))
]
HIDDEN: dict[str, tuple[Law, ...]] = {
    "nothing": (),
    "relaxation": (Law(LIBRARY["relaxation"], (RELAXATION,), {}, "constraint"),),
}


@dataclass(frozen=True)
class Record:
    """A filmed run, and its hidden effect."""

    device: Device
    hidden: str
    t: np.ndarray
    seen: np.ndarray

    def wrong(self, terms: list[Term]) -> int:
        """How many terms were found that are not there, or not found that are."""
        there = {("dZ", "Z")} if self.hidden == "relaxation" else set()
        return len(there ^ {(term.equation, term.name) for term in terms})


def records(hidden: str, count: int, seed: int, defects: bool) -> list[Record]:
    """Drawn records."""
    results: list[Record] = []
    rng = np.random.default_rng(seed)
    while len(results) < count:
        device = Device(rng.uniform(0.012, 0.09))
        motion = staying(World(device, HIDDEN[hidden]), DURATION, rng)
        if motion is not None:
            camera = drawn(rng, precise=False, hard=False) if defects else Camera()
            results.append(Record(device, hidden, *film(camera, motion, DURATION, rng)))
    return results


def answer(record: Record, settings: Settings) -> list[Term]:
    """What PySINDy finds."""
    return pysindy_peer.disk(record.t, record.seen, record.device, settings)


def main() -> None:
    """Choose the settings, print what is found in each record, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--records", type=int, default=20, help="of each kind")
    parser.add_argument("--tune", type=int, default=4, help="other records of each kind, for the settings")
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--defects", action="store_true", help="a drawn camera with its defects")
    given = parser.parse_args()
    tuning = [r for hidden in HIDDEN for r in records(hidden, given.tune, given.seed + 1, given.defects)]
    wrong = {s: [r.wrong(answer(r, s)) for r in tuning] for s in GRID}
    chosen = min(GRID, key=lambda s: (np.count_nonzero(wrong[s]), sum(wrong[s])))
    right = len(tuning) - np.count_nonzero(wrong[chosen])
    print(f"{chosen}: {right} of {len(tuning)} exactly right where the settings were chosen")
    for hidden in HIDDEN:
        batch = records(hidden, given.records, given.seed, given.defects)
        for name, settings in (("one", chosen), ("ensemble", replace(chosen, models=MODELS))):
            answers = [answer(r, settings) for r in batch]
            for r, terms in zip(batch, answers, strict=True):
                said = "; ".join(f"{x.equation}: {x.coefficient:.3g} {x.name}" for x in terms) or "-"
                print(f"  {hidden}, {name}, W = {r.device.W:.4f}: {said}", flush=True)
            exact = sum(r.wrong(terms) == 0 for r, terms in zip(batch, answers, strict=True))
            held = sum(any((x.equation, x.name) == ("dZ", "Z") for x in terms) for terms in answers)
            claims = sum(bool(terms) for terms in answers)
            mean = np.mean([len(terms) for terms in answers])
            print(
                f"{hidden}, {name}: exactly right {exact} of {len(batch)}; some term found in {claims}; "
                f"the term of a relaxation in {held}; {mean:.1f} terms on average",
                flush=True,
            )


if __name__ == "__main__":
    main()
