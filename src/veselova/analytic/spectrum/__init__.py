"""The part of a body that moves, and the branch points of its curve."""
