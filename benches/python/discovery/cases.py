"""The cases: which law at which multiple of its detection limit, before which camera; all of it drawn."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from camera import ALONE, FPS, Camera, drawn, film
from filmed import filmed
from information import information
from laws import ASTRAY, FOREIGN, LIBRARY, Kind, Law, Look
from motion import Device, Run, World, staying
from sensors import BODIES, FAULTS
from units import TRAIN, assumed, threshold

import udd

DRIVES = (0.016, 0.083)  # m/s
_ROUNDS = 8  # to scale a law to its multiple of the limit, each from another start
_CLOSE = 0.1  # tolerance of a prescribed multiple
_NEAR = 0.3  # tolerance of a drawn multiple; the record keeps the real one
_DRAWS = 40
_EASED = 8  # draws after which strong laws are drawn weaker, within their range


@dataclass(frozen=True)
class Case:
    """A case to draw: the kinds of the laws, and their multiples of the detection limit."""

    batch: str
    names: tuple[str, ...]
    number: int
    multiples: tuple[float, float] = (1.0, 1.0)
    defect: str = "all"

    @property
    def title(self) -> str:
        """How it is called in a table."""
        if self.batch == "sensors":
            return f"{self.names[0]}, {self.defect}"
        return " + ".join(self.names) or f"null ({self.defect})"

    def generator(self, seed: int) -> np.random.Generator:
        """Return the generator of all random numbers of a record."""
        return np.random.default_rng([seed, zlib.crc32(f"{self.batch} {self.title}".encode()), self.number])


@dataclass(frozen=True)
class Record:
    """A drawn record: the truth, and its observation by the camera."""

    world: World
    motion: Run
    camera: Camera
    multiples: tuple[float, ...]
    known: udd.Disk
    measurement: udd.Measurement


BATCHES = ("three", "library", "foreign", "strong", "pairs", "nulls", "sensors", "films")
_STRONG = (0.3, 3.0)  # times gravity's pull on the motion, see `_strength`
_RESTING = ("stribeck",)  # it brakes slow disks alone: as strong as that on average it holds them at rest
_ROUNDS_STRONG = 3
_LIVELY = (1.0, 0.01)  # rad/s and m, r.m.s.: what brakes or binds so hard that the disk rests is no record


def cases(batch: str, numbers: Iterable[int]) -> Iterator[Case]:
    """The cases of a batch, of each kind those of these numbers."""
    names = list(LIBRARY)
    for number in numbers:
        if batch == "three":
            yield from (Case(batch, (name,), number, (3.0, 3.0)) for name in names)
        elif batch == "library":
            yield from (Case(batch, (name,), number, (1.0, 10.0)) for name in names)
        elif batch == "foreign":
            yield from (Case(batch, (name,), number, (3.0, 10.0)) for name in FOREIGN)
        elif batch == "strong":
            some = [name for name in (*LIBRARY, *FOREIGN, *ASTRAY) if name not in _RESTING]
            yield from (Case(batch, (name,), number, _STRONG) for name in some)
        elif batch == "pairs":
            rng = np.random.default_rng([zlib.crc32(b"pairs"), number])
            for _ in range(6):
                yield Case(batch, tuple(rng.choice(names, 2, replace=False).tolist()), number, (3.0, 10.0))
        elif batch == "nulls":
            yield from (Case(batch, (), number, defect=defect) for defect in ("all", *ALONE))
        elif batch == "sensors":
            yield from (Case(batch, (body,), number, defect=fault) for body in BODIES for fault in FAULTS)
        elif batch == "films":
            yield Case(batch, (), number, defect="film")


def draw(case: Case, seed: int, duration: float, *, precise: bool) -> Record:
    """The record of a case; the same for the same seed."""
    rng = case.generator(seed)
    t = np.arange(0, TRAIN * duration, 1 / FPS)
    kinds = [(LIBRARY | FOREIGN | ASTRAY)[name] for name in case.names]
    for number in range(_DRAWS):
        drive = rng.uniform(*DRIVES)
        known = udd.Disk(drive)
        spread = 1 + rng.normal(0, [0.02, 0.1, 0.1, 0.1])
        plain = known.parameters
        device = Device(*(f * plain[name] for f, name in zip(spread, ("W", "k0", "k1", "k2"), strict=True)))
        camera = _camera(case, rng, precise)
        low, high = case.multiples
        if case.batch == "strong":  # where the disk always leaves or rests, weaker laws of the range
            high = low * (high / low) ** (1 - max(number - _EASED, 0) / _DRAWS)
        wanted = np.exp(rng.uniform(np.log(low), np.log(high), len(kinds)))
        close = _CLOSE if case.multiples[0] == case.multiples[1] else _NEAR
        if case.batch == "strong":
            made = _at_strength(World(device), kinds[0], float(wanted[0]), t, duration, rng)
        else:
            made = _at_multiples(World(device), kinds, wanted, close, camera, known, t, duration, rng)
        if made is None:
            continue
        world, motion, multiples = made
        if case.batch == "films":
            return Record(world, motion, camera, multiples, known, filmed(motion, duration, rng))
        stated, seen = film(camera, motion, duration, rng)
        sigma = np.tile([camera.noise, camera.noise, camera.angle_noise], (len(stated), 1))
        # A picture's middle is where it is, in coordinates that count from where the pivot is taken to be.
        meta = {"middle": [m + off for m, off in zip(camera.middle, camera.offset, strict=True)]}
        measured = udd.Measurement(stated, seen, sigma=sigma, meta=meta)
        return Record(world, motion, camera, multiples, known, measured)
    raise RuntimeError(f"{case.title}: the disk leaves the wheels in every draw")


def _camera(case: Case, rng: np.random.Generator, precise: bool) -> Camera:
    if case.defect in ("all", "film"):
        return drawn(rng, precise, hard=not case.names)
    plain = Camera(noise=5e-5, angle_noise=1e-3) if precise else Camera()
    return replace(plain, **ALONE[case.defect])


def _at_multiples(
    world: World,
    kinds: list[Kind],
    wanted: np.ndarray,
    close: float,
    camera: Camera,
    known: udd.Disk,
    t: np.ndarray,
    duration: float,
    rng: np.random.Generator,
) -> tuple[World, Run, tuple[float, ...]] | None:
    """The laws at the wanted multiples of their limits, and a motion that stays between the wheels.

    A law changes the motion and with it its own limit: both are brought together in a few rounds.
    """
    motion = staying(world, duration, rng)
    if motion is None or not kinds:
        return motion and (world, motion, ())
    laws = tuple(_unit(kind, motion, t, rng) for kind in kinds)
    for done in range(_ROUNDS + 1):
        sizes = [_multiple(world, law, motion, camera, known, t) for law in laws]
        if done and all(abs(s / w - 1) < close for s, w in zip(sizes, wanted, strict=True)):
            return world, motion, tuple(sizes)
        laws = tuple(law.scaled(w / s) for law, s, w in zip(laws, sizes, wanted, strict=True))
        world = World(world.device, laws)
        motion = staying(world, duration, rng)
        if motion is None:
            return None
    return None


def _at_strength(
    world: World, kind: Kind, wanted: float, t: np.ndarray, duration: float, rng: np.random.Generator
) -> tuple[World, Run, tuple[float, ...]] | None:
    """The law as strong as wanted, and a motion that goes on and stays between the wheels."""
    motion = staying(world, duration, rng)
    if motion is None:
        return None
    law = _unit(kind, motion, t, rng)
    size = _strength(world, law, motion, t)
    for _ in range(_ROUNDS_STRONG):
        law = law.scaled(wanted / size)
        world = World(world.device, (law,))
        motion = staying(world, duration, rng)
        if motion is None or not _lively(motion(t)):
            return None
        size = _strength(world, law, motion, t)
        if _STRONG[0] <= size <= _STRONG[1]:
            return world, motion, (size,)
    return None


def _lively(states: np.ndarray) -> bool:
    """Whether the disk turns and its centre moves about."""
    omega, y, z = states.T[:3]
    return bool(np.sqrt((omega**2).mean()) > _LIVELY[0] and np.hypot(y.std(), z.std()) > _LIVELY[1])


def _strength(world: World, law: Law, motion: Run, t: np.ndarray) -> float:
    """How strong a law is: r.m.s. of its torque in units of gravity's g Y, of its velocity in units of W."""
    omega, y, z, beta = motion(t).T
    d = world.device
    push = law.kind.formula(Look(d, t, omega, y, z, beta), law.amplitudes, law.shape)
    torque = np.sqrt(np.mean((push.torque - push.k * omega) ** 2) / np.mean((d.g * y) ** 2))
    moved = np.sqrt(np.mean(np.broadcast_to(push.u**2 + push.w**2, t.shape))) / d.W
    return float(max(torque, moved))


def _multiple(world: World, law: Law, motion: Run, camera: Camera, known: udd.Disk, t: np.ndarray) -> float:
    """The law's size in units of its detection limit, on this motion."""
    result = information(world, law, motion, camera, assumed(known), t)
    a = np.array(law.amplitudes)
    return float(np.sqrt(a @ result @ a / threshold(known, t, len(a))))


def _unit(kind: Kind, motion: Run, t: np.ndarray, rng: np.random.Generator) -> Law:
    """The law with drawn shape, direction and sign, its size still arbitrary."""
    shape = {name: _shape(range_, rng) for name, range_ in kind.shapes.items()}
    momentum = str(rng.choice(kind.momenta)) if kind.momenta else None
    angle = rng.uniform(0, 2 * np.pi)
    sign = 1.0 if kind.positive else float(rng.choice([-1.0, 1.0]))
    if kind.name == "cable_torque":
        beta = motion(t)[:, 3]
        amplitudes = (1.0, float(rng.uniform(beta.min(), beta.max())))  # at rest at some angle of the record
    elif len(kind.amplitudes) == 2:
        amplitudes = (np.cos(angle), np.sin(angle))
    else:
        amplitudes = (sign,)
    return Law(kind, tuple(1e-4 * a for a in amplitudes), shape, momentum)


def _shape(given: tuple[float, float] | list[float], rng: np.random.Generator) -> float:
    if isinstance(given, list):
        return float(rng.choice(given))
    return float(np.exp(rng.uniform(*np.log(given))))
