"""Placing of missions on bare maps: robots, goals, stations, battery capacities."""

from mrmg.scene.populating.populate import populate

__all__ = ["populate"]
