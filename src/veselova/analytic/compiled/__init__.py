"""The double path of many starts as compiled loops, where numba is installed (extra ``fast``)."""
