"""Descriptions of the parameters of models and cameras."""

from __future__ import annotations

from udd.models import profile_of

_CAMERA = {
    "y0": "contact point, to the right of the assumed one",
    "z0": "contact point, above the assumed one",
    "tilt": "camera turned clockwise",
    "scale": "picture larger than assumed",
    "right": "centre of the marks, right of the disk's own (red mark on top)",
    "up": "centre of the marks, above the disk's own (red mark on top)",
    "lag": "orientation seen later than position",
    "row": "rolling shutter: time per height in the picture",
    "shutter": "blur by the shutter: its open time squared, divided by 24",
    "lens": "magnification by the lens at 0.1 m from the picture's middle",
    "middle_y": "the picture's middle, right of the contact",
    "middle_z": "the picture's middle, above the contact",
    "clock": "recorded time runs fast",
    "theta0": "zero of the angle",
    "aside": "pivot to the right of the assumed one, in lengths of the pendulum",
    "above": "pivot above the assumed one, in lengths of the pendulum",
}


def meaning(name: str, kind: str) -> str:
    """Describe a free parameter of a model of this kind, or of its camera; empty for an effect's."""
    base, profile = name.partition("[")[0], profile_of(kind)
    return "" if profile.written else profile.shown.meanings.get(base, _CAMERA.get(base, ""))
