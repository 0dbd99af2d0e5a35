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


LITTLE_MEMORY = """
import resource
import numpy as np, udd
resource.setrlimit(resource.RLIMIT_AS, ({limit}, {limit}))
try:
    {call}
except MemoryError as error:
    print(error)
print(udd.simulate(udd.DLE(1.0), 1.0, [1, 1, 1]).outcome)
"""


def memory_error_of(call: str, limit: int = 2 << 30, seconds: float = 60.0) -> str:
    """Run a call that needs more memory than the limit (bytes), and return the words of its MemoryError.

    Raises
    ------
    AssertionError
        It is not refused in one line, or a short run does not finish afterwards.
    """
    printed = output_of(LITTLE_MEMORY.format(call=call, limit=limit), seconds).splitlines()
    assert len(printed) == 2 and printed[1] == "finished", printed
    return printed[0]
