"""Faults by the thousand: damaged files and plans, kills, hostile files, a long run."""
