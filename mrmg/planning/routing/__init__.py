"""Who visits what in which order, recharging where.

`routing` has the problem solved: by ruin and recreate, or by nested rollout policy
adaptation, with stations placed exactly in the end. The kernels are the algorithms.
"""
