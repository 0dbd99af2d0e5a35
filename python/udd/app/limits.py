"""What a page may ask for."""

from __future__ import annotations

MESSAGE = 1 << 16  # bytes of a message on the WebSocket
PAUSE = 10.0  # s that a sender may take between two pieces of a request
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
