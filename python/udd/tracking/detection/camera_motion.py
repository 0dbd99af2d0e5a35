"""Motion, zoom and exposure of a camera, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from udd.tracking.correction import Correction

Array = NDArray[np.float64]
SURE = 5.0  # standard errors by which equal views may differ
STEADY = 0.2  # pixels: a camera that moves less is at rest
AS_BRIGHT = 0.15  # relative change of light that is not corrected
# errors that change with the view, at the middle and at the corner [reduced pixels]
PLACED, TURNED = 0.007, 0.05
AROUND = 2  # frames on each side that show whether the camera rests
REST, RESTING = 20, 0.95  # frames that a rest lasts at least, and the share of them with the same view


@dataclass(frozen=True)
class CameraMotion:
    """The view of each frame: a point z of the first picture lies at ``factor z + shift``; its light; errors.

    NaN where the background was not seen. `sigma` (n, 3): of u and v at `middle` [pixels], and of the turn.
    `reduction`: pixels of the film that were averaged in each direction.
    """

    factor: NDArray[np.complex128]
    shift: NDArray[np.complex128]
    gain: Array
    sigma: Array
    middle: complex
    reduction: int = 1

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Frames whose background was seen."""
        return np.asarray(np.isfinite(self.shift))

    @property
    def moved(self) -> NDArray[np.complex128]:
        """Return the distance of the picture's middle from its median place in each frame [pixels]."""
        away = self.factor * self.middle + self.shift - self.middle
        return np.asarray(away - complex(np.nanmedian(away.real), np.nanmedian(away.imag)))

    @property
    def turned(self) -> Array:
        """Return the motion of half the picture's diagonal by roll and zoom [pixels]."""
        away = self.factor / np.nanmedian(np.abs(self.factor))
        return np.asarray(np.abs(away - complex(np.nanmedian(away.real), np.nanmedian(away.imag))))

    @property
    def rms(self) -> float:
        """Motion of the picture's middle [pixels r.m.s.]."""
        return float(np.sqrt(np.nanmean(np.abs(self.moved) ** 2)))

    @property
    def steady(self) -> bool:
        """True if the camera was at rest."""
        if not self.is_measured.any():
            return True
        away = np.abs(self.moved) + self.turned * abs(self.middle)
        unsure = self.sigma[:, 0] + self.sigma[:, 2] * abs(self.middle)
        return bool(np.nanquantile(away - SURE * unsure, 0.99) < STEADY)

    @property
    def corner(self) -> NDArray[np.complex128]:
        """Place of the middle, and half the diagonal, in each frame (n, 2) [pixels]."""
        return np.column_stack([self.factor * self.middle + self.shift, self.factor * abs(self.middle)])

    @property
    def alike(self) -> Array:
        """Distance up to which two views are the same in each frame [pixels]."""
        return np.asarray(STEADY + SURE * (self.sigma[:, 0] + self.sigma[:, 2] * abs(self.middle)))

    @property
    def resting(self) -> NDArray[np.bool_]:
        """Frames whose view is that of the frames around: a camera that stands still between bumps."""
        place = self.corner
        out = np.ones(len(place), dtype=bool)
        for step in range(1, AROUND + 1):
            moved = np.abs(place[step:] - place[:-step]).sum(axis=1) > self.alike[step:]
            out[step:] &= ~moved
            out[:-step] &= ~moved
        return out

    def rested(self) -> CameraMotion:
        """Return the motion with the mean view of each part in which the camera rests."""
        place, sigma = self.corner, self.sigma.copy()
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.resting, [False]]).astype(int)))
        for first, end in edges.reshape(-1, 2):
            part = np.flatnonzero(self.is_measured[first:end]) + first
            if len(part) < REST:
                continue
            mean = place[part].mean(axis=0)
            same = np.abs(place - mean).sum(axis=1) < self.alike
            if same[part].mean() < RESTING:
                continue
            while first > 0 and same[first - 1]:
                first -= 1
            while end < len(place) and same[end]:
                end += 1
            # the points' errors hardly change from frame to frame, so that their mean is no better
            off = place[part] - mean
            turn = float(np.std(np.angle(self.factor[part])))
            sigma[first:end] = float(off[:, 0].real.std()), float(off[:, 0].imag.std()), turn
            place[first:end] = mean
        factor = place[:, 1] / abs(self.middle)
        return replace(self, factor=factor, shift=place[:, 0] - factor * self.middle, sigma=sigma)

    @property
    def as_bright(self) -> bool:
        """True if the light stays nearly the same."""
        return not self.is_measured.any() or bool(np.nanmax(np.abs(self.gain - 1)) < AS_BRIGHT)

    @property
    def text(self) -> str:
        """A sentence about what the camera did."""
        said = []
        if not self.steady:
            zoom = 100 * (np.nanmax(np.abs(self.factor)) / np.nanmin(np.abs(self.factor)) - 1)
            if zoom < 1 or self.rms > STEADY:
                said.append(f"the camera moved, by {self.rms:.2g} pixels r.m.s.")
            if zoom >= 1:
                said.append(f"the camera zoomed, by {zoom:.0f} %")
        if not self.as_bright:
            ratio = np.nanmax(self.gain) / np.nanmin(self.gain)
            said.append(f"the light of the pictures changes by a factor of {ratio:.2f}")
        lost = int((~self.is_measured).sum())
        frames = "one frame" if lost == 1 else f"{lost} frames"
        rest = f", but for {frames} without a background" if lost and not self.steady else ""
        return f"{' and '.join(said)}: what stands still about the disk shows it, and it is undone{rest}"

    @property
    def meta(self) -> dict[str, Any]:
        """Entries of the measurement's header."""
        if self.steady:
            return {}
        place = float(np.nanmedian(self.sigma[:, 0]))
        return {"camera_moved_px": round(self.rms, 4), "camera_sigma_px": round(place, 4)}

    def correction(self, before: Correction) -> Correction:
        """Return what steadies the pictures; a frame without a known view has that of the last known one."""
        last, lit = _last_known(self.is_measured), _last_known(np.isfinite(self.gain))
        none, full = np.empty(0, np.complex128), before.full_range
        factor, shift = (none, none) if self.steady else (self.factor[last], self.shift[last])
        gain = np.empty(0) if self.as_bright else self.gain[lit]
        return Correction(before.turns, before.mirrored, factor, shift, gain, full)

    def errors(self, at: NDArray[np.complex128]) -> list[Array]:
        """Standard errors (n, 3) of u, v and beta of a disk at these places, one array for each cause.

        The points are placed by the fraction of a pixel at which they lie, so that a view that changes has
        errors beyond their scatter.
        """
        arm = at - self.middle
        u, v, turn = np.nan_to_num(self.sigma[: len(at)]).T
        moving = self.reduction * ~self.resting[: len(at)]
        u, v = np.hypot(u, PLACED * moving), np.hypot(v, PLACED * moving)
        turn = np.hypot(turn, TURNED / abs(self.middle) * moving)
        return [
            np.column_stack([u, 0 * turn, 0 * turn]),
            np.column_stack([0 * turn, v, 0 * turn]),
            np.column_stack([-arm.imag * turn, arm.real * turn, turn]),
            np.column_stack([arm.real * turn, arm.imag * turn, 0 * turn]),
        ]


def _last_known(known: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for each frame the last known one, or the first one before that."""
    last = np.maximum.accumulate(np.where(known, np.arange(len(known)), 0))
    return np.asarray(np.maximum(last, int(np.argmax(known))))


def about_median(motion: CameraMotion) -> CameraMotion:
    """Return the motion against the camera's usual view, because the first roll is not special."""
    if not motion.is_measured.any():
        return motion
    factor, middle = motion.factor, motion.middle
    usual = complex(np.nanmedian(factor.real), np.nanmedian(factor.imag))
    there = factor * middle + motion.shift
    back = (middle - complex(np.nanmedian(there.real), np.nanmedian(there.imag))) / usual
    gain = motion.gain / np.nanmedian(motion.gain)
    return replace(
        motion,
        factor=factor / usual,
        shift=motion.shift + factor * (middle + back - middle / usual),
        gain=gain,
    )
