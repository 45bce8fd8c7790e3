"""Riemann theta functions, and the attitude as their quotients."""
