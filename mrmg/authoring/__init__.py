"""Making scenes: import of foreign maps, placing of robots, goals and stations."""
