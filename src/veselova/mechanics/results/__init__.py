"""Trajectories, comparisons, tori and closed forms as data, with their tables, files and plots."""
