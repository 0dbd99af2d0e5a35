"""The models of continuation tutorials, for tests and benches."""

from __future__ import annotations

import udd

MORRIS_LECAR = udd.Model(
    ["V", "w"],
    {
        "V": "(I - gCa*(1 + tanh((V - V1)/V2))/2*(V - ECa) - gK*w*(V - EK) - gL*(V - EL))/C",
        "w": "phi*((1 + tanh((V - V3)/V4))/2 - w)*cosh((V - V3)/(2*V4))",
    },
    {"I": 0.0, "C": 20.0, "gCa": 4.4, "gK": 8.0, "gL": 2.0, "ECa": 120.0, "EK": -84.0, "EL": -60.0}
    | {"V1": -1.2, "V2": 18.0, "V3": 2.0, "V4": 30.0, "phi": 0.04},
)
LORENZ84 = udd.Model(
    ["x", "y", "z"],
    ["-y^2 - z^2 - a*x + a*F", "x*y - b*x*z - y + G", "b*x*y + x*z - z"],
    {"a": 0.25, "b": 4.0, "G": 0.3, "F": 3.0},
)
BRUSSELATOR = udd.Model(["x", "y"], ["A + x^2*y - (b + 1)*x", "b*x - x^2*y"], {"A": 1.3, "b": 3.5})
ROESSLER = udd.Model(["x", "y", "z"], ["-y - z", "x + a*y", "b + z*(x - c)"], {"a": 0.17, "b": 0.4, "c": 3.0})
FITZHUGH = udd.Model(["v", "w"], ["v - v^3/3 - w + I", "0.08*(v + 0.7 - 0.8*w)"], {"I": 0.8})
LURE = udd.Model(["x", "y", "z"], ["y", "z", "-al*z - be*y - x + x^2"], {"al": 1.2, "be": 1.0})
SIR = udd.Model(["S", "I"], ["-b*S*I", "b*S*I - g*I"], {"b": 0.5, "g": 0.1})
NILPOTENT = udd.Model(
    ["x", "y", "z"], ["1.2*y*z", "-1.9*y - 1.1*x^2 + 1.8*y*z", "-1.1*z - 1.7*y^2 + 1.5*y*z"]
)
CHUA = udd.Model(["x", "y", "z"], ["a*(y - x^3/16 + x/6)", "x - y + z", "-b*y"], {"a": 5.0, "b": 14.0})
# A seasonal predator and its prey: the seasons are an oscillator of their own.
SEASONS = udd.Model(
    ["x", "y", "u", "v"],
    [
        "r*(1 - x/K)*x - a*x*y/(b0*(1 + ep*u) + x)",
        "e*a*x*y/(b0*(1 + ep*u) + x) - d*y",
        "u*(1 - u^2 - v^2) - 2*pi*v",
        "v*(1 - u^2 - v^2) + 2*pi*u",
    ],
    {"K": 1.0, "r": 6.28, "a": 12.56, "b0": 0.25, "e": 1.0, "d": 6.28, "ep": 0.2},
)
CO = udd.Model(
    ["x", "y", "s"],
    [
        "2*q1*(1 - x - y - s)^2 - 2*q5*x^2 - q3*x*y",
        "q2*(1 - x - y - s) - q6*y - q3*x*y",
        "q4*(1 - x - y - s) - k*q4*s",
    ],
    {"q1": 2.5, "q2": 1.04, "q3": 10.0, "q4": 0.0675, "q5": 1.0, "q6": 0.1, "k": 0.4},
)
BAZYKIN = udd.Model(
    ["x", "y"],
    ["x - x*y/(1 + al*x) - e*x^2", "-g*y + x*y/(1 + al*x) - d*y^2"],
    {"e": 0.01, "g": 1.0, "d": 0.1, "al": 0.2},
)
REACTION = udd.Model(
    ["u", "v"],
    ["-u + p1*(1 - u)*exp(v)", "-v + p1*p2*(1 - u)*exp(v) - p3*v"],
    {"p1": 0.05, "p2": 14.0, "p3": 2.0},
)
JERK = udd.Model(["x", "v", "a"], ["v", "a", "-a - 0.4*v + mu*x*(1 - x)"], {"mu": 0.7})
