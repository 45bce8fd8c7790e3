"""Doubles and balls behind one interface."""
