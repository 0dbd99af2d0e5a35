"""The bifurcation structure: equilibria and cycles, and how they change with parameters."""

from .branch import BifurcationPoint, Branch
from .branches import continuation
from .cascades import Cascade, cascade
from .connecting import Connection, connection
from .connection_search import Connections, connections
from .cycle_connection import CycleConnection, cycle_connections
from .diagrams import Diagram, diagram
from .loci import Locus, locus
from .orbits import periodic_orbit
from .rests import equilibria
from .solutions import Equilibrium, PeriodicOrbit
from .survival import Lifetimes, lifetimes

__all__ = [
    "BifurcationPoint",
    "Branch",
    "Cascade",
    "Connection",
    "Connections",
    "CycleConnection",
    "Diagram",
    "Equilibrium",
    "Lifetimes",
    "Locus",
    "PeriodicOrbit",
    "cascade",
    "connection",
    "connections",
    "continuation",
    "cycle_connections",
    "diagram",
    "equilibria",
    "lifetimes",
    "locus",
    "periodic_orbit",
]
