"""The paper's other statements, as functions."""
