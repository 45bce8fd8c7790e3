"""Doubles and balls behind one interface; double-double numbers."""
