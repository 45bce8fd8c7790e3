"""Tunings: which of two ways is the faster, measured; the answer is as good by either.

They stand here, beside the command that measures them, because machines differ and formulas do not.
A tuning that is twice off costs some time. No bound on an error depends on one, and no value but
in its rounding. ``python benchmarks/tunings.py NAME`` times the work that a tuning decides about,
with half of it, with itself and with twice as much.
"""

from __future__ import annotations

# ---------- Seconds in balls: python benchmarks/costs_in_balls.py compares estimates ----------

#: Tuning: digits and nodes at which the costs in balls are measured.
BALL_DIGITS = 60
BALL_NODES = 24

#: Tuning: seconds of a term of an angle series of one point; of dt/dτ₁ by theta functions at genus
#: 1, and its growth from one genus to the next; the same of a state; of a Fourier mode at genus 3.
BALL_INVERSION = 0.7e-6
BALL_THETA = {"rate": (8e-5, 2.6), "state": (9e-5, 5.0)}
BALL_MODE = 1.2e-4

#: Tuning: seconds of an entry of the frame with the other series; and of a time, whatever the
#: modes.
BALL_ENTRY = 6e-6
BALL_TIME = 1e-4

#: Tuning: terms of an angle series that take as long as what a series begins with; the digits at
#: which a term takes twice what it takes at few; and what a set-up takes in inversions.
BALL_FIRST_TERMS = 30
BALL_TERM_DIGITS = 35.0
BALL_SET_UP = 30.0

#: Tuning: by what powers of the digits the costs of theta functions and of modes grow.
BALL_THETA_GROWTH = 1.3
BALL_MODE_GROWTH = 2.0

#: Tuning: how the cost of a mode grows with the genus, and the part of it that no digits enter; a
#: mode at a time against a mode; at genus 1, where sums are formed in balls, all take so many times
#: as long.
BALL_MODE_GENUS_GROWTH = 1.9
BALL_MODE_FIXED = 0.5
BALL_MODE_AT_TIME = 2e-3
BALL_MODE_GENUS_ONE = 10.0

#: Tuning: largest genus of the formulas: higher ones cost as much.
BALL_GENUS = 4

#: Tuning: by how much more a Fourier time map with an odd part takes, whose modes are doubled; and
#: the series of a path.
BALL_ODD_PART = 20.0
BALL_PATH = 10.0

#: Tuning: what a motion at a node of an interpolant takes, and a term of the series at a time, in
#: motions at a time: from n = 3 to 6, 30 to 100 digits.
BALL_INTERPOLANT_NODE = 1.2
BALL_INTERPOLANT_TERM = 1 / 600

# ---------- Which way: python benchmarks/tunings.py NAME ----------

#: Tuning: largest genus at which theta quotients in balls are thought of.
THETA_GENUS = 4

#: Tuning: moving directions up to which theta sums in balls are shorter than inversions.
BALL_THETA_SIZE = 3

#: Tuning: times from which interpolants in balls are worth their overhead.
BALL_INTERPOLATED_TIMES = 300

#: Tuning: panels of few nodes from which it pays to look for longer ones.
MANY_PANELS = 200

#: Tuning: cycles from which a motion in a separable potential takes the Fourier time map, and the
#: largest genus at which it does.
SEPARABLE_FOURIER_CYCLES = 10.0
SEPARABLE_FOURIER_GENUS = 3

#: Tuning: nodes from which cosine series in balls are formed by products of polynomials.
MANY_NODES = 300

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
