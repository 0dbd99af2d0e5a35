"""The disk's centre from its rim, where something shifts the rim in the picture."""

import numpy as np
import pytest

from udd.tracking.calibration.rim import outline, turning_circle
from udd.tracking.geometry.pose import DiskAppearance, Mark, Motion, Pose
from udd.video.reader import Picture, TrackError, light_of_codes

CENTRE, RADIUS = 0.8 - 0.5j, 140.0


def rim(
    rng: np.random.Generator, turns: float, shift: complex, frames: int = 40
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points on a rim in the body's frame, with their frames' rotations; half of the rim is hidden."""
    points, turned, number = [], [], []
    for k in range(frames):
        turn = np.exp(1j * turns * rng.uniform(-np.pi, np.pi))
        way = np.exp(1j * rng.uniform(0.3, 2 * np.pi - 1.5, 120))  # in the picture
        noise = 0.1 * rng.standard_normal(len(way)) + 0.05 * rng.standard_normal()
        points.append(CENTRE + (RADIUS + noise + (shift * way.conj()).real) * way / turn)
        turned.append(np.full(len(way), turn))
        number.append(np.full(len(way), k))
    return np.concatenate(points), np.concatenate(turned), np.concatenate(number)


@pytest.mark.parametrize("turns", [1.0, 0.3])
def test_a_shift_in_the_picture_is_not_taken_for_the_centre(turns: float) -> None:
    circle = turning_circle(*rim(np.random.default_rng(1), turns, 0.15 - 0.1j))
    assert abs(circle.centre - CENTRE) < 4 * circle.centre_sigma < 0.2
    assert abs(circle.radius - RADIUS) < 4 * circle.sigma < 0.2


def test_the_centre_is_as_good_as_said() -> None:
    z = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        circle = turning_circle(*rim(rng, 0.5, complex(*rng.normal(0, 0.2, 2))))
        off = (circle.centre - CENTRE) / circle.centre_sigma
        z += [off.real, off.imag]
    # the rms of 400 numbers scatters by 4 % by chance; what 40 frames say of the errors is a little low
    assert 0.9 < np.sqrt(np.mean(np.square(z))) < 1.15


def test_a_disk_that_does_not_turn_has_its_centre_where_its_rim_seems_to_be() -> None:
    circle = turning_circle(*rim(np.random.default_rng(2), 0.0, 0.2 + 0.1j))
    assert abs(circle.centre - CENTRE) < 3 * circle.centre_sigma
    assert circle.centre_sigma > 0.15  # as well as is known how far rims seem to be shifted


def test_edges_on_few_rays_are_no_rim() -> None:
    """Edges of books about a disk that is as bright as the wall made the scale 5 % wrong."""
    middle, reach = 150 + 150j, 80.0
    column, row = np.meshgrid(np.arange(300), np.arange(300))
    arm = column + 1j * row - middle
    codes = np.full((300, 300), 200, np.uint8)
    codes[(np.abs(arm) > 1.3 * reach) & (np.abs(np.angle(arm)) < np.radians(4.5))] = 60
    picture = Picture(0, 0.0, codes, codes[::2, ::2], codes[::2, ::2])
    marks = [Mark(reach * 1j**k, (5.0, 5.0), 0.0, -60.0) for k in range(4)]
    look = DiskAppearance(marks, 0.8, 2.0, light_of_codes(False), 1.1 * reach)
    frames = [(picture, Pose(middle, 0.0), Motion())] * 20
    with pytest.raises(TrackError, match="rim does not stand out"):
        outline(frames, look, np.ones((300, 300), dtype=bool))
