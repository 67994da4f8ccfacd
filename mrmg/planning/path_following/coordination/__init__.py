"""Coordination: priority-based search over kinodynamic motions in space and time."""
