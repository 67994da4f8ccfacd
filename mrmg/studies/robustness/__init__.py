"""How probable it is that a plan is feasible when the robots are not as modelled.

`study_robustness` drives a plan many times under disturbances drawn by seed.
"""

from mrmg.studies.robustness.study import study_robustness

__all__ = ["study_robustness"]
