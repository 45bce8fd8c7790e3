"""The closed-form engine: curve, periods, Abel–Jacobi inversion, theta functions,
frame and time map.
"""

from __future__ import annotations

import numpy as np

# Temporaries stay in the process. glibc gives freed blocks of 128 KB, and the top of its heap, back
# to the system, and what comes again comes page by page, each cleared: a quarter of the time of a
# thousand states. Its thresholds rise to the largest block that was ever freed, up to 32 MB; this
# one of 8 MB, no page of which is touched, is larger than any temporary of few states.
np.empty(2**20)
