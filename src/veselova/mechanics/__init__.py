"""The physics, written once: the problem, its integrals of motion, coordinates and results. Solves
nothing.
"""
