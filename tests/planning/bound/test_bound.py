"""The bound against exact answers, known shortest ways and verified plans."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrmg.planning import plan_mission
from mrmg.planning.bound._eikonal_kernels import UNREACHED, certified_field
from mrmg.planning.bound.bound import lower_bound_J, relaxed_routing_J
from mrmg.planning.bound.clearance import passing_radius_m
from mrmg.planning.bound.exact_tours import PRUNED_GOALS, exact_routing
from mrmg.planning.bound.geodesic import Field, Look
from mrmg.planning.bound.makespan_bound import makespan_bound_s
from mrmg.planning.bound.relaxation import Relaxation
from mrmg.planning.routing._nrpa_kernels import RoutingArrays
from mrmg.planning.routing.instance import RoutingInstance
from mrmg.planning.routing.routing import RouterParams, Routing, solve_routing
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.types import Scene

SCENES = Path(__file__).parents[3] / "scenes"

DISCRETISATION = 0.02
"""Share of the bound that where the grid lies may cost or gain."""

Mission = Callable[..., RoutingArrays]
Replay = Callable[..., tuple[float, float]]
Oracle = Callable[[RoutingArrays], float]
Yard = Callable[..., Scene]

SIZES = [
    (4, 2, 1, (60.0, 160.0)),
    (6, 2, 1, (90.0, 200.0)),
    (5, 3, 2, (60.0, 160.0)),
    (6, 3, 2, (90.0, 200.0)),
    (6, 2, 3, (90.0, 200.0)),
    (5, 0, 2, (120.0, 300.0)),
    (5, 4, 1, (55.0, 90.0)),  # several stations in a row
]
"""Goals, stations, robots and the way a full battery lasts for [m]."""


# --- exact tours -------------------------------------------------------------------


@pytest.mark.parametrize(("goals", "stations", "robots", "range_m"), SIZES)
def test_exact_tours_are_valid_and_optimal(
    mission: Mission,
    replay: Replay,
    oracle: Oracle,
    goals: int,
    stations: int,
    robots: int,
    range_m: tuple[float, float],
) -> None:
    feasible = 0
    for seed in range(25):
        problem = mission(
            seed, goals=goals, stations=stations, robots=robots, range_m=range_m
        )
        optimum = oracle(problem)
        routing = exact_routing(problem)
        assert routing is not None
        assert routing.cost_J == pytest.approx(optimum)
        if not routing.feasible:
            continue
        feasible += 1
        visited = [t for tour in routing.tours for t in tour if t < goals]
        assert sorted(visited) == list(range(goals))
        driven = [replay(problem, r, tour) for r, tour in enumerate(routing.tours)]
        assert min(least for _, least in driven) >= -1e-6
        assert routing.cost_J == pytest.approx(sum(cost for cost, _ in driven))
    assert feasible >= 3, "too few missions can be solved to say anything"


def test_costs_need_not_be_a_metric(oracle: Oracle) -> None:
    """Regions are crossed for nothing, so that a way over a third may be shorter."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        problem = RoutingInstance(
            goals=5,
            distance=rng.uniform(1.0, 30.0, (2, 7, 7)),
            start_distance=rng.uniform(1.0, 30.0, (2, 7)),
            plain=np.ones(2),
            energy=np.array([15.0, 25.0]),
            capacity=np.array([20.0, 25.0]),
            reserve=np.ones(2),
        ).arrays
        routing = exact_routing(problem)
        assert routing is not None
        assert routing.cost_J == pytest.approx(oracle(problem))


def test_a_chain_of_stations_is_driven_in_order(
    chain: RoutingArrays, replay: Replay
) -> None:
    routing = exact_routing(chain)
    assert routing == Routing(((1, 2, 3, 4, 5, 0),), 60.0)
    assert replay(chain, 0, routing.tours[0])[1] >= 0.0


def test_only_open_goals_are_visited(mission: Mission, oracle: Oracle) -> None:
    open_goal = (True, False, True, False, True)
    for seed in range(10):
        problem = mission(seed, goals=5, stations=2, robots=2, open_goal=open_goal)
        routing = exact_routing(problem)
        assert routing is not None
        assert routing.cost_J == pytest.approx(oracle(problem))
        if routing.feasible:
            visited = {t for tour in routing.tours for t in tour if t < 5}
            assert visited == {0, 2, 4}


def test_nothing_to_visit_costs_nothing_and_too_much_is_declined(
    mission: Mission,
) -> None:
    idle = mission(0, goals=3, stations=1, robots=2, open_goal=(False,) * 3)
    assert exact_routing(idle) == Routing(((), ()), 0.0)
    assert relaxed_routing_J(idle) == 0.0
    assert exact_routing(mission(0, goals=PRUNED_GOALS + 1, stations=2)) is None


def test_twelve_goals_and_four_robots_are_never_dearer_than_the_heuristic(
    mission: Mission,
) -> None:
    for seed in range(3):
        problem = mission(seed, goals=12, stations=3, robots=4, range_m=(120.0, 240.0))
        routing = exact_routing(problem)
        assert routing is not None
        heuristic = solve_routing(problem, RouterParams(), seed)
        assert routing.cost_J <= heuristic.cost_J * (1.0 + 1e-9)


# --- the bound of missions of any size ---------------------------------------------


@pytest.mark.parametrize(("goals", "stations", "robots", "range_m"), SIZES)
def test_the_relaxed_bound_is_below_the_optimum_and_near_it(
    mission: Mission,
    oracle: Oracle,
    goals: int,
    stations: int,
    robots: int,
    range_m: tuple[float, float],
) -> None:
    shares = []
    for seed in range(25):
        problem = mission(
            seed, goals=goals, stations=stations, robots=robots, range_m=range_m
        )
        optimum = oracle(problem)
        bound = relaxed_routing_J(problem)
        assert 0.0 <= bound <= optimum * (1.0 + 1e-9)
        if np.isfinite(optimum):
            shares.append(bound / optimum)
    assert np.median(shares) >= 0.7


# --- ways --------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_a_field_is_never_steeper_than_the_price(seed: int) -> None:
    """Neighbouring samples of a cell differ by no more than the way between costs."""
    rng = np.random.default_rng(seed)
    price = np.kron(rng.uniform(1.0, 3.0, (6, 6)), np.ones((5, 5)))
    price[rng.random(price.shape) < 0.15] = np.inf
    seeds = np.full((31, 31), UNREACHED)
    seeds[12, 17] = 0.0
    u, level, certified = certified_field(price, 0.5, seeds, 4, 0.1)
    field = Field(u.ravel(), level, certified)
    assert np.count_nonzero(u < UNREACHED) > 500
    t = np.linspace(0.0, 1.0, 6)
    y, x = (axis.ravel() for axis in np.meshgrid(t, t, indexing="ij"))
    way = 0.5 * np.hypot(x[:, None] - x, y[:, None] - y)
    for i, j in np.argwhere(np.isfinite(price) & (u[:-1, :-1] < UNREACHED)):
        nodes = np.ravel_multi_index(
            ([i, i, i + 1, i + 1], [j, j + 1, j, j + 1]), u.shape
        )
        arc = np.zeros(len(x), int)
        look = Look(np.tile(nodes, (len(x), 1)), x, y, 0.0 * x, arc)
        value = field.at(look)
        rise = np.abs(value[:, None] - value)
        assert (rise <= price[i, j] * way + 1e-9).all()
        corners = np.isin(x, (0, 1)) & np.isin(y, (0, 1))
        assert value[corners] == pytest.approx(field.at_nodes()[nodes])


def way_m(scene: Scene, **options: Any) -> float:
    """Return the bound of the way from the first robot to the first goal [m]."""
    problem = Relaxation.of(scene, **options).problem
    joules = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    return float(problem.cost[0, -1, 0]) / joules


def test_on_plain_ground_the_way_is_the_straight_one(yard: Yard) -> None:
    assert way_m(yard()) == pytest.approx(22.0 - 1.5)


def test_the_way_round_a_wall_is_known(yard: Yard) -> None:
    """A wall from the south to y = 15; the reference point passes 0.3 m from it."""
    wall = {
        "id": "w",
        "polygon": [[14, 0], [16, 0], [16, 15], [14, 15]],
        "height": 1,
    }
    corner = math.hypot(10.0, 5.0)
    nearest = corner + 2.0 + corner - 1.5
    farthest = 2.0 * math.hypot(10.0, 5.3) + 2.6 - 1.5
    bound = way_m(yard(obstacles=[wall]))
    assert bound <= farthest
    assert bound >= 0.96 * nearest


def test_terrain_across_the_way_is_paid_for(yard: Yard) -> None:
    mud = {
        "id": "m",
        "polygon": [[12, 0], [18, 0], [18, 20], [12, 20]],
        "multiplier": 2.5,
    }
    exact = 20.5 + 6.0 * 1.5
    bound = way_m(yard(terrain=[mud]))
    assert 0.95 * exact <= bound <= exact


def test_terrain_cheaper_than_plain_ground_is_used(yard: Yard) -> None:
    road = {
        "id": "m",
        "polygon": [[0, 8], [30, 8], [30, 12], [0, 12]],
        "multiplier": 0.5,
    }
    assert 0.95 * 10.25 <= way_m(yard(terrain=[road])) <= 10.25


def test_a_finer_grid_brings_the_way_nearer_to_the_truth(yard: Yard) -> None:
    mud = {"id": "m", "circle": {"center": [15, 9], "radius": 4}, "multiplier": 3}
    coarse, fine = (way_m(yard(terrain=[mud]), cells=n) for n in (2_000, 40_000))
    assert coarse <= fine * 1.005


def test_a_goal_behind_a_closed_wall_has_an_infinite_bound(yard: Yard) -> None:
    wall = {
        "id": "w",
        "polygon": [[14, 0], [16, 0], [16, 20], [14, 20]],
        "height": 1,
    }
    assert lower_bound_J(yard(obstacles=[wall])) == math.inf


# --- missions ----------------------------------------------------------------------


def test_no_goal_costs_nothing() -> None:
    document = {
        "format": 1,
        "name": "idle",
        "bounds": [0, 0, 30, 20],
        "goals": [],
        "robots": [{"id": "r1", "model": "car", "pose": [4, 10, 0]}],
    }
    assert lower_bound_J(scene_from_document(document, source="idle")) == 0.0


def test_slopes_change_the_bound_by_what_the_climb_is_worth(yard: Yard) -> None:
    """20.5 m of way; half a metre of height is worth 8.3 m of plain ground."""
    joules = yard().robots[0].model.energy_model.plain_ground_J_per_m()
    flat_J = lower_bound_J(yard())
    up_J, down_J = (
        lower_bound_J(yard(elevation={"grid": [[a, b]] * 2}))
        for a, b in ((0.0, 0.6), (0.6, 0.0))
    )
    # Regions and starts are as low or high as their lowest and highest places are, half
    # a metre about them: less is known of the climb, and more of the descent.
    worth_J = 20.5 * 0.02 / 0.06 * joules
    assert flat_J + 0.85 * worth_J <= up_J <= flat_J + worth_J
    assert flat_J - 1.35 * worth_J <= down_J <= flat_J - worth_J


def test_hollows_and_robots_that_stay_put_lower_nothing(yard: Yard) -> None:
    """The hollow lies beside the way: no tour ends in it."""
    hollow = {"hills": [{"center": [15, 10], "height": -0.3, "radius": 6}]}
    robots = [
        {"id": f"r{k}", "model": "car", "pose": [4, 4 + 4 * k, 0]} for k in range(4)
    ]
    flat_J = lower_bound_J(yard(robots=robots))
    assert lower_bound_J(yard(robots=robots, elevation=hollow)) == pytest.approx(flat_J)


def test_a_robot_drives_on_to_its_finish(yard: Yard) -> None:
    """There 20.5 m, back to within 1 m of the start."""
    joules = yard().robots[0].model.energy_model.plain_ground_J_per_m()
    robot = {"id": "r1", "model": "car", "pose": [4, 10, 0], "finish": "start"}
    there_and_back_m = lower_bound_J(yard(robots=[robot])) / joules
    assert 39.7 <= there_and_back_m <= 40.0
    assert makespan_bound_s(yard(robots=[robot])) > 1.8 * makespan_bound_s(yard())
    short = {"capacity_m": 35}
    assert lower_bound_J(yard(battery=short)) < math.inf
    assert lower_bound_J(yard(robots=[robot], battery=short)) == math.inf


def test_finishes_alone_have_bounds(yard: Yard) -> None:
    """Both drive 9 m, one of them not at all where it is to end where it starts."""
    joules = yard().robots[0].model.energy_model.plain_ground_J_per_m()
    robots = [
        {
            "id": f"r{k}",
            "model": "car",
            "pose": [4, y, 0],
            "finish": {"circle": {"center": [14, y], "radius": 1.0}},
        }
        for k, y in enumerate((4.0, 16.0))
    ]
    scene = yard(goals=[], robots=robots)
    assert 17.8 <= lower_bound_J(scene) / joules <= 18.0
    assert makespan_bound_s(scene) > 9.0 / scene.robots[0].model.top_speed_m_s
    robots[1]["finish"] = "start"
    assert 8.9 <= lower_bound_J(yard(goals=[], robots=robots)) / joules <= 9.0


@pytest.mark.parametrize("shift_m", [0.0, 0.03, 0.06, 0.09])
def test_gaps_a_little_too_narrow_are_closed_wherever_cells_lie(
    yard: Yard, shift_m: float
) -> None:
    """A wall of two boxes, cornerwise; the way round it leads along the far bound."""
    scene = yard(
        obstacles=[
            {"id": "a", "box": {"center": [14 + shift_m, 4.45], "size": [1, 9]}},
            {"id": "b", "box": {"center": [15.9 + shift_m, 11.0], "size": [1, 4.4]}},
        ]
    )
    gap_m = math.hypot(15.4 - 14.5, 8.95 - 8.8)
    model = scene.robots[0].model
    assert 0.8 < gap_m < 2.0 * passing_radius_m(model)
    joules = scene.robots[0].model.energy_model.plain_ground_J_per_m()
    corner = np.array([15.9 + shift_m, 13.2 + model.inscribed_radius_m])
    way_m = math.dist((4, 10), corner) + math.dist(corner, (26, 10)) - 1.5
    assert lower_bound_J(scene) / joules == pytest.approx(way_m, rel=0.04)


@pytest.mark.parametrize("regeneration", [0.0, 0.7])
def test_plans_over_hills_cost_no_less_than_the_bound(
    yard: Yard, regeneration: float
) -> None:
    """Down from a hill through a hollow, where much is to be had for nothing."""
    hills = [
        {"center": [5, 10], "height": 1.0, "radius": 9},
        {"center": [22, 10], "height": -0.8, "radius": 7},
    ]
    scene = yard(elevation={"hills": hills})
    model = replace(scene.robots[0].model, regeneration_efficiency=regeneration)
    scene = replace(scene, robots=(replace(scene.robots[0], model=model),))
    bound_J = lower_bound_J(scene)
    result = plan_mission(scene, seed=1)
    assert result.plan is not None
    assert 0.0 <= bound_J <= result.plan.cost_J


def test_a_start_inside_the_goal_costs_nothing(yard: Yard) -> None:
    goal = {"id": "g", "circle": {"center": [4.5, 10], "radius": 1.5}}
    assert lower_bound_J(yard(goals=[goal])) == 0.0


def test_a_goal_beyond_the_battery_has_an_infinite_bound(yard: Yard) -> None:
    assert lower_bound_J(yard(battery={"capacity_m": 12})) == math.inf
    assert lower_bound_J(yard(battery={"capacity_m": 30})) < math.inf


@pytest.mark.parametrize("turned", [False, True])
def test_moving_a_scene_changes_little(yard: Yard, turned: bool) -> None:
    """Moved by a fraction of a cell, or turned by a quarter."""

    def place(x: float, y: float) -> list[float]:
        return [20.0 - y, x] if turned else [x + 100.13, y - 50.07]

    def moved_yard(place: Callable[[float, float], list[float]]) -> Scene:
        low, high = np.array([place(0, 0), place(30, 20)])
        mud = [(9, 4), (17, 4), (17, 16), (9, 16)]
        rock = [(17, 6), (20, 8), (19, 13), (16, 12)]
        low, high = np.minimum(low, high), np.maximum(low, high)
        return yard(
            bounds=[*low.tolist(), *high.tolist()],
            terrain=[
                {"id": "m", "polygon": [place(*p) for p in mud], "multiplier": 2.0}
            ],
            obstacles=[{"id": "o", "polygon": [place(*p) for p in rock], "height": 1}],
            goals=[{"id": "g", "circle": {"center": place(26, 10), "radius": 1.5}}],
            robots=[
                {
                    "id": "r1",
                    "model": "car",
                    "pose": [*place(4, 10), math.pi / 2 if turned else 0.0],
                }
            ],
        )

    here = lower_bound_J(moved_yard(lambda x, y: [x, y]))
    there = lower_bound_J(moved_yard(place))
    assert there == pytest.approx(here, rel=DISCRETISATION)


@pytest.mark.parametrize("seed", range(3))
def test_no_plan_of_the_quickstart_undercuts_the_bound(seed: int) -> None:
    scene = load_scene(str(SCENES / "quickstart.yaml"))
    plan = plan_mission(scene, seed=seed).plan
    assert plan is not None
    assert 0.5 * plan.cost_J <= lower_bound_J(scene) <= plan.cost_J


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "scene1",
        "scene5",
        *(pytest.param(f"scene{i}", marks=pytest.mark.ci) for i in (2, 3, 4, 6)),
    ],
)
def test_no_plan_of_a_shipped_scene_undercuts_the_bound(name: str) -> None:
    scene = load_scene(str(SCENES / f"{name}.yaml"))
    bound = lower_bound_J(scene)
    plans = [plan_mission(scene, seed=seed).plan for seed in range(3)]
    costs = [plan.cost_J for plan in plans if plan is not None]
    assert costs
    assert 0.4 * min(costs) <= bound <= min(costs)
