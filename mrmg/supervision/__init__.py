"""Above planning and execution: stops a driving fleet and plans the rest anew.

`drive_mission` drives a plan under control, `remaining_scene` states what is left.
"""

from mrmg.supervision.driving import Drive as Drive
from mrmg.supervision.driving import drive_mission as drive_mission
from mrmg.supervision.faults import parse_fault as parse_fault
from mrmg.supervision.parameters import ControlParams as ControlParams
from mrmg.supervision.remaining import FleetCondition as FleetCondition
from mrmg.supervision.remaining import remaining_scene as remaining_scene

__all__ = [
    "ControlParams",
    "Drive",
    "FleetCondition",
    "drive_mission",
    "parse_fault",
    "remaining_scene",
]
