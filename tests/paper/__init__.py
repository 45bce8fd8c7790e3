"""The statements of the paper beyond motions, as functions that the tests of this folder hold."""
