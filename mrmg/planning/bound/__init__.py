"""What no plan can cost less than.

Certified distances (`geodesic`, `prices`) between arcs of goal regions (`arcs`), the
cheapest tours over them (`touring`), and from both the bounds of energy (`bound`) and
of the mission's time (`makespan_bound`).
"""
