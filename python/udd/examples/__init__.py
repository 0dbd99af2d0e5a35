"""Small tables that ship with the package, to try functions and commands on.

They were simulated, and noise was added (:mod:`udd.examples.make`): a disk (``disk.csv``), a pendulum in air
(``pendulum.csv``), a phone on a pendulum as phyphox writes it (``phone.csv``), and a pendulum that a motor
drives (``driven.csv``, with its model ``driven.json``). All but the phone's have a law that the plain model
lacks.
"""

from __future__ import annotations

from .files import NAMES, path, write

__all__ = ["NAMES", "path", "write"]
