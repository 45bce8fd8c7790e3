"""The hyperelliptic curve: cuts and gaps, periods, the Abel–Jacobi map and its inverse."""
