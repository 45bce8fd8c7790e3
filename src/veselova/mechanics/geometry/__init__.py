"""Functions of states: sphere and spheroconic coordinates, frames, so(n), Stiefel varieties,
integrals of motion.
"""
