"""How probable it is that a plan is feasible when the robots are not as modelled.

`study.study_robustness` drives a plan many times under disturbances drawn by seed.
"""
