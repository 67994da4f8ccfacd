"""Damage to plans by kind, each with the rule of the verifier that must catch it."""

from __future__ import annotations

from dataclasses import dataclass

from faults import mission_damage as mission
from faults import motion_damage as motion
from faults import obstacle_damage as obstacles
from faults.changes import Make
from faults.mission_damage import change_visit
from mrmg.verification.verdict import ViolationKind as Kind


@dataclass(frozen=True, kw_only=True)
class Damage:
    """One way to break a plan.

    Attributes:
        what: is damaged.
        rule: that must catch it.
        make: does the damage.
    """

    what: str
    rule: Kind
    make: Make


DAMAGES = tuple(
    Damage(what=what, rule=rule, make=make)
    for what, rule, make in (
        ("states: x", Kind.DYNAMICS, motion.change_state(0)),
        ("states: y", Kind.DYNAMICS, motion.change_state(1)),
        ("states: speed", Kind.DYNAMICS, motion.change_state(3)),
        ("states: steering or yaw rate", Kind.DYNAMICS, motion.change_state(4)),
        ("states: not finite", Kind.MALFORMED, motion.make_not_finite),
        ("states: another shape", Kind.MALFORMED, motion.change_shape),
        ("states: another start", Kind.START, motion.move_start),
        ("states: cut off while driving", Kind.FINAL_REST, motion.cut_off),
        ("headings", Kind.DYNAMICS, motion.change_state(2)),
        ("headings at the finish", Kind.FINISH, mission.move_finish),
        ("controls", Kind.DYNAMICS, motion.change_control),
        ("limits of controls", Kind.CONTROL_LIMIT, motion.exceed_control_limit),
        (
            "limits of speed",
            Kind.STATE_LIMIT,
            motion.exceed_state_limit("v_max_m_s", 3),
        ),
        ("limits of steering", Kind.STATE_LIMIT, motion.exceed_state_limit("w_max", 4)),
        ("clocks: the plan's step", Kind.DYNAMICS, motion.change_step),
        ("clocks: one robot's step", Kind.MALFORMED, motion.change_step_of_one_robot),
        ("clocks: time limit", Kind.LATE, mission.shorten_time_limit),
        ("visits: step", Kind.VISIT, change_visit(mission.other_step)),
        ("visits: time", Kind.VISIT, change_visit(mission.other_time)),
        ("visits: charge", Kind.VISIT, change_visit(mission.other_charge)),
        ("visits: target", Kind.VISIT, change_visit(mission.other_target)),
        ("visits: left out", Kind.VISIT, change_visit(lambda visit, random: [])),
        ("visits: twice", Kind.VISIT, change_visit(lambda visit, random: [visit] * 2)),
        ("visits: of nobody", Kind.MALFORMED, change_visit(mission.other_robot)),
        (
            "visits: a recharge away from stations",
            Kind.RECHARGE,
            mission.claim_recharge,
        ),
        ("visits: tour", Kind.TOUR, mission.change_tour),
        ("visits: no tour", Kind.MALFORMED, mission.leave_out_tour),
        ("visits: a goal elsewhere", Kind.GOAL_MISSED, mission.move_goal),
        ("visits: dwell time", Kind.DWELL, mission.lengthen_dwell),
        ("visits: two at a station for one", Kind.OCCUPIED, mission.share_station),
        ("energies: less in the battery", Kind.ENERGY, mission.drain_battery),
        ("ledgers", Kind.LEDGER, mission.change_ledger),
        *[("posts between two poses", Kind.OBSTACLE, obstacles.put_post)] * 3,
        ("bounds", Kind.BOUNDS, obstacles.narrow_bounds),
        *[("other robots on the path", Kind.ROBOT, obstacles.cross_robot)] * 2,
        ("another scene", Kind.SCENE_MISMATCH, mission.name_other_scene),
        ("robots left out or unknown", Kind.MALFORMED, mission.change_robots),
    )
)
