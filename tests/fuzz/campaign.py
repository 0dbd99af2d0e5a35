"""Hand hostile inputs to the package for a while and report what broke.

python tests/fuzz/campaign.py --minutes 60 --jobs 2
python tests/fuzz/campaign.py --kinds csv,files --seed 7 --minutes 1

Each batch runs in a process of its own, so that an abort, a hang or a leak is one more fault and not the end.
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BATCH = 100  # cases
WORK = 300  # seconds of a batch's processor time: a loop without end has no more
LONGEST = (
    1800.0  # seconds of a batch, on a machine that is busy: a process that waits without end has no more
)
MEMORY = 4 << 30  # bytes of a batch's process

WORKER = """
import json, sys
from hypothesis import HealthCheck, Phase, given, seed, settings, strategies as st
from kinds import KINDS
kind, number, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
cases, faults = 0, []

@seed(number)
@settings(max_examples=count, database=None, deadline=None, phases=[Phase.generate],
          suppress_health_check=list(HealthCheck), report_multiple_bugs=False)
@given(st.data())
def run(data):
    global cases
    cases += 1
    try:
        KINDS[kind](data)
    except Exception as error:
        if type(error).__module__.startswith("hypothesis"):
            raise
        faults.append(f"{type(error).__name__}: {error}")

run()
print(json.dumps([cases, faults]))
"""


def batch(kind: str, seed: int) -> tuple[str, int, int, list[str]]:
    """Run a batch of cases of one kind; return the kind, the seed, the number of cases and the faults."""
    limits = (
        f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({MEMORY}, {MEMORY}))\n"
        f"resource.setrlimit(resource.RLIMIT_CPU, ({WORK}, {WORK + 5}))\n"
    )
    command = [sys.executable, "-c", limits + WORKER, kind, str(seed), str(BATCH)]
    try:
        done = subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=LONGEST, check=False
        )
    except subprocess.TimeoutExpired:
        return kind, seed, 0, [f"hang: no end within {LONGEST:g} s"]
    if -done.returncode == signal.SIGXCPU:
        return kind, seed, 0, [f"hang: no end within {WORK} s of processor time"]
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return kind, seed, 0, [f"exit code {done.returncode}: {last}"]
    cases, faults = json.loads(done.stdout.splitlines()[-1])
    return kind, seed, cases, faults


def main() -> None:
    """Print the faults as they come, then a table of cases and faults by kind."""
    sys.path.insert(0, str(Path(__file__).parent))
    from kinds import KINDS

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0, help="the first batch's seed")
    parser.add_argument("--kinds", default=",".join(KINDS), help=f"of {', '.join(KINDS)}")
    args = parser.parse_args()
    kinds = args.kinds.split(",")
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"no kind is called {', '.join(sorted(unknown))}; there are {', '.join(KINDS)}")
    end, cases, faults = time.monotonic() + 60 * args.minutes, Counter[str](), Counter[str]()
    seed = args.seed
    with ThreadPoolExecutor(args.jobs) as pool:
        while time.monotonic() < end:
            for kind, number, count, broken in pool.map(batch, kinds, [seed] * len(kinds)):
                cases[kind] += count
                faults[kind] += len(broken)
                for fault in broken:
                    print(f"{kind}, seed {number}: {fault}", flush=True)
            seed += 1
    print(f"{'kind':<16}{'cases':>10}{'faults':>8}")
    for kind in kinds:
        print(f"{kind:<16}{cases[kind]:>10}{faults[kind]:>8}")
    raise SystemExit(1 if faults.total() else 0)


if __name__ == "__main__":
    main()
