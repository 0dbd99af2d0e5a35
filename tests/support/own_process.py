"""Code in a process of its own, where a hang or the end of the interpreter fails one test and no other."""

from __future__ import annotations

import os
import signal
import subprocess
import sys


def output_of(code: str, seconds: float = 30.0) -> str:
    """Run the code and return what it prints.

    Raises
    ------
    AssertionError
        It takes longer, or the process ends with an error. Its own processes are ended with it.
    """
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        printed, said = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired as error:
        os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
        process.communicate()
        raise AssertionError(f"not finished after {seconds:g} s") from error
    assert process.returncode == 0, f"exit code {process.returncode}: {said[-2000:]}"
    return printed
