"""Above planning and execution: stops a driving fleet and plans the rest anew.

`drive_mission` drives a plan under control, `remaining_scene` states what is left.
"""

from mrmg.mission_control.driving import Drive as Drive
from mrmg.mission_control.driving import drive_mission as drive_mission
from mrmg.mission_control.faults import parse_fault as parse_fault
from mrmg.mission_control.parameters import ControlParams as ControlParams
from mrmg.mission_control.remaining import FleetCondition as FleetCondition
from mrmg.mission_control.remaining import remaining_scene as remaining_scene

__all__ = [
    "ControlParams",
    "Drive",
    "FleetCondition",
    "drive_mission",
    "parse_fault",
    "remaining_scene",
]
