"""The motion tree in the composite space of all robots (Algorithms 1-3).

`motion_tree` states a mission for the kernels and grows trees: groups of vertices and
their weights (eq. (5)), expansion by steering and random controls, safety.
"""
