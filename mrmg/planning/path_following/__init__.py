"""Plans by following paths, and better ones from those there are.

Paths are smoothed as elastic bands (`band`) and followed in closed loop by each robot
as if it were alone (`tracking`), along tours (`following`) and along a plan that is
there (`refine`). Where robots get in each other's way, or cars must end with a heading,
`coordination` searches for motions in space and time. `strategy` is the planner that is
made of them.
"""
