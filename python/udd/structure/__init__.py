"""The bifurcation structure: equilibria and cycles, and how they change with parameters."""

from .branch import BifurcationPoint, Branch
from .branches import continuation
from .cascades import Cascade, cascade
from .diagrams import Diagram, diagram
from .orbits import periodic_orbit
from .rests import equilibria
from .solutions import Equilibrium, PeriodicOrbit

__all__ = [
    "BifurcationPoint",
    "Branch",
    "Cascade",
    "Diagram",
    "Equilibrium",
    "PeriodicOrbit",
    "cascade",
    "continuation",
    "diagram",
    "equilibria",
    "periodic_orbit",
]
