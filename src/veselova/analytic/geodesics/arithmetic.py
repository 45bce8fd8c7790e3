"""Doubles, and the nodes of panels that leave out less than their spacing."""

from math import asinh, atan2, cos, exp, log, pi, sin, sqrt

import numpy as np

from veselova.analytic.kernel.arithmetic import EPSILON, number, size, whole, zeros, zeros2
from veselova.analytic.kernel.compiler import jit

__all__ = [
    "EPSILON",
    "NODES",
    "ORDER",
    "PANEL",
    "SMALLEST",
    "WEIGHTS",
    "asinh",
    "atan2",
    "cos",
    "exp",
    "jit",
    "log",
    "number",
    "pi",
    "sin",
    "size",
    "sqrt",
    "whole",
    "zeros",
    "zeros2",
]

#: Derived: nodes and length of a panel: the rest falls like ϱ^(−2·12), ϱ = 5.2.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PANEL = 1.25

#: Method: order of Taylor series, and what they leave out.
ORDER, SMALLEST = 24, 1e-17
