"""Bifurcation analysis: equilibria and periodic orbits, and how they change with parameters."""

from .bifurcation_curves import Locus, locus
from .branch import BifurcationPoint, Branch
from .branch_continuation import continuation
from .branch_diagram import Diagram, diagram
from .connecting_orbits import Connection, connection
from .connection_search import Connections, connections
from .crisis_location import Crisis, crises
from .cycle_to_equilibrium import CycleConnection, cycle_connections
from .doubling_cascade import Cascade, cascade
from .equilibrium_search import equilibria
from .locus_points import LocusPoint
from .periodic_orbits import periodic_orbit
from .solutions import Equilibrium, PeriodicOrbit
from .transient_lifetimes import Lifetimes, lifetimes

__all__ = [
    "BifurcationPoint",
    "Branch",
    "Cascade",
    "Connection",
    "Connections",
    "Crisis",
    "CycleConnection",
    "Diagram",
    "Equilibrium",
    "Lifetimes",
    "Locus",
    "LocusPoint",
    "PeriodicOrbit",
    "cascade",
    "connection",
    "connections",
    "continuation",
    "crises",
    "cycle_connections",
    "diagram",
    "equilibria",
    "lifetimes",
    "locus",
    "periodic_orbit",
]
