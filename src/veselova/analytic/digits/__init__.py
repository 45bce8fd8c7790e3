"""Motions to any number of digits, or with certified errors, in ball arithmetic."""
