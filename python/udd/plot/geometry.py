"""The device drawn: wheels, disk, coordinates, angles and their signs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from udd._util.arguments import checked_arguments
from udd._util.validation import array, number
from udd.errors import UddError

from .style import AFTER, BEFORE, FAINT, MEASURED, SQUARE, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.transforms import Bbox
    from numpy.typing import ArrayLike, NDArray

#: The paper's device [m]: radius of the wheels, width of the wider rim, thickness of the disk.
WHEEL, FLAT, THICKNESS = 0.03, 0.013, 0.0015

_LARGEST = 1e9  # cm
_CM = 100.0
_THETA, _PHI, _DISTANCE = np.deg2rad(38.0), np.deg2rad(52.0), 0.6  # of the snapshot; distance in radii
_MARK = 0.8  # where the mark sits, in radii
_TURNS = tuple(np.pi / 8 * k for k in (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8))


@checked_arguments(error=UddError)
def geometry(
    ax: Axes | None = None, *, state: ArrayLike | None = None, R: float = 0.08, view: str = "front"
) -> Axes:
    """Draw the device with its coordinates: contact O, centre C, mark M, and the signs of the angles.

    Parameters
    ----------
    ax : Axes, optional
    state : array_like, shape (4,), optional
        ``[Omega, Y, Z, beta]`` in rad/s, m, m, rad; by default a snapshot in which no two lines meet.
    R : float
        Radius of the disk [m].
    view : {"front", "side"}
        In the disk's plane (the paper's Figure 2), or along it, where one sees the wheels turn (Figure 1a).

    Returns
    -------
    Axes
        In cm; to save it as vector graphics: ``ax.figure.savefig("geometry.svg")``.

    Raises
    ------
    UddError
        A view that there is not, a state without four numbers, a radius that is not positive.

    See Also
    --------
    udd.Disk : the model.
    udd.plot.orbit : draw the path of the centre.

    Notes
    -----
    Angles count clockwise from the upward vertical: ``(Y, Z) = |OC| (sin theta, cos theta)``, and the mark
    lies at ``beta = theta + phi``. ``Omega = dbeta/dT`` is positive clockwise. The wheels drive the disk's
    material at O upward with speed W.

    Examples
    --------
    >>> import udd
    >>> udd.plot.geometry(view="side").get_xlabel()
    'x [cm]'
    """
    if view not in ("front", "side"):
        raise UddError(f'view must be "front" or "side", not {view!r}')
    radius = _CM * number("R", R, above=0.0)
    if radius > _LARGEST:
        raise UddError(f"R must be at most {_LARGEST:g} cm to be drawn, not {radius:g} cm")
    ax = new_axes(ax, size=SQUARE)
    names = _side(ax, radius) if view == "side" else _front(ax, radius, *_centre_and_mark(state, radius))
    ax.set_aspect("equal")
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0, labelsize="small", labelcolor=MEASURED)
    _place(ax, names)
    return ax


def _centre_and_mark(state: ArrayLike | None, radius: float) -> tuple[NDArray[np.float64], float]:
    """Return the centre [cm] and beta."""
    if state is None:
        return _DISTANCE * radius * _towards(_THETA), _THETA + _PHI
    values = array("state", state)
    if values.shape != (4,):
        raise UddError(f"the state must be four finite numbers [Omega, Y, Z, beta], not {state!r}")
    return _CM * values[1:3], float(values[3])


def _towards(angle: Any) -> NDArray[np.float64]:
    """Return the unit vector at an angle clockwise from upright; the coordinates are along the last axis."""
    return np.stack([np.sin(angle), np.cos(angle)], axis=-1)


def _front(ax: Axes, radius: float, centre: NDArray[np.float64], beta: float) -> list[_Name]:
    from matplotlib.patches import Circle, Rectangle

    theta = float(np.arctan2(*centre))
    mark = centre + _MARK * radius * _towards(beta)
    ax.add_patch(Circle(tuple(centre), radius, facecolor="#eaf2f8", edgecolor=MEASURED, linewidth=1.4))
    width, height = _CM * FLAT, 2 * _CM * WHEEL
    ax.add_patch(
        Rectangle(
            (-width / 2, -height / 2),
            width,
            height,
            facecolor="#00000014",
            edgecolor=FAINT,
            linewidth=1.0,
            linestyle="--",
        )
    )
    reach = 1.35 * radius
    tips = ((reach, 0.0), (0.0, reach))
    for tip in tips:
        _arrow(ax, (0, 0), tip, MEASURED, 0.9)
    beyond = centre + 0.75 * radius * _towards(theta)
    ax.plot(*np.stack([np.zeros(2), centre], axis=1), color=AFTER, linewidth=1.8)
    ax.plot(*np.stack([centre, beyond], axis=1), "--", color=AFTER, linewidth=1.1)
    ax.plot(*np.stack([centre, mark], axis=1), color=BEFORE, linewidth=1.2)
    ax.plot(
        *np.stack([centre, centre + np.array([0, 0.75 * radius])], axis=1), ":", color=MEASURED, linewidth=1.1
    )
    rim = centre + radius * _towards(theta + 1.6)
    ax.plot(*np.stack([centre, rim], axis=1), color=FAINT, linewidth=1.0)
    for end in ((0.0, centre[1]), (centre[0], 0.0)):
        ax.plot([centre[0], end[0]], [centre[1], end[1]], ":", color=FAINT, linewidth=1.2)
    at_theta = _arc(ax, np.zeros(2), 0.3 * radius, 0.0, theta, AFTER)
    at_phi = _arc(ax, centre, 0.42 * radius, theta, beta, BEFORE)
    at_beta = _arc(ax, centre, 0.62 * radius, 0.0, beta, MEASURED)
    at_omega = _arc(ax, centre, 1.07 * radius, theta - 0.35, theta + 0.45, MEASURED)
    _arrow(ax, (0, 0), (0, 0.38 * radius), "#009e73", 2.2)
    _arrow(ax, tuple(centre), tuple(centre - [0, 0.4 * radius]), "black", 1.6)
    ax.plot(0, 0, "o", color="black", markersize=5)
    ax.plot(*centre, "o", color=AFTER, markersize=6)
    ax.plot(*mark, "s", color="#cc0000", markersize=9)
    ax.set_xlim(min(-0.55 * radius, centre[0] - 1.25 * radius), max(reach, centre[0] + 1.3 * radius))
    ax.set_ylim(min(-0.75 * radius, centre[1] - 1.25 * radius), max(reach, centre[1] + 1.3 * radius))
    ax.set_xlabel("y [cm]")
    ax.set_ylabel("z [cm]")
    return [
        _name((0.0, 0.0), "O", (-9, -9), "black"),
        _name(mark, "M", (13, 0), "#cc0000"),
        _name(centre, "C", (9, -9), AFTER),
        _name(tips[0], r"$\mathsf{y}$", (8, 0), MEASURED),
        _name(tips[1], r"$\mathsf{z}$", (8, 0), MEASURED),
        _name(at_omega, r"$\Omega > 0$", (14, 12), MEASURED),
        _name((0.0, 0.3 * radius), "W", (-12, 0), "#009e73"),
        _name(centre - [0, 0.36 * radius], r"$\mathbf{g}$", (-9, 0), "black"),
        _name(0.3 * centre + 0.7 * rim, r"$\mathcal{R}$", (0, 9), MEASURED),
        _name(at_theta, r"$\theta$", (3, 9), AFTER),
        _name(at_phi, r"$\phi$", (6, 7), BEFORE),
        _name(at_beta, r"$\beta$", (4, 9), MEASURED),
        _name(centre / 2, "R", (8, -7), AFTER),
        _name((centre[0] / 2, centre[1]), "Y", (0, 9), MEASURED),
        _name((centre[0], centre[1] / 2), "Z", (9, 0), MEASURED),
    ]


def _side(ax: Axes, radius: float) -> list[_Name]:
    from matplotlib.patches import Circle, Rectangle

    wheel, half = _CM * WHEEL, _CM * THICKNESS / 2
    bottom = 0.35 * radius - radius
    ax.add_patch(
        Rectangle(
            (-half, bottom), 2 * half, 2 * radius, facecolor="#eaf2f8", edgecolor=MEASURED, linewidth=1.4
        )
    )
    names = []
    for side, words in ((1, "drive wheel"), (-1, "support wheel")):
        middle = np.array([side * (wheel + half), 0.0])
        ax.add_patch(Circle(tuple(middle), wheel, facecolor="#00000014", edgecolor=MEASURED, linewidth=1.4))
        ax.plot(*middle, "o", color=MEASURED, markersize=3)
        start = -side * np.pi / 2
        _arc(ax, middle, 0.7 * wheel, start - side * 0.5, start + side * 0.9, "#009e73")
        names.append(_name(middle, words, (0, -24), MEASURED))
    _arrow(ax, (0, 0), (0, 0.38 * radius), "#009e73", 2.2)
    _arrow(ax, (0, bottom + 1.6 * radius), (0, bottom + 1.2 * radius), "black", 1.6)
    reach = 2.6 * wheel
    _arrow(ax, (0, 0), (reach, 0), MEASURED, 0.9)
    ax.plot(0, 0, "o", color="black", markersize=5)
    ax.set_xlim(-reach, 1.15 * reach)
    ax.set_ylim(bottom - 0.1 * radius, bottom + 2.15 * radius)
    ax.set_xlabel("x [cm]")
    ax.set_ylabel("z [cm]")
    return [
        *names,
        _name((0.0, 0.0), "O", (-10, -10), "black"),
        _name((0.0, 0.38 * radius), "W", (10, 0), "#009e73"),
        _name((0.0, bottom + 1.4 * radius), r"$\mathbf{g}$", (9, 0), "black"),
        _name((reach, 0.0), r"$\mathsf{x}$", (8, 0), MEASURED),
    ]


def _arrow(ax: Axes, start: Any, end: Any, colour: str, width: float) -> None:
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=style)


def _arc(
    ax: Axes, middle: NDArray[np.float64], radius: float, first: float, last: float, colour: str
) -> NDArray[np.float64]:
    """Draw an arc with an arrow at its end, clockwise if `last` is larger; return its middle."""
    line = middle + radius * _towards(np.linspace(first, last, 60))
    ax.plot(*line[:-2].T, color=colour, linewidth=1.1)
    _arrow(ax, line[-3], line[-1], colour, 1.1)
    at: NDArray[np.float64] = line[30]
    return at


def _name(at: Any, words: str, offset: tuple[float, float], colour: str) -> _Name:
    return _Name(tuple(at), words, offset, colour)


class _Name(NamedTuple):
    """A label: where what it names is, and how far from there it stands if there is room, in points."""

    at: tuple[float, float]
    words: str
    offset: tuple[float, float]
    colour: str


def _place(ax: Axes, names: Sequence[_Name]) -> None:
    """Write labels next to what they name, where they cover no other label and few lines."""
    figure = ax.get_figure(root=True)
    if figure is not None:
        figure.draw_without_rendering()  # the layout is done now: places are final
    lines = np.concatenate([ax.transData.transform(_dense(line)) for line in ax.lines])
    taken: list[Bbox] = []
    for name in names:
        text = ax.annotate(
            name.words,
            xy=name.at,
            xytext=name.offset,
            textcoords="offset points",
            color=name.colour,
            ha="center",
            va="center",
        )
        costs = []
        tried = [(turn, length) for length in (1.0, 1.4, 1.9) for turn in _TURNS]
        for turn, length in tried:
            text.set_position(_turned(name.offset, turn, length))
            box = text.get_window_extent().padded(1.0)
            inside = ((lines > box.min) & (lines < box.max)).all(axis=1).sum()
            covered = sum(box.overlaps(other) for other in taken)
            costs.append(1000.0 * covered + inside + abs(turn) + 4.0 * (length - 1.0))
        text.set_position(_turned(name.offset, *tried[int(np.argmin(costs))]))
        taken.append(text.get_window_extent().padded(1.0))


def _dense(line: Line2D) -> NDArray[np.float64]:
    """Points along a line, close enough that a label cannot lie between them."""
    points = np.column_stack(line.get_data()).astype(float)
    between = np.linspace(0.0, 1.0, 200 if len(points) == 2 else 2)[:, None, None]
    made: NDArray[np.float64] = (points[:-1] + between * np.diff(points, axis=0)).reshape(-1, 2)
    return made if len(points) > 1 else points


def _turned(offset: tuple[float, float], turn: float, length: float) -> tuple[float, float]:
    x, y = offset
    c, s = length * np.cos(turn), length * np.sin(turn)
    return (float(c * x - s * y), float(s * x + c * y))
