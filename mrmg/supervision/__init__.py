"""Above planning and execution: stops a driving fleet and plans the rest anew.

`drive_mission` drives a plan under control, `remaining_scene` states what is left.
"""

from mrmg.supervision.driving import Drive, drive_mission
from mrmg.supervision.faults import parse_fault
from mrmg.supervision.parameters import ControlParams
from mrmg.supervision.remaining import FleetCondition, remaining_scene

__all__ = [
    "ControlParams",
    "Drive",
    "FleetCondition",
    "drive_mission",
    "parse_fault",
    "remaining_scene",
]
