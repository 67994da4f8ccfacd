"""Placing of missions on bare maps: robots, goals, stations, battery capacities."""
