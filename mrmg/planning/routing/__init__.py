"""Who visits what in which order, recharging where.

`routing` states the problem and has it solved: nested rollout policy adaptation, then
ruin and recreate with stations placed exactly. The kernels are the algorithms.
"""
