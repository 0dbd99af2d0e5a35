"""Limits of what a page may ask for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Budget:
    """Limits of the questions of one kind.

    Attributes
    ----------
    processes : int
        How many are answered at once.
    seconds : float
        Processor time of a question.
    share : float
        Seconds after which a question ends if another one waits.
    """

    processes: int
    seconds: float
    share: float


RUNS = Budget(processes=16, seconds=10.0, share=2.0)
MAPS = Budget(processes=2, seconds=60.0, share=10.0)  # of sections, and again of diagrams and tables
STEPS = 10_000_000  # of a run
KEPT = 64 << 20  # bytes of answers of each kind that are kept for equal questions
CLASS_PAGES = 8  # open at once from one address, in a class
QUESTIONS = 64  # that a page may have open
CONNECTIONS = 256  # in all
CLIENT_CONNECTIONS = 64  # from one address
BACKLOG = 128  # connections that wait to be accepted
MESSAGE = 1 << 16  # bytes of a message on the WebSocket
PAUSE = 10.0  # Seconds that a connection may be silent, a sender pause, or a request's head take
UPLOAD = 300 << 20  # bytes of a film or a table
PIXELS = 4096 * 2304  # of a film's frame
FRAMES = 40_000  # of a film
CPU_SECONDS = 1800  # of a job
MEMORY = 12 << 30  # bytes of address space of a job
JOBS = 8  # waiting or kept for download
MODEL_SECONDS = 1200.0  # of a run, as time passes on the page
SAMPLES = 4096  # in one piece of a run
POINTS = 12_800  # of a section
RENDERED = 60.0  # s of a film made of a run
