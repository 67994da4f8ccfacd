"""The planning problem: world, fleet, targets, margins, safety and routing.

Every strategy takes it. `problem` states it from a scene and a roadmap; `targets` has
where robots must go and the margins kept there, `leg_times` how long legs take,
`time_weighting` what a second is worth against energy, `_clearance_kernels` whether a
robot keeps its margins.
"""
