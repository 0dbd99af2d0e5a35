"""The laboratory of the upward-driven disk.

Film the device, get its motion, fit the model, find what the model lacks, and explore what the
model does.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

# Every public name and the module that it comes from; a module itself where both are the same. Nothing is
# imported before it is used, so that `import udd` stays fast. The names must not be those of other modules.
_PUBLIC = {
    "DLE": "udd.models",
    "BifurcationPoint": "udd.structure",
    "Branch": "udd.structure",
    "Cascade": "udd.structure",
    "Connection": "udd.structure",
    "ConvergenceWarning": "udd.errors",
    "Discovery": "udd.discovery",
    "Covariant": "udd.spectra",
    "Connections": "udd.structure",
    "CycleConnection": "udd.structure",
    "Diagram": "udd.structure",
    "Disk": "udd.models",
    "Ensemble": "udd.ensembles",
    "Equilibrium": "udd.structure",
    "Fit": "udd.fitting",
    "Forecast": "udd.forecasting",
    "IncompleteWarning": "udd.errors",
    "Interrupted": "udd.errors",
    "Lifetimes": "udd.structure",
    "Locus": "udd.structure",
    "Measurement": "udd.measurement",
    "Model": "udd.models",
    "Pendulum": "udd.models",
    "PeriodicOrbit": "udd.structure",
    "Section": "udd.sections",
    "Spectrum": "udd.spectra",
    "StiffnessWarning": "udd.errors",
    "SweepSpec": "udd.sweeping",
    "Trajectory": "udd.trajectory",
    "UddError": "udd.errors",
    "basins": "udd.branching",
    "bifurcation": "udd.branching",
    "cascade": "udd.structure",
    "connection": "udd.structure",
    "connections": "udd.structure",
    "continuation": "udd.structure",
    "cycle_connections": "udd.structure",
    "covariant_vectors": "udd.spectra",
    "diagram": "udd.structure",
    "discover": "udd.discovery",
    "effects": "udd.effects",
    "energy_books": "udd.energy",
    "ensemble": "udd.ensembles",
    "equilibria": "udd.structure",
    "errors": "udd.errors",
    "fit": "udd.fitting",
    "forecast": "udd.forecasting",
    "lifetimes": "udd.structure",
    "locus": "udd.structure",
    "lyapunov": "udd.exponents",
    "lyapunov_spectrum": "udd.spectra",
    "paper": "udd.paper",
    "periodic_orbit": "udd.structure",
    "plot": "udd.plot",
    "poincare": "udd.sections",
    "prune": "udd.discovery",
    "read_measurement": "udd.measurement",
    "record": "udd.tracking",
    "relatives": "udd.relatives",
    "render": "udd.film",
    "simulate": "udd.trajectory",
    "smooth": "udd.smoothing",
    "sweep": "udd.sweeping",
    "track": "udd.tracking",
}

__all__ = [*_PUBLIC]

if TYPE_CHECKING:  # the same for type checkers
    from udd import effects as effects
    from udd import errors as errors
    from udd import paper as paper
    from udd import plot as plot
    from udd import relatives as relatives
    from udd.branching.diagram import bifurcation as bifurcation
    from udd.branching.grids import basins as basins
    from udd.discovery import Discovery as Discovery
    from udd.discovery.discover import discover as discover
    from udd.discovery.pruning import prune as prune
    from udd.energy import energy_books as energy_books
    from udd.ensembles import Ensemble as Ensemble
    from udd.ensembles import ensemble as ensemble
    from udd.errors import ConvergenceWarning as ConvergenceWarning
    from udd.errors import IncompleteWarning as IncompleteWarning
    from udd.errors import Interrupted as Interrupted
    from udd.errors import StiffnessWarning as StiffnessWarning
    from udd.errors import UddError as UddError
    from udd.exponents import lyapunov as lyapunov
    from udd.film import render as render
    from udd.fitting import Fit as Fit
    from udd.fitting.fit import fit as fit
    from udd.forecasting import Forecast as Forecast
    from udd.forecasting import forecast as forecast
    from udd.measurement import Measurement as Measurement
    from udd.measurement import read_measurement as read_measurement
    from udd.models import DLE as DLE
    from udd.models import Disk as Disk
    from udd.models import Model as Model
    from udd.models import Pendulum as Pendulum
    from udd.sections import Section as Section
    from udd.sections import poincare as poincare
    from udd.smoothing import smooth as smooth
    from udd.spectra import Covariant as Covariant
    from udd.spectra import Spectrum as Spectrum
    from udd.spectra import covariant_vectors as covariant_vectors
    from udd.spectra import lyapunov_spectrum as lyapunov_spectrum
    from udd.structure import BifurcationPoint as BifurcationPoint
    from udd.structure import Branch as Branch
    from udd.structure import Cascade as Cascade
    from udd.structure import Connection as Connection
    from udd.structure import Connections as Connections
    from udd.structure import CycleConnection as CycleConnection
    from udd.structure import Diagram as Diagram
    from udd.structure import Equilibrium as Equilibrium
    from udd.structure import Lifetimes as Lifetimes
    from udd.structure import Locus as Locus
    from udd.structure import PeriodicOrbit as PeriodicOrbit
    from udd.structure import cascade as cascade
    from udd.structure import connection as connection
    from udd.structure import connections as connections
    from udd.structure import continuation as continuation
    from udd.structure import cycle_connections as cycle_connections
    from udd.structure import diagram as diagram
    from udd.structure import equilibria as equilibria
    from udd.structure import lifetimes as lifetimes
    from udd.structure import locus as locus
    from udd.structure import periodic_orbit as periodic_orbit
    from udd.sweeping import SweepSpec as SweepSpec
    from udd.sweeping.sweeps import sweep as sweep
    from udd.tracking import record as record
    from udd.tracking import track as track
    from udd.trajectory import Trajectory as Trajectory
    from udd.trajectory import simulate as simulate


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'udd' has no attribute {name!r}")
    module = importlib.import_module(_PUBLIC[name])
    value = module if _PUBLIC[name] == f"udd.{name}" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
