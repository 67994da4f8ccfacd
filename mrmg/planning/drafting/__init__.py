"""Plans by following paths, and better ones from those there are.

Paths are smoothed as elastic bands (`band`) and followed in closed loop (`tracking`),
along tours (`drafting`) and along a plan that is there (`refine`). Robots in each
other's way wait or go round (`encounters`, `detours`, `lanes`); `coordination` searches
for motions where robots have no goals, or cars must end with a heading.
"""
