"""Sweeps: the store of jobs, chunks of rows, and the cluster that computes them."""
