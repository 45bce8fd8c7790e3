"""Bodies: inertia operators and their principal axes."""
