"""The device drawn: wheels, disk, coordinates, angles and their signs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from udd._util.validation import number
from udd.errors import UddError

from .style import AFTER, BEFORE, FAINT, MEASURED, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

#: Of the paper's device [m]: the wheels' radius, the width of the wider rim, the disk's thickness.
WHEEL, FLAT, THICKNESS = 0.03, 0.013, 0.0015

_CM = 100.0
_THETA, _PHI, _DISTANCE = np.deg2rad(38.0), np.deg2rad(52.0), 0.6  # of the snapshot; distance in radii
_MARK = 0.8  # where the mark sits, in radii


def geometry(
    ax: Axes | None = None, *, state: ArrayLike | None = None, R: float = 0.08, view: str = "front"
) -> Axes:
    """The device with its coordinates: contact O, centre C, mark M, the signs of Y, Z, theta, phi, beta.

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
    ax = new_axes(ax)
    if view == "side":
        _side(ax, radius)
    else:
        _front(ax, radius, *_centre_and_mark(state, radius))
    ax.set_aspect("equal")
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0, labelsize="small", labelcolor=MEASURED)
    return ax


def _centre_and_mark(state: ArrayLike | None, radius: float) -> tuple[NDArray[np.float64], float]:
    """The centre [cm] and beta."""
    if state is None:
        return _DISTANCE * radius * _towards(_THETA), _THETA + _PHI
    values = np.asarray(state, dtype=float)
    if values.shape != (4,) or not np.isfinite(values).all():
        raise UddError(f"the state must be four finite numbers [Omega, Y, Z, beta], not {state!r}")
    return _CM * values[1:3], float(values[3])


def _towards(angle: Any) -> NDArray[np.float64]:
    """The unit vector at an angle clockwise from upright; the coordinates along the last axis."""
    return np.stack([np.sin(angle), np.cos(angle)], axis=-1)


def _front(ax: Axes, radius: float, centre: NDArray[np.float64], beta: float) -> None:
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
    for tip, name, offset in (((reach, 0), "y", (6, -4)), ((0, reach), "z", (4, 2))):
        _arrow(ax, (0, 0), tip, MEASURED, 0.9)
        _name(ax, tip, f"$\\mathsf{{{name}}}$", offset, MEASURED)
    beyond = centre + 0.75 * radius * _towards(theta)
    ax.plot(*np.stack([np.zeros(2), centre], axis=1), color=AFTER, linewidth=1.8)
    ax.plot(*np.stack([centre, beyond], axis=1), "--", color=AFTER, linewidth=1.1)
    ax.plot(*np.stack([centre, mark], axis=1), color=BEFORE, linewidth=1.2)
    ax.plot(
        *np.stack([centre, centre + np.array([0, 0.75 * radius])], axis=1), ":", color=MEASURED, linewidth=1.1
    )
    rim = centre + radius * _towards(theta + 1.6)
    ax.plot(*np.stack([centre, rim], axis=1), color=FAINT, linewidth=1.0)
    _name(ax, 0.3 * centre + 0.7 * rim, r"$\mathcal{R}$", (2, 5), MEASURED)
    for end in ((0.0, centre[1]), (centre[0], 0.0)):
        ax.plot([centre[0], end[0]], [centre[1], end[1]], ":", color=FAINT, linewidth=1.2)
    _arc(ax, np.zeros(2), 0.24 * radius, 0.0, theta, r"$\theta$", AFTER)
    _arc(ax, centre, 0.42 * radius, theta, beta, r"$\phi$", BEFORE)
    _arc(ax, centre, 0.62 * radius, 0.0, beta, r"$\beta$", MEASURED)
    _arc(ax, centre, 1.07 * radius, theta - 0.35, theta + 0.45, r"$\Omega > 0$", MEASURED)
    _arrow(ax, (0, 0), (0, 0.38 * radius), "#009e73", 2.2)
    _name(ax, (0, 0.38 * radius), "W", (-14, -10), "#009e73")
    _arrow(ax, tuple(centre), tuple(centre - [0, 0.4 * radius]), "black", 1.6)
    _name(ax, centre - [0, 0.4 * radius], "$\\mathbf{g}$", (-14, -2), "black")
    ax.plot(0, 0, "o", color="black", markersize=5)
    ax.plot(*centre, "o", color=AFTER, markersize=6)
    ax.plot(*mark, "s", color="#cc0000", markersize=9)
    _name(ax, (0, 0), "O", (-14, -12), "black")
    _name(ax, centre, "C", (6, -13), AFTER)
    _name(ax, mark, "M", (8, -4), "#cc0000")
    _name(ax, centre / 2, "R", (5, -11), AFTER)
    _name(ax, (centre[0] / 2, centre[1]), "Y", (-4, 4), MEASURED)
    _name(ax, (centre[0], centre[1] / 2), "Z", (4, -4), MEASURED)
    ax.set_xlim(min(-0.55 * radius, centre[0] - 1.25 * radius), max(reach, centre[0] + 1.3 * radius))
    ax.set_ylim(min(-0.75 * radius, centre[1] - 1.25 * radius), max(reach, centre[1] + 1.3 * radius))
    ax.set_xlabel("y [cm]")
    ax.set_ylabel("z [cm]")


def _side(ax: Axes, radius: float) -> None:
    from matplotlib.patches import Circle, Rectangle

    wheel, half = _CM * WHEEL, _CM * THICKNESS / 2
    bottom = 0.35 * radius - radius
    ax.add_patch(
        Rectangle(
            (-half, bottom), 2 * half, 2 * radius, facecolor="#eaf2f8", edgecolor=MEASURED, linewidth=1.4
        )
    )
    for side, words in ((1, "drive wheel"), (-1, "support wheel")):
        middle = np.array([side * (wheel + half), 0.0])
        ax.add_patch(Circle(tuple(middle), wheel, facecolor="#00000014", edgecolor=MEASURED, linewidth=1.4))
        ax.plot(*middle, "o", color=MEASURED, markersize=3)
        start = -side * np.pi / 2
        _arc(ax, middle, 0.7 * wheel, start - side * 0.5, start + side * 0.9, "", "#009e73")
        _name(ax, middle, words, (-28, -32), MEASURED)
    _arrow(ax, (0, 0), (0, 0.38 * radius), "#009e73", 2.2)
    _name(ax, (0, 0.38 * radius), "W", (8, 2), "#009e73")
    _arrow(ax, (0, bottom + 1.6 * radius), (0, bottom + 1.2 * radius), "black", 1.6)
    _name(ax, (0, bottom + 1.6 * radius), "$\\mathbf{g}$", (6, -8), "black")
    reach = 2.6 * wheel
    _arrow(ax, (0, 0), (reach, 0), MEASURED, 0.9)
    _name(ax, (reach, 0), r"$\mathsf{x}$", (4, -4), MEASURED)
    ax.plot(0, 0, "o", color="black", markersize=5)
    _name(ax, (0, 0), "O", (-14, -14), "black")
    ax.set_xlim(-reach, 1.15 * reach)
    ax.set_ylim(bottom - 0.1 * radius, bottom + 2.15 * radius)
    ax.set_xlabel("x [cm]")
    ax.set_ylabel("z [cm]")


def _arrow(ax: Axes, start: Any, end: Any, colour: str, width: float) -> None:
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=style)


def _arc(
    ax: Axes, middle: NDArray[np.float64], radius: float, first: float, last: float, name: str, colour: str
) -> None:
    """An arc with an arrow at its end and its name beside the middle; clockwise where `last` is larger."""
    line = middle + radius * _towards(np.linspace(first, last, 60))
    ax.plot(*line[:-2].T, color=colour, linewidth=1.1)
    _arrow(ax, line[-3], line[-1], colour, 1.1)
    if name:
        at = middle + 1.16 * radius * _towards((first + last) / 2)
        ax.text(at[0], at[1], name, color=colour, ha="center", va="center")


def _name(ax: Axes, at: Any, words: str, offset: tuple[float, float], colour: str) -> None:
    ax.annotate(words, xy=tuple(at), xytext=offset, textcoords="offset points", color=colour)
