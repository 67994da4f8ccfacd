"""The sections of the report page that are tables: energy, tours, checks."""

from __future__ import annotations

from mrmg.energy.audit_record import EnergyAudit
from mrmg.energy.battery_curves import shown_curves
from mrmg.energy.by_terrain import energy_by_terrain, planned_interval_J
from mrmg.energy.ledger import EnergyLedger
from mrmg.energy.model import PARTS
from mrmg.plans import Plan
from mrmg.report.page import elements as html
from mrmg.runs.record import RunRecord
from mrmg.scene.margins import sentences_on_margins
from mrmg.scene.types import Scene
from mrmg.viz.activities import lengths_along, standing_of
from mrmg.viz.style import terrain_classes

_PART_COLORS = {
    "rolling": "#4477AA",
    "turning": "#CCBB44",
    "inertia": "#EE6677",
    "grade": "#228833",
    "idle": "#8A94A0",
    "device": "#AA3377",
}
_MAX_LISTED = 20
_KJ_DIGITS = 2
_STILL_M = 0.1


def energy(record: RunRecord) -> list[str]:
    """Return the energy by robot, part and meter."""
    if record.plan is None:
        return []
    audit, plan = record.audit, record.plan
    dots = _robot_dots(record)
    most_J = max((plan.ledger.total_J(robot=item) for item in dots), default=0.0)
    rows: list[list[str]] = []
    sums = []
    for robot in (*dots, None):
        sums.append(len(rows))
        name = dots[robot] if robot else "Fleet"
        parts = [
            (part_J, _PART_COLORS[part], f"{robot or 'fleet'}, {part}: {kJ(part_J)}")
            for part in PARTS
            for part_J in [plan.ledger.total_J(robot=robot, part=part)]
        ]
        share = html.bar(parts, most_J) if robot else ""
        rows.append([name, "all", share, *_meters(plan, audit, robot, None)])
        rows += [
            ["", html.dot(_PART_COLORS[part], part), ""]
            + _meters(plan, audit, robot, part)
            for part in PARTS
            if plan.ledger.total_J(robot=robot, part=part) != 0.0
        ]
    head = ["Robot", "Part", "Planned by part", "Planned", "Metered", "Measured"]
    head += ["Metered − planned", "Measured − planned"]
    return [
        html.table(head, rows, text_columns=(0, 1, 2), sums=sums),
        *_intervals(record.scene, plan),
        html.note(
            "Planned: energy model over the plan. Metered: the same model over the "
            "simulated motion. Measured: work of the simulated drives, which has no "
            "parts but driving and the consumers that run at all times."
        ),
    ]


def _intervals(scene: Scene, plan: Plan) -> list[str]:
    """Return within what energies runs differ, if the terrain's spreads are known."""
    robots = [robot.id for robot in scene.robots]
    found = [
        (name, planned_interval_J(scene, plan, ids))
        for name, ids in [*((robot, [robot]) for robot in robots), ("fleet", robots)]
    ]
    texts = [
        f"{name} {kJ(ends_J[0])} to {kJ(ends_J[1])}"
        for name, ends_J in found
        if ends_J is not None
    ]
    if not texts:
        return []
    text = (
        "90 % intervals of the energy, as runs differ on this terrain "
        f"(energy_spread of the scene): {', '.join(texts)}."
    )
    return [html.note(text)]


def terrain(record: RunRecord) -> list[str]:
    """Return the fleet's energy by terrain class and meter."""
    if record.plan is None:
        return []
    classes = energy_by_terrain(record.scene, record.plan, record.log)
    colors = {key: look.color for key, look in terrain_classes(record.scene).items()}
    most_J = max((item.planned_J for item in classes), default=0.0)
    rows = []
    for item in classes:
        color = colors.get(item.multiplier, "var(--quiet)")
        tip = f"terrain ×{item.multiplier:g}: {kJ(item.planned_J)} planned"
        rows.append(
            [
                html.dot(color, f"×{item.multiplier:g}"),
                html.bar([(item.planned_J, color, tip)], most_J),
                f"{item.planned_m:.1f} m",
                "" if item.driven_m is None else f"{item.driven_m:.1f} m",
                kJ(item.planned_J),
                "" if item.metered_J is None else kJ(item.metered_J),
                "" if item.measured_J is None else kJ(item.measured_J),
                ""
                if item.measured_J is None
                else percent(item.measured_J, item.planned_J),
            ]
        )
    head = ["Terrain", "Planned by terrain", "Way planned", "Way driven", "Planned"]
    head += ["Metered", "Measured", "Measured − planned"]
    return [html.table(head, rows, text_columns=(0, 1))]


def _robot_dots(record: RunRecord) -> dict[str, str]:
    """Return each robot's id behind a mark of its colour."""
    return {
        robot.id: html.robot_dot(index, robot.id)
        for index, robot in enumerate(record.scene.robots)
    }


def _meters(
    plan: Plan, audit: EnergyAudit | None, robot: str | None, part: str | None
) -> list[str]:
    planned_J = plan.ledger.total_J(robot=robot, part=part)
    if audit is None:
        return [kJ(planned_J), "", "", "", ""]
    metered_J = audit.metered.total_J(robot=robot, part=part)
    measured_J = audit.measured.total_J(robot=robot) if part is None else None
    return [
        kJ(planned_J),
        kJ(metered_J),
        "" if measured_J is None else kJ(measured_J),
        percent(metered_J, planned_J),
        "" if measured_J is None else percent(measured_J, planned_J),
    ]


def tours(record: RunRecord) -> list[str]:
    """Return every robot's tour: stops, arrivals, energy."""
    if record.plan is None:
        return []
    dots = _robot_dots(record)
    head = ["Stop", "Target", "Kind", "Planned arrival", "Arrival", "Leg planned"]
    head += ["Leg measured", "Charge planned", "Charge on arrival"]
    parts = []
    for robot in record.plan.tours:
        parts.append(html.subheading(dots[robot]))
        rows = _tour_rows(record, record.plan, robot)
        parts.append(
            html.table(head, rows, text_columns=(0, 1, 2))
            or html.note(_without_tour(record, record.plan, robot))
        )
    return parts


def _without_tour(record: RunRecord, plan: Plan, robot: str) -> str:
    curves = shown_curves(record.scene, plan, record.log)
    state = next(curve.state for curve in curves if curve.robot == robot)
    stays = lengths_along(state)[-1] < _STILL_M
    standing = standing_of(robot, plan, record.log)
    return f"{standing}: stays where it is" if stays else standing


def _tour_rows(record: RunRecord, plan: Plan, robot: str) -> list[list[str]]:
    capacity_J = record.scene.robot(robot).battery.capacity_J
    planned = [visit for visit in plan.visits if visit.robot == robot]
    driven = (
        [visit for visit in record.audit.visits if visit.robot == robot]
        if record.audit
        else []
    )
    planned_legs = _legs(plan.ledger, robot)
    driven_legs = _legs(record.audit.measured, robot) if record.audit else {}
    rows = []
    for leg, target in enumerate(plan.tours[robot]):
        expected = planned[leg] if leg < len(planned) else None
        actual = driven[leg] if leg < len(driven) else None
        kind = (expected or actual).kind if expected or actual else ""  # type: ignore[union-attr]
        rows.append(
            [
                str(leg + 1),
                target,
                "⚡ station" if kind == "station" else kind,
                f"{expected.time_s:.1f} s" if expected else "not reached",
                f"{actual.time_s:.1f} s" if actual else "not reached" if driven else "",
                kJ(planned_legs[leg]) if leg in planned_legs and expected else "",
                kJ(driven_legs[leg]) if leg in driven_legs and actual else "",
                f"{100 * expected.energy_J / capacity_J:.1f} %" if expected else "",
                f"{100 * actual.energy_J / capacity_J:.1f} %" if actual else "",
            ]
        )
    return rows


def _legs(ledger: EnergyLedger, robot: str) -> dict[int, float]:
    """Return the energy [J] of each leg of one robot."""
    legs: dict[int, float] = {}
    for entry in ledger.entries:
        if entry.robot == robot:
            legs[entry.leg] = legs.get(entry.leg, 0.0) + entry.energy_J
    return legs


def checks(record: RunRecord) -> list[str]:
    """Return what verifier and audit found, robot by robot."""
    verdict, audit, log = record.verdict, record.audit, record.log
    parts = []
    if verdict is not None:
        count = len(verdict.violations)
        rows = [
            ["Rules broken by the plan", str(count) if count else "none"],
            [
                "Least distance to an obstacle",
                _distance(verdict.min_obstacle_clearance_m),
            ],
            ["Least distance of two robots", _distance(verdict.min_robot_distance_m)],
        ]
        if log is not None:
            contacts = str(len(log.contacts)) if log.contacts else "none"
            rows.append(["Contacts in the simulation", contacts])
        parts.append(html.table(["Check", "Result"], rows))
        if record.plan is not None:
            kept = sentences_on_margins(record.scene.robots, record.plan.margins)
            parts.append(html.bullets([f"Margins kept by {one}" for one in kept]))
        parts.append(html.bullets(_shortened([v.message for v in verdict.violations])))
    if audit is not None:
        parts.append(html.bullets(_shortened(list(audit.reasons))))
        head = ["Robot", "Tracking rms", "Tracking max", "Lowest charge"]
        rows = [
            [
                robot.robot,
                f"{100 * robot.tracking_rms_m:.1f} cm",
                f"{100 * robot.tracking_max_m:.1f} cm",
                f"{100 * robot.min_charge_fraction:.1f} %",
            ]
            for robot in audit.robots
        ]
        parts += [html.subheading("Execution"), html.table(head, rows)]
        parts += _balances(audit)
    return parts


def _balances(audit: EnergyAudit) -> list[str]:
    """Return what became of the work of every robot's actuators."""
    rows = [
        [
            robot.robot,
            kJ(balance.work_J),
            kJ(balance.steering_J),
            kJ(balance.kinetic_J + balance.potential_J),
            kJ(balance.joints_J),
            kJ(balance.contacts_J),
            f"{signed(balance.residual_J, 1)} J",
            f"{signed(balance.residual_pct, 3)} %",
        ]
        for robot in audit.robots
        for balance in [robot.balance]
        if balance is not None
    ]
    head = ["Robot", "Drives", "Steering", "Motion and height", "Joint friction"]
    head += ["Contacts", "Residual", "of the drives' work"]
    explained = (
        "Work of the actuators, by MuJoCo's forces over its velocities, against what "
        "became of it: kinetic and potential energy, friction and damping of joints, "
        "what contacts took. The residual is what none of them accounts for."
    )
    if not rows:
        return []
    return [
        html.subheading("Energy balance"),
        html.table(head, rows),
        html.note(explained),
    ]


def _shortened(items: list[str]) -> list[str]:
    rest = len(items) - _MAX_LISTED
    return items[:_MAX_LISTED] + ([f"... and {rest} more"] if rest > 0 else [])


def kJ(energy_J: float) -> str:
    """Return an energy as text."""
    return f"{energy_J / 1000.0 + 0.0:.{_KJ_DIGITS}f} kJ"


def _distance(distance_m: float | None) -> str:
    if distance_m is None:
        return "–"
    far = distance_m >= 1.0
    return f"{distance_m:.2f} m" if far else f"{100.0 * distance_m:.1f} cm"


def percent(value: float, base: float) -> str:
    """Return how far an energy is above another, of which 0.00 kJ has no share."""
    shown = round(base / 1000.0, _KJ_DIGITS)
    return f"{signed(100.0 * (value - base) / base, 2)} %" if shown else "–"


def signed(value: float, digits: int) -> str:
    """Return a number with its sign as text; zero has none that is rounded away."""
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")
