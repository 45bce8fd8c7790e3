"""The attitude of a body from the angles on the cuts, and its sensitivity to the phases."""
