"""The systems of the paper, a file for each."""
