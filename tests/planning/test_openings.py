"""Gaps little wider than the robot are found, and margins are kept and stated."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
import shapely.affinity

import mrmg
from mrmg.errors import UsageError
from mrmg.planning import PlannerParams, plan_mission
from mrmg.planning.frame import Frame
from mrmg.planning.margins_kept import with_margins
from mrmg.planning.problem.problem import state_mission
from mrmg.plans import Plan, PlanStatus, Trajectory
from mrmg.scene.loading import scene_from_document
from mrmg.scene.margins import (
    Margins,
    certified_minimum_m,
    default_margins,
    kept_margins,
)
from mrmg.scene.types import Scene
from mrmg.verification.verify import verify

SIZE_M = (24.0, 14.0)


def corners(shape: shapely.Polygon) -> list[list[float]]:
    return [list(point) for point in shape.exterior.coords[:-1]]


def gap(width_m: float, model: Any = "car", turn: float = 0.0) -> Scene:
    """Return a mission beyond a wall with one gap in its middle."""
    length, height = SIZE_M
    middle = (length / 2, height / 2)
    half = [
        shapely.box(middle[0] - 0.15, -9.0, middle[0] + 0.15, middle[1] - width_m / 2),
        shapely.box(middle[0] - 0.15, middle[1] + width_m / 2, middle[0] + 0.15, 30.0),
    ]
    walls = [
        shapely.affinity.rotate(one, turn, origin=middle, use_radians=True)
        & shapely.box(0.0, 0.0, length, height)
        for one in half
    ]
    return scene_from_document(
        {
            "format": 1,
            "name": "gap",
            "bounds": [0, 0, length, height],
            "obstacles": [
                {"id": f"wall{i}", "polygon": corners(one)}
                for i, one in enumerate(walls)
            ],
            "goals": [{"id": "g", "circle": {"center": [20, 9], "radius": 1}}],
            "battery": {"capacity_m": 200},
            "robots": [{"id": "r1", "model": model, "pose": [4, 4, 0.3]}],
        },
        source="gap",
    )


def planned(scene: Scene, **options: Any) -> Plan:
    result = plan_mission(scene, **options)
    assert result.plan is not None, result.reason
    return result.plan


@pytest.mark.parametrize(
    ("model", "width_m", "turn"),
    [
        ("car", 1.25, 0.0),
        ("car", 1.3, 0.7),
        ("hauler", 1.55, -0.6),
        ("diffdrive", 0.85, 0.3),
    ],
)
def test_gap_little_wider_than_the_robot(
    model: str, width_m: float, turn: float
) -> None:
    scene = gap(width_m, model, turn)
    plan = planned(scene)
    verdict = verify(scene, plan)
    assert verdict.ok, verdict.violations
    least_m = certified_minimum_m(scene.robots[0].model)
    assert plan.narrow
    for passage in plan.narrow:
        assert passage.robot == "r1"
        assert least_m - 1e-6 <= passage.margin_m < plan.margins["r1"][0]
        assert abs(passage.x_m - 12.0) < 6.0
    assert verdict.min_obstacle_clearance_m > 0.3 * least_m


@pytest.mark.parametrize("margin_m", [0.1, 0.4, 1.5])
@pytest.mark.parametrize("model", ["car", "diffdrive"])
def test_every_state_with_less_than_the_margin_is_stated(
    model: str, margin_m: float
) -> None:
    # Through the gap, with a long stay beside the wall.
    scene = gap(2.0, model)
    x_m = np.interp(np.arange(300), [0, 90, 210, 299], [3.0, 12.5, 12.5, 20.0])
    state = np.column_stack([x_m, np.full(300, 7.0), np.zeros((300, 3))])
    control = np.zeros((299, 2))
    way = Trajectory(robot="r1", dt_s=0.1, state=state, control=control)
    empty = replace(planned(gap(2.0)), trajectories=(way,))
    plan = with_margins(scene, empty, Margins(obstacle_m=margin_m, robot_m=0.1))
    walls = [shapely.box(*scene.bounds).boundary, *(o.shape for o in scene.obstacles)]
    bodies = shapely.polygons(scene.robots[0].model.footprint_at(state))
    clearance_m = shapely.distance(bodies, shapely.union_all(walls))
    stated = np.zeros(len(bodies), np.bool_)
    for passage in plan.narrow:
        first, last = (round(s / way.dt_s) for s in (passage.start_s, passage.end_s))
        stated[first : last + 1] = True
        assert passage.margin_m == pytest.approx(clearance_m[first : last + 1].min())
    np.testing.assert_array_equal(stated, clearance_m < margin_m - 1e-7)


def test_wide_gaps_keep_the_margin() -> None:
    scene = gap(2.2)
    plan = planned(scene)
    assert plan.narrow == ()
    assert verify(scene, plan).min_obstacle_clearance_m > 0.2


def test_too_narrow_a_gap_is_no_way() -> None:
    result = plan_mission(gap(1.12))
    assert result.plan is None
    assert result.status is PlanStatus.NO_PLAN_FOUND
    assert plan_mission(gap(1.05)).status is PlanStatus.INFEASIBLE


def test_narrow_passages_are_saved_and_checked(tmp_path: Any) -> None:
    scene = gap(1.25)
    plan = planned(scene)
    plan.save(tmp_path)
    back = Plan.load(tmp_path)
    assert (back.narrow, back.margins) == (plan.narrow, plan.margins)
    unstated = verify(scene, replace(plan, narrow=()))
    assert {found.kind.value for found in unstated.violations} == {"margin"}
    closer = tuple(replace(one, margin_m=0.001) for one in plan.narrow)
    assert (
        "certified minimum"
        in verify(scene, replace(plan, narrow=closer)).violations[0].message
    )


@pytest.mark.parametrize("stated", [{"obstacle": 0.4}, {"obstacle": 0.4, "robot": 0.1}])
def test_margins_of_file_and_of_the_call_count_alike(stated: dict[str, float]) -> None:
    scene = gap(3.0)
    in_file, in_call = scene.with_(margins=stated), planned(scene, margins=stated)
    plan = planned(in_file)
    assert plan.margins == in_call.margins
    assert plan.margins["r1"] == (0.4, stated.get("robot", 0.5))
    for made, mission in ((plan, in_file), (in_call, scene)):
        verdict = verify(mission, made)
        assert verdict.ok
        assert verdict.min_obstacle_clearance_m > 0.35


def test_own_margins_replace_what_they_name() -> None:
    scene = gap(3.0).with_(margins={"obstacle": 0.3, "robot": 0.9})
    own = scene.with_robot("r1", margins={"obstacle": 0.1})
    kept = kept_margins(own.robots[0])
    assert (kept.obstacle_m, kept.robot_m) == (0.1, 0.9)
    assert scene_from_document(own.document, source="again") == own


def test_small_robots_have_small_margins() -> None:
    limits = {"v_max": 0.2, "v_min": -0.1}
    slow = gap(3.0, {"like": "diffdrive", "limits": limits, "tracking_error": None})
    small, large = (
        default_margins(scene.robots[0].model) for scene in (slow, gap(3.0))
    )
    assert small.obstacle_m == pytest.approx(0.05)
    assert (large.obstacle_m, large.robot_m) == (0.25, 0.5)


@pytest.mark.parametrize(
    "wrong", ["0.1", "obstacle=x", {"wall": 0.1}, "robot=3", "", "robot=1,robot=1"]
)
def test_wrong_margins_are_refused(wrong: Any) -> None:
    with pytest.raises(UsageError, match=r"margins: .* at most 1 from obstacles"):
        plan_mission(gap(3.0), margins=wrong)


def test_goals_out_of_reach_are_left_out_with_their_proofs() -> None:
    scene = gap(3.0)
    room = shapely.Point(20, 3).buffer(1.6)
    cell = {
        "id": "cell",
        "polygon": [[17, 0.5], [23, 0.5], [23, 5.5], [17, 5.5]],
        "holes": [corners(room)],
    }
    more = scene.with_(
        obstacles=[*scene.obstacles, cell],
        goals=[*scene.goals, {"id": "h", "circle": {"center": [20, 3], "radius": 1}}],
    )
    assert plan_mission(more).status is PlanStatus.INFEASIBLE
    plan = planned(more, skip_unreachable=True)
    assert {*plan.skipped} == {"h"}
    assert "cut off" in plan.skipped["h"]
    verdict = mrmg.verify(more, plan)
    assert verdict.ok
    assert verdict.skipped == ("h",)
    assert planned(scene, skip_unreachable=True).skipped == {}


def test_proofs_that_goals_are_out_of_reach_take_of_the_budget() -> None:
    scene = gap(3.0)
    stay = {"id": "h", "circle": {"center": [20, 4], "radius": 1}, "dwell": 300}
    more = scene.with_(goals=[*scene.document["goals"], stay], time_limit=60)
    built_s: list[float] = []

    def on_progress(_: float, text: str) -> None:
        if text == "roadmap built":
            built_s.append(time.perf_counter())

    result = plan_mission(more, skip_unreachable=True, on_progress=on_progress)
    assert result.plan is not None
    assert {*result.plan.skipped} == {"h"}
    assert len(built_s) == 2
    assert result.statistics["time_s"]["init"] > built_s[1] - built_s[0]


@pytest.mark.parametrize("quarters", range(4))
def test_places_of_the_frame_are_found_on_the_map(quarters: int) -> None:
    frame = Frame((3.0, -2.0, 13.0, 5.0), quarters)
    for point in [(3.0, -2.0), (12.0, 4.5)]:
        moved = frame.points(np.array(point))[0]
        assert frame.on_the_map(tuple(moved)) == pytest.approx(point)


def test_narrow_corners_are_turned_in_with_the_certified_minimum() -> None:
    """A differential drive 0.85 m long turns in the corner of a corridor 1.1 m wide."""
    walls = {"a": (6, 0, 20, 5.5), "b": (0, 6.6, 12, 20), "c": (13.1, 5.5, 20, 13)}
    scene = scene_from_document(
        {
            "format": 1,
            "name": "corner",
            "bounds": [0, 0, 20, 20],
            "obstacles": [
                {"id": name, "polygon": corners(shapely.box(*wall))}
                for name, wall in walls.items()
            ],
            "goals": [{"id": "g", "circle": {"center": [13, 17], "radius": 1}}],
            "battery": {"capacity_m": 200},
            "robots": [{"id": "r1", "model": "diffdrive", "pose": [3, 3, 0]}],
        },
        source="corner",
    )
    plan = planned(scene, params=PlannerParams(trees=1))
    assert verify(scene, plan).ok
    assert min(passage.margin_m for passage in plan.narrow) < 0.1
    kept = kept_margins(scene.robots[0])
    assert plan.margins == {"r1": (kept.obstacle_m, kept.robot_m)}


def test_passages_are_named_with_place_and_width() -> None:
    reason = plan_mission(gap(1.2)).reason
    assert "widest way of r1" in reason
    assert "1.20 m wide near (12.0, 7.0)" in reason
    assert "at least 0.030 m" in reason
    proof = plan_mission(gap(1.05, turn=0.4)).reason
    assert "1.05 m wide near (12.0, 7.0), r1 is 1.10 m wide" in proof


def test_passages_to_stations_are_not_those_to_goals() -> None:
    scene = gap(1.2)
    shell = shapely.box(2, 8, 8, 13) - shapely.box(2.5, 8.5, 7.5, 12.5)
    shell -= shapely.box(7, 10, 9, 11.15)
    more = scene.with_(
        obstacles=[
            *scene.document["obstacles"],
            {"id": "shell", "polygon": corners(shell)},
        ],
        stations=[{"id": "s", "circle": {"center": [5, 10.5], "radius": 1}}],
    )
    reason = plan_mission(more).reason
    assert "no path was found to g, " in reason
    assert "1.20 m wide" in reason
    assert "1.15 m wide" not in reason


@pytest.mark.parametrize("apart_m", [0.1, 0.45])
def test_robots_that_start_near_each_other_get_away(apart_m: float) -> None:
    model = gap(12.0).robots[0].model
    beside_m = 2.0 * model.half_width_m + apart_m
    document = {
        "format": 1,
        "name": "near",
        "bounds": [0, 0, *SIZE_M],
        "goals": [{"id": "g", "circle": {"center": [15, 4], "radius": 1}}],
        "robots": [
            {"id": "r1", "model": "car", "pose": [4, 4, 0]},
            {"id": "r2", "model": "car", "pose": [4, 4 + beside_m, 0]},
        ],
    }
    scene = scene_from_document(document, source="near")
    result = plan_mission(scene)
    assert result.plan is not None, result.reason
    assert verify(scene, result.plan).ok
    least_m = 2.0 * certified_minimum_m(model)
    kept = default_margins(model)
    assert result.plan.margins["r1"] == (kept.obstacle_m, least_m)
    (hint,) = [hint for hint in result.hints if "no motions were found" in hint]
    assert f"{least_m:.3f} m instead of {kept.robot_m:g} m" in hint


@pytest.mark.parametrize("corner", [(0.0, 0.0), (100.0, 200.0)])
def test_proofs_name_places_where_they_lie(corner: tuple[float, float]) -> None:
    x, y = corner
    document = {
        "format": 1,
        "name": "turned",
        "bounds": [x, y, x + 30.0, y + 15.0],
        "obstacles": [
            {
                "id": name,
                "polygon": [
                    [x + 15.0, y + low],
                    [x + 15.5, y + low],
                    [x + 15.5, y + high],
                    [x + 15.0, y + high],
                ],
            }
            for name, low, high in (("south", 0.0, 4.0), ("north", 5.0, 15.0))
        ],
        "goals": [{"id": "g", "circle": {"center": [x + 5.0, y + 7.0], "radius": 1}}],
        "robots": [{"id": "r1", "model": "car", "pose": [x + 25.0, y + 12.0, 3.1]}],
    }
    result = plan_mission(scene_from_document(document, source="turned"))
    assert result.status is PlanStatus.INFEASIBLE
    assert f"1.00 m wide near ({x + 15.2:.1f}, {y + 4.5:.1f})" in result.reason


def test_a_region_that_is_narrow_itself_is_named() -> None:
    scene = gap(12.0)
    edge = replace(scene.goals[0].region, center=(24.5, 9.0))
    goal = replace(scene.goals[0], region=edge)
    result = plan_mission(replace(scene, goals=(goal,)))
    assert result.plan is None
    place = result.reason.split("near (")[1].split(",")[0]
    assert float(place) > 22.0, result.reason


WALL = (shapely.box(4.0, 4.8, 16.0, 5.2),)


def beside_a_wall(
    model: str,
    pose: list[float],
    ends: list[float],
    walls: Sequence[shapely.Polygon] = WALL,
) -> Scene:
    """Return a mission with walls, in which r1 ends in a circle of 0.2 m."""
    return scene_from_document(
        {
            "format": 1,
            "name": "beside",
            "bounds": [0, 0, 20, 12],
            "obstacles": [
                {"id": f"w{i}", "polygon": corners(wall)}
                for i, wall in enumerate(walls)
            ],
            "battery": {"capacity_m": 200},
            "robots": [
                {
                    "id": "r1",
                    "model": model,
                    "pose": pose,
                    "finish": {"circle": {"center": ends, "radius": 0.2}},
                },
                {"id": "r2", "model": model, "pose": [14, 2, 0], "finish": "start"},
            ],
        },
        source="beside",
    )


@pytest.mark.parametrize(
    ("model", "pose", "ends", "spacing_m"),
    [
        ("car", [10, 5.85, 0.0], [16, 9], 0.5),
        ("car", [0.65, 6, 1.5708], [16, 9], 0.5),
        ("car", [4, 8, 0.0], [10, 5.75], 0.5),
        ("diffdrive", [4, 8, 0.0], [19.65, 8], 0.048),
    ],
)
def test_starts_and_finishes_beside_walls(
    model: str, pose: list[float], ends: list[float], spacing_m: float
) -> None:
    """Nothing is narrow there, but margins keep robots away from the place itself.

    Only where there is a path, and no motion, robots are nearer to each other, too.
    """
    scene = beside_a_wall(model, pose, ends)
    plan = planned(scene, params=PlannerParams(trees=1))
    assert verify(scene, plan).ok
    assert {passage.robot for passage in plan.narrow} == {"r1"}
    least_m = certified_minimum_m(scene.robots[0].model)
    assert all(passage.margin_m >= least_m - 1e-6 for passage in plan.narrow)
    assert plan.margins["r1"][1] == pytest.approx(spacing_m)


@pytest.mark.parametrize("behind_m", [0.06, 0.2, 0.4])
@pytest.mark.parametrize("nose_in", [False, True])
def test_cars_leave_bays_that_they_are_parked_in(
    behind_m: float, nose_in: bool
) -> None:
    """Margins are smaller there from the first attempt on."""
    reach_m = 1.5 if nose_in else 0.3
    pose = [reach_m + behind_m, 7.0, np.pi if nose_in else 0.0]
    walls = [shapely.box(0.0, y, 2.4, y + 0.2) for y in (5.95, 7.85)]
    scene = beside_a_wall("car", pose, [16, 9], walls)
    plan = planned(scene)
    assert verify(scene, plan).ok
    kept_m = default_margins(scene.robots[0].model).obstacle_m or 0.0
    if behind_m < kept_m:
        assert {passage.robot for passage in plan.narrow} == {"r1"}
        assert state_mission(scene, 0, PlannerParams()).openings[0].robots == (0,)


def test_a_start_too_near_a_wall_is_named() -> None:
    reason = plan_mission(beside_a_wall("car", [10, 5.76, 0], [16, 9])).reason
    assert "1.12 m wide near (10.0, 5.8)" in reason
