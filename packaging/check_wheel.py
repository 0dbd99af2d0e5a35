"""Install a wheel into an empty environment of each interpreter, and run commands that need no extra.

Usage: python packaging/check_wheel.py WHEEL PYTHON [PYTHON ...]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

# Commands, each with a text of its output; `udd app` must name the extra that it needs.
COMMANDS = (
    (("--version",), "udd "),
    (("example", "pendulum"), "pendulum.csv"),
    (("fit", "pendulum.csv"), "length"),
    (("discover", "pendulum.csv", "--budget", "30", "--report", "report.html"), "report: report.html"),
    (("lyapunov", "1"), "lambda_1"),
    (("bifurcation", "w", "--from", "5", "--to", "6", "--n", "2"), "udd[scale]"),
    (("app", "--no-browser"), "udd[app]"),
)


def check(wheel: Path, python: str) -> None:
    """Raise if the wheel does not work with this interpreter."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", "clean"], cwd=folder, check=True, env=clean)
        scripts = Path(folder) / "clean" / ("Scripts" if os.name == "nt" else "bin")
        pip = [scripts / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, wheel], cwd=folder, check=True, env=clean)
        for arguments, words in COMMANDS:
            command = [scripts / "udd", *arguments]
            answer = subprocess.run(
                command, cwd=folder, env=clean, capture_output=True, text=True, timeout=600
            )
            output = answer.stdout + answer.stderr
            if words not in output:
                raise SystemExit(f"{python}: udd {' '.join(arguments)} does not say {words!r}:\n{output}")
            print(f"{python}: udd {' '.join(arguments)}: as expected", flush=True)


if __name__ == "__main__":
    for interpreter in sys.argv[2:]:
        check(Path(sys.argv[1]).resolve(), interpreter)
