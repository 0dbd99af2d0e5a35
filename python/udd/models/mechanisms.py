"""Mechanisms stated as M(q) q'' = f: mass matrix and generalised forces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from udd._util.arguments import checked_arguments
from udd._util.expressions import Expression, text_of
from udd._util.validation import number
from udd.errors import ModelError

from .formula_model import FormulaModel, cofactor, determinant

__all__ = ["mechanism", "pendulum_chain"]

_MOST_LINKS = 3  # six states


@checked_arguments
def mechanism(
    coordinates: Mapping[str, str],
    mass: Sequence[Sequence[Expression]],
    forces: Sequence[Expression],
    parameters: Mapping[str, float] | None = None,
    *,
    angles: Iterable[str] = (),
    inputs: Iterable[str] = (),
    delays: Mapping[str, str] | None = None,
    observe: Mapping[str, Expression] | None = None,
) -> FormulaModel:
    """Make a model of a mechanism from its equations of motion ``M(q) q'' = f(q, q', u, t)``.

    The accelerations are those of Cramer's rule. A missing term that :func:`udd.discover`
    finds is a force, which enters every acceleration through the mass matrix.

    Parameters
    ----------
    coordinates : mapping of str to str
        Name of each coordinate, with the name of its speed.
    mass : sequence of sequence of formula, shape (n, n)
        The mass matrix M. It must be symmetric.
    forces : sequence of formula, shape (n,)
        The generalised forces f, those of gravity and those of Coriolis among them.
    parameters, angles, inputs, delays, observe
        As for :class:`udd.Model`.

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        Tables that do not fit together, or what :class:`udd.Model` refuses.

    See Also
    --------
    udd.pendulum_chain : a chain of pendulums.
    udd.Model : a model from the rates of its states.
    udd.plot.time_series : draw a run.

    Examples
    --------
    A motor with a torque and friction:

    >>> import udd
    >>> motor = udd.mechanism({"q": "v"}, [["J"]], ["torque - b*v"], {"J": 0.5, "b": 0.1}, inputs=["torque"])
    >>> motor.equations["v"]
    '(torque - b*v)/(J)'
    """
    if not isinstance(coordinates, Mapping) or not coordinates:
        raise ModelError(f"coordinates must be a table of coordinates and their speeds, not {coordinates!r}")
    n = len(coordinates)
    try:
        rows = [[text_of("the mass matrix", one) for one in row] for row in mass]
        force = [text_of("a force", one) for one in forces]
    except TypeError:
        raise ModelError("mass must be a table of formulas, and forces a list of them") from None
    if len(force) != n or [len(row) for row in rows] != [n] * n:
        row_lengths = ", ".join(str(len(row)) for row in rows) or "none"
        raise ModelError(
            f"{n} coordinates need {n} forces and a mass matrix of {n} x {n}, "
            f"not {len(force)} forces and rows of {row_lengths}"
        )
    whole = determinant(rows)
    accelerations = []
    for i in range(n):
        parts = [f"({force[k]})*({cofactor(rows, k, i)})" for k in range(n)]
        accelerations.append(f"({' + '.join(parts)})/({whole})" if n > 1 else f"({force[0]})/({whole})")
    return FormulaModel(
        [*coordinates, *coordinates.values()],
        [*coordinates.values(), *accelerations],
        parameters,
        angles=angles,
        mass=rows,
        inputs=inputs,
        delays=delays,
        observe=observe,
    )


def check_accelerations(model: FormulaModel) -> None:
    """Refuse forces as equations of a model with a mass matrix, whose equations must be accelerations.

    At rest the forces of springs and gravity have symmetric derivatives by the coordinates. If those of the
    equations are symmetric, and those of the mass matrix times the equations are not, the equations are the
    forces. One coordinate cannot show that.

    Raises
    ------
    ModelError
        The equations are forces.
    """
    if len(model.speeds) < 2 or not model.mass:
        return
    values = dict(model.values) | dict.fromkeys(model.inputs, 0.3)
    plain = FormulaModel(model.state_names, model.texts, values, angles=model.angles, mass=model.mass)
    if _symmetric(plain, weighted=False) and not _symmetric(plain, weighted=True):
        raise ModelError(
            "the equations look like forces, but with mass they must be accelerations: for M q'' = forces "
            'write "mechanism": {"coordinates": {"q": "v"}, "mass": ..., "forces": ...} instead'
        )


_STEP = 1e-4  # of a coordinate, by which differences are taken


def _symmetric(model: FormulaModel, *, weighted: bool) -> bool:
    """Return True if accelerations at rest, times the mass matrix if so asked, have symmetric derivatives."""
    coordinates = [model.state_names.index(name) for name in model.speeds]
    speeds = [model.state_names.index(name) for name in model.speeds.values()]

    def forces(at: NDArray[np.float64]) -> NDArray[np.float64]:
        rates = model.rates(0.0, at)[..., speeds]
        return (model.mass_matrix(at) @ rates[..., None])[..., 0] if weighted else rates

    # Numbers without a pattern, in which no formula is symmetric by accident.
    states = np.sin(np.arange(1.0, 3 * len(model.state_names) + 1)).reshape(3, -1)
    states[:, speeds] = 0.0
    columns = []
    for k in coordinates:
        step = _STEP * np.eye(states.shape[1])[k]
        columns.append((forces(states + step) - forces(states - step)) / (2 * _STEP))
    slopes = np.stack(columns, axis=-1)
    if not np.isfinite(slopes).all():
        return True
    return bool(np.allclose(slopes, np.swapaxes(slopes, 1, 2), rtol=0.0, atol=1e-5 * np.abs(slopes).max()))


@checked_arguments
def pendulum_chain(
    masses: Sequence[float],
    lengths: Sequence[float],
    centres: Sequence[float],
    inertias: Sequence[float],
    *,
    friction: Sequence[float] | None = None,
    dry: Sequence[float] | None = None,
    rotors: Sequence[float] | None = None,
    g: float = 9.81,
    motors: bool = False,
) -> FormulaModel:
    """Make a plane chain of 1 to 3 rigid pendulums by Lagrange's equations.

    Angles ``a1, a2, ...`` are counted from hanging down [rad], each link's own (not relative to the link
    above); speeds are ``w1, w2, ...``.

    Parameters
    ----------
    masses : sequence of float, shape (n,)
        Masses [kg]. The parameters are ``m1, ...``.
    lengths : sequence of float, shape (n,)
        Distances from joint to joint [m], parameters ``l1, ...``. That of the last link has no effect.
    centres : sequence of float, shape (n,)
        Distances from a link's upper joint to its centre of mass [m], parameters ``r1, ...``.
    inertias : sequence of float, shape (n,)
        Moments of inertia about the upper joints [kg m^2], parameters ``I1, ...``.
    friction : sequence of float, shape (n,), optional
        Viscous friction of the joints [N m s], parameters ``b1, ...``.
    dry : sequence of float, shape (n,), optional
        Dry friction of the joints [N m], parameters ``F1, ...``: set-valued, so that joints stick.
    rotors : sequence of float, shape (n,), optional
        Moments of inertia of the motors' rotors as the joints feel them, that is times the square of the gear
        ratio [kg m^2], parameters ``J1, ...``.
    g : float
        Gravity [m/s^2].
    motors : bool
        If True, each joint has a motor whose torque is a measured input, ``tau1, ...`` [N m].

    Returns
    -------
    Model

    Raises
    ------
    ModelError
        Lists of different lengths, or of more than three links.

    See Also
    --------
    udd.mechanism : any mechanism from its mass matrix.
    udd.Pendulum : a single pendulum.
    udd.plot.time_series : draw a run.

    Notes
    -----
    With ``M_ij = c_ij cos(a_i - a_j)``, ``c_ii = I_i + l_i^2 sum_{k>i} m_k`` and, for i < j,
    ``c_ij = l_i (m_j r_j + l_j sum_{k>j} m_k)``, the equations are ``M a'' = -(c_ij sin(a_i - a_j) w_j^2
    summed over j) - g (m_i r_i + l_i sum_{k>i} m_k) sin a_i`` and the joints' torques. A rotor adds
    ``J_i (w_i - w_{i-1})^2 / 2`` to the kinetic energy: what its own turning with the link above adds to that
    is smaller by the gear ratio, and left out.

    Examples
    --------
    A double pendulum keeps its energy:

    >>> import numpy as np
    >>> import udd
    >>> chain = udd.pendulum_chain([1.0, 1.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0])
    >>> run = udd.simulate(chain, 10.0, [2.0, 2.5, 0.0, 0.0], method="auto")
    >>> a1, a2, w1, w2 = run.state[[0, -1]].T
    >>> kinetic = w1**2 + w2**2 / 2 + w1 * w2 * np.cos(a1 - a2)
    >>> energy = kinetic - 9.81 * (2 * np.cos(a1) + np.cos(a2))
    >>> bool(abs(energy[1] - energy[0]) < 1e-6)
    True
    """
    n = len(masses)
    columns = {"m": masses, "l": lengths, "r": centres, "I": inertias}
    if friction is not None:
        columns["b"] = friction
    if dry is not None:
        columns["F"] = dry
    if rotors is not None:
        columns["J"] = rotors
    if not 1 <= n <= _MOST_LINKS or any(len(values) != n for values in columns.values()):
        raise ModelError(
            f"a chain has 1 to {_MOST_LINKS} links with a mass, length, centre and inertia each, "
            f"not {', '.join(str(len(values)) for values in columns.values())} of them"
        )
    links = range(1, n + 1)
    below = {i: " + ".join(f"m{k}" for k in links if k > i) for i in links}

    def moment(i: int) -> str:
        """Compute the first moment of link i about its joint, with the further links at its end."""
        return f"(m{i}*r{i} + l{i}*({below[i]}))" if below[i] else f"m{i}*r{i}"

    def coefficient(i: int, j: int) -> str:
        if i == j:
            return f"(I{i} + l{i}^2*({below[i]}))" if below[i] else f"I{i}"
        return f"l{min(i, j)}*{moment(max(i, j))}"

    def inertia(i: int, j: int) -> str:
        """Compute an element of the mass matrix, with the rotors of the joints between."""
        joints = {i, i + 1} & {j, j + 1} & set(links) if rotors is not None else set()
        turned = "".join(f" {'+' if i == j else '-'} J{k}" for k in sorted(joints))
        return coefficient(i, j) + (f"*cos(a{min(i, j)} - a{max(i, j)})" if i != j else "") + turned

    mass = [[inertia(i, j) for j in links] for i in links]
    forces = []
    for i in links:
        parts = [f"-g*{moment(i)}*sin(a{i})"]
        parts += [f"-{coefficient(i, j)}*sin(a{i} - a{j})*w{j}^2" for j in links if j != i]
        # A joint's torque turns the link below it and turns the one above back.
        for joint, sign, back in ((i, "", "-"), (i + 1, "-", "")):
            if joint > n:
                continue
            speed = f"(w{joint} - w{joint - 1})" if joint > 1 else "w1"
            if motors:
                parts.append(f"{sign}tau{joint}")
            if friction is not None:
                parts.append(f"{back}b{joint}*{speed}")
            if dry is not None:
                parts.append(f"{back}F{joint}*sign({speed.strip('()')})")
        forces.append(" + ".join(f"({part})" for part in parts))
    values = {
        f"{name}{i}": number(f"{name}{i}", v)
        for name, column in columns.items()
        for i, v in zip(links, column, strict=True)
    }
    del values[f"l{n}"]
    return mechanism(
        {f"a{i}": f"w{i}" for i in links},
        mass,
        forces,
        values | {"g": number("g", g)},
        angles=[f"a{i}" for i in links],
        inputs=[f"tau{i}" for i in links] if motors else [],
    )
