"""The laboratory of the upward-driven disk.

Film the device, get its motion, fit the model, find what the model lacks, and explore what the
model does.
"""

from __future__ import annotations

import importlib
import warnings
from typing import TYPE_CHECKING, Any

# Every public name and the module that it comes from; a module itself where both are the same. Nothing is
# imported before it is used, so that `import udd` stays fast. The names must not be those of other modules.
_PUBLIC = {
    "DLE": "udd.models",
    "BifurcationPoint": "udd.bifurcations",
    "Branch": "udd.bifurcations",
    "Cascade": "udd.bifurcations",
    "Connection": "udd.bifurcations",
    "ConvergenceWarning": "udd.errors",
    "Discovery": "udd.discovery",
    "Covariant": "udd.chaos.spectrum",
    "Connections": "udd.bifurcations",
    "Crisis": "udd.bifurcations",
    "CycleConnection": "udd.bifurcations",
    "Diagram": "udd.bifurcations",
    "Disk": "udd.models",
    "Ensemble": "udd.simulation.ensembles",
    "Equilibrium": "udd.bifurcations",
    "Fit": "udd.fitting",
    "Forecast": "udd.fitting.forecast",
    "IncompleteWarning": "udd.errors",
    "Interrupted": "udd.errors",
    "Lifetimes": "udd.bifurcations",
    "Locus": "udd.bifurcations",
    "Measurement": "udd.measurement",
    "Model": "udd.models",
    "Pendulum": "udd.models",
    "PeriodicOrbit": "udd.bifurcations",
    "Section": "udd.chaos.poincare_sections",
    "Spectrum": "udd.chaos.spectrum",
    "StiffnessWarning": "udd.errors",
    "SweepSpec": "udd.sweeps",
    "Trajectory": "udd.simulation.trajectory",
    "UddError": "udd.errors",
    "basins": "udd.attractors",
    "bifurcation": "udd.attractors",
    "cascade": "udd.bifurcations",
    "connection": "udd.bifurcations",
    "connections": "udd.bifurcations",
    "continuation": "udd.bifurcations",
    "crises": "udd.bifurcations",
    "cycle_connections": "udd.bifurcations",
    "covariant_vectors": "udd.chaos.spectrum",
    "diagram": "udd.bifurcations",
    "discover": "udd.discovery",
    "effects": "udd.effects",
    "energy_balance": "udd.simulation.energy",
    "ensemble": "udd.simulation.ensembles",
    "equilibria": "udd.bifurcations",
    "errors": "udd.errors",
    "fit": "udd.fitting",
    "forecast": "udd.fitting.forecast",
    "lifetimes": "udd.bifurcations",
    "locus": "udd.bifurcations",
    "lyapunov": "udd.chaos.largest_exponent",
    "lyapunov_spectrum": "udd.chaos.spectrum",
    "paper": "udd.paper",
    "periodic_orbit": "udd.bifurcations",
    "plot": "udd.plot",
    "poincare": "udd.chaos.poincare_sections",
    "prune": "udd.discovery",
    "read_measurement": "udd.measurement",
    "record": "udd.tracking",
    "relatives": "udd.relatives",
    "render": "udd.film",
    "simulate": "udd.simulation.trajectory",
    "smooth": "udd.measurement.smoother",
    "sweep": "udd.sweeps",
    "track": "udd.tracking",
}

__all__ = [*_PUBLIC]

if TYPE_CHECKING:  # the same for type checkers
    from udd import effects as effects
    from udd import errors as errors
    from udd import paper as paper
    from udd import plot as plot
    from udd import relatives as relatives
    from udd.attractors.basin_grid import basins as basins
    from udd.attractors.bifurcation_diagram import bifurcation as bifurcation
    from udd.chaos.largest_exponent import lyapunov as lyapunov
    from udd.chaos.poincare_sections import Section as Section
    from udd.chaos.poincare_sections import poincare as poincare
    from udd.chaos.spectrum import Covariant as Covariant
    from udd.chaos.spectrum import Spectrum as Spectrum
    from udd.chaos.spectrum import covariant_vectors as covariant_vectors
    from udd.chaos.spectrum import lyapunov_spectrum as lyapunov_spectrum
    from udd.discovery.discover import discover as discover
    from udd.discovery.term_elimination import prune as prune
    from udd.fitting.fit import fit as fit
    from udd.fitting.forecast import Forecast as Forecast
    from udd.fitting.forecast import forecast as forecast
    from udd.measurement.smoother import smooth as smooth
    from udd.models import DLE as DLE
    from udd.models import Disk as Disk
    from udd.models import Model as Model
    from udd.models import Pendulum as Pendulum
    from udd.simulation.energy import energy_balance as energy_balance
    from udd.simulation.ensembles import Ensemble as Ensemble
    from udd.simulation.ensembles import ensemble as ensemble
    from udd.simulation.trajectory import Trajectory as Trajectory
    from udd.simulation.trajectory import simulate as simulate
    from udd.sweeps.run_sweep import sweep as sweep

    from .bifurcations import BifurcationPoint as BifurcationPoint
    from .bifurcations import Branch as Branch
    from .bifurcations import Cascade as Cascade
    from .bifurcations import Connection as Connection
    from .bifurcations import Connections as Connections
    from .bifurcations import Crisis as Crisis
    from .bifurcations import CycleConnection as CycleConnection
    from .bifurcations import Diagram as Diagram
    from .bifurcations import Equilibrium as Equilibrium
    from .bifurcations import Lifetimes as Lifetimes
    from .bifurcations import Locus as Locus
    from .bifurcations import PeriodicOrbit as PeriodicOrbit
    from .bifurcations import cascade as cascade
    from .bifurcations import connection as connection
    from .bifurcations import connections as connections
    from .bifurcations import continuation as continuation
    from .bifurcations import crises as crises
    from .bifurcations import cycle_connections as cycle_connections
    from .bifurcations import diagram as diagram
    from .bifurcations import equilibria as equilibria
    from .bifurcations import lifetimes as lifetimes
    from .bifurcations import locus as locus
    from .bifurcations import periodic_orbit as periodic_orbit
    from .discovery import Discovery as Discovery
    from .errors import ConvergenceWarning as ConvergenceWarning
    from .errors import IncompleteWarning as IncompleteWarning
    from .errors import Interrupted as Interrupted
    from .errors import StiffnessWarning as StiffnessWarning
    from .errors import UddError as UddError
    from .film import render as render
    from .fitting import Fit as Fit
    from .measurement import Measurement as Measurement
    from .measurement import read_measurement as read_measurement
    from .sweeps import SweepSpec as SweepSpec
    from .tracking import record as record
    from .tracking import track as track


#: Names of before, which work for one release more.
_RENAMED = {"energy_books": "energy_balance"}


def __getattr__(name: str) -> Any:
    if name in _RENAMED:
        text = f"udd.{name} is called udd.{_RENAMED[name]} now"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        name = _RENAMED[name]
    if name not in _PUBLIC:
        raise AttributeError(f"module 'udd' has no attribute {name!r}")
    module = importlib.import_module(_PUBLIC[name])
    value = module if _PUBLIC[name] == f"udd.{name}" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
