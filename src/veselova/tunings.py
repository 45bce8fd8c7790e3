"""Tunings: which of two equally accurate ways is faster, as measured.

They stand here, beside the command that measures them, because machines differ and formulas do not.
A tuning that is wrong by a factor of two costs some time. No bound on an error depends on one, and
no value but in its rounding. ``python benchmarks/tunings.py NAME`` times the work that a tuning
decides about, with half of it, with itself and with twice as much.
"""

from __future__ import annotations

# ---------- Which way: python benchmarks/tunings.py NAME ----------

#: Tuning: largest genus at which theta quotients in balls are shorter than inversions.
THETA_GENUS = 3

#: Tuning: nodes of a panel in balls that a Fourier mode costs, and how that grows with the square
#: of the digits times the terms of the longest angle series.
BALL_MODE = 1.0
BALL_MODE_TERMS = 1 / 1000

# ---------- Many starts: python benchmarks/ensembles.py ----------

#: Tuning: times up to which states are computed side by side; beyond, ``solve`` is as
#: fast.
TIMES_SIDE_BY_SIDE = 200

#: Tuning: starts up to which ``solve`` does them, one by one, at any number of times.
FEW_STARTS = 3

# ---------- Integration: python benchmarks/integrators.py ----------

#: Tuning: from this many equations, or operations in them (shared ones counted wherever they
#: occur), heyoka compiles in its compact mode: it compiles in a second where unrolled code takes
#: minutes, and runs up to 2× slower.
COMPACT_EQUATIONS = 22
COMPACT_OPERATIONS = 4000
