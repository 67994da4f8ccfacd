"""Driving a plan in MuJoCo: the loop of clock, controllers, drive and physics."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from mrmg.errors import require_known, require_types
from mrmg.mujoco_import import mujoco
from mrmg.plans import Plan
from mrmg.scene.loading.mjcf import no_warning_file
from mrmg.scene.types import Scene
from mrmg.simulation.actuation import Actuation
from mrmg.simulation.contacts import ContactWatch
from mrmg.simulation.controller import Controller, controller_maker
from mrmg.simulation.controller_calls import ControllerCalls
from mrmg.simulation.disturbance import Disturbance, DisturbanceRanges
from mrmg.simulation.disturbed_world import disturb_world, move_starts
from mrmg.simulation.drive import drive_control
from mrmg.simulation.ending import Ending
from mrmg.simulation.fleet import Fleet
from mrmg.simulation.fleet_clock import FleetClock
from mrmg.simulation.ground import (
    Ground,
    TerrainUnderfoot,
    believed_resistance,
)
from mrmg.simulation.log import ExecutionLog, package_versions, require_executable
from mrmg.simulation.plants import DEFAULT_PLANT, PLANTS, plant_of
from mrmg.simulation.recording import Recording
from mrmg.simulation.reference import FleetReference, speed_states
from mrmg.simulation.sensing import sensing_of
from mrmg.simulation.set_points import SetPoints
from mrmg.simulation.slopes import SlopesUnderfoot
from mrmg.simulation.supervision import Event, Observation, Orders, Supervisor
from mrmg.simulation.world_model import MujocoWorld, build_world
from mrmg.world.terrain import multiplier_at

STEPS_PER_TICK = 5
"""Physics steps for which a drive force is held: 20 ms, a fifth of a plan's step."""

TICKS_PER_CORRECTION = 2
"""Ticks between two calls of the tracking controllers: 25 Hz."""

_SETTLING_STEPS = 50
_PROGRESS_TICKS = 50

Progress = Callable[[float, str], None]


def simulate(
    scene: Scene,
    plan: Plan,
    *,
    controller: str = "mpc",
    disturbance: Disturbance | None = None,
    plant: str = DEFAULT_PLANT,
    supervisor: Supervisor | None = None,
    on_progress: Progress | None = None,
) -> ExecutionLog:
    """Drive `plan` in the MuJoCo world of `scene` until the fleet is at rest.

    Equal arguments give equal logs, timing apart. The run ends early, with `completed`
    False, when a robot is more than 2 m from its reference, when the physics diverge,
    or when the fleet does not get on.

    Args:
        scene: the scene the plan was made for.
        plan: what to drive.
        controller: name of the tracking controller.
        disturbance: how the robots differ from their models; None if they do not.
        plant: of `PLANTS`: what the ground takes from the tyres.
        supervisor: watches every tick and may give the fleet another plan; the log is
            then of the plan in force at the end, which begins with those before.
        on_progress: called with the fraction done and a text.

    Raises:
        UsageError: if the controller or the plant is unknown, or a robot is of a kind
            that cannot be executed, the plan is malformed, or the disturbance is none
            of this fleet.
        IdentityError: if the plan is of another scene.
        FileError: if a robot's MJCF cannot be used, or MuJoCo cannot hold the scene.
    """
    require_executable(scene, plan)
    maker = controller_maker(controller)
    require_known("plant", plant, PLANTS)
    if disturbance is not None:
        require_types((disturbance, Disturbance))
        disturbance.require_fleet(scene)
    controllers = [maker(robot.model) for robot in scene.robots]
    world = build_world(scene, drawn=False)
    run = _Run(world, plan, controllers, disturbance, plant)
    started, watched_s = time.perf_counter(), 0.0
    with no_warning_file():
        while not run.ended():
            run.tick()
            if supervisor is not None:
                watching = time.perf_counter()
                orders = supervisor.watch(run.observation())
                watched_s += time.perf_counter() - watching
                if orders is not None:
                    run.obey(orders)
            if on_progress is not None and run.ticks % _PROGRESS_TICKS == 0:
                on_progress(run.fraction(), f"driven {run.data.time:.0f} s")
    events = () if supervisor is None else supervisor.events
    # What a supervisor thinks about, new plans above all, is no part of driving.
    return run.log(controller, events, time.perf_counter() - started - watched_s)


class _Run:
    """One simulation in progress."""

    def __init__(
        self,
        world: MujocoWorld,
        plan: Plan,
        controllers: list[Controller],
        disturbance: Disturbance | None,
        plant: str,
    ) -> None:
        self.ticks, self._plant_name = 0, plant
        self._disturbance = disturbance
        if disturbance is None:
            robots = [robot.id for robot in world.scene.robots]
            disturbance = DisturbanceRanges().draw(0, robots)
        else:
            disturb_world(world, disturbance)
        self.data = mujoco.MjData(world.model)
        move_starts(world, self.data, disturbance)
        self._world, self._plan = world, plan
        self._period_s = STEPS_PER_TICK * world.model.opt.timestep
        self._reference = FleetReference(world.scene, plan)
        self._is_speed = speed_states(world.scene)
        self._clock = FleetClock(self._is_speed[:, 4])
        self._set_points = SetPoints(world.scene, self._reference, controllers)
        self._drive = drive_control(world.scene)
        self._believed = believed_resistance(world.scene)
        self._contacts = ContactWatch(world)
        self._look = partial(self._contacts.look, self.data)
        self._recording = Recording()
        self._calls = ControllerCalls(len(world.scene.robots))
        self._ending = Ending(self.data, self._is_speed)
        self._fleet = Fleet(world, self.data)
        self._plant = plant_of(plant, world, self.data, self._fleet, disturbance)
        self._slopes_underfoot = SlopesUnderfoot(world.scene)
        self._terrain = TerrainUnderfoot(world.scene)
        self._sensing = sensing_of(world.scene, disturbance, self._period_s)
        steer = self._set_points.following[:, 1]
        self._actuation = Actuation(disturbance, steer, self._period_s)
        self._coming = self._reference.at(0.0)
        self._settle()
        self._observe()
        self._record()

    def tick(self) -> None:
        """Advance the simulation by one control period."""
        self._command()
        now, following = self._set_points.now, self._set_points.following
        steer, period_s = following[:, 1], self._period_s
        seen, true = self._sensing.state, self._state
        level, slope = self._slopes
        if seen is not true:
            level, slope = self._slopes_underfoot.under(seen)
        ground = seen_ground = self._ground(seen, steer)
        believed = self._believed.force_N(ground)
        wanted = self._drive.force(
            self._sensing.axle_speed_m_s,
            now[:, 0],
            following[:, 0],
            level * believed,
            slope,
            period_s,
        )
        force = self._actuation.force_N(wanted)
        steer_from, steer_to = self._actuation.steer(now[:, 1], steer)
        if self._disturbance is not None:
            ground = self._ground(true, steer_to)
            level, _ = self._slopes
        self._plant.resist(ground, level)
        self._fleet.drive(
            force,
            steer_from,
            steer_to,
            STEPS_PER_TICK,
            seen_ground.turning_multiplier,
            on_step=self._look,
        )
        self._clock.advance(self._period_s)
        self.ticks += 1
        self._observe()
        # A state that is no number ends the run; the log keeps what came before it.
        if self._sound:
            self._recording.add(force_N=force)
            self._record()

    def ended(self) -> bool:
        """Return whether the fleet is at rest after its plan, or is past helping."""
        return self._completed() or bool(self._trouble())

    def observation(self) -> Observation:
        """Return what a supervisor sees."""
        return Observation(
            time_s=float(self.data.time),
            clock_s=self._clock_s(),
            rate=self._clock.rate,
            stalled_s=self._ending.stalled_s,
            state=self._sensing.state,
            planned=self._planned,
            work_J=self._fleet.work.work_J,
            ended=self._completed(),
        )

    def obey(self, orders: Orders) -> None:
        """Go on by another plan."""
        self._plan = orders.plan
        self._reference = FleetReference(self._world.scene, orders.plan)
        self._set_points.follow(self._reference)
        self._clock.time_s = orders.clock_s
        self._ending.restart()
        self._planned = self._reference.at(orders.clock_s)

    def fraction(self) -> float:
        """Return the share of the plan's time that is done."""
        duration_s = max(self._reference.duration_s, self._period_s)
        return float(min(self._clock.time_s / duration_s, 1.0))

    def log(
        self, controller: str, events: tuple[Event, ...], wall_s: float
    ) -> ExecutionLog:
        """Return everything recorded."""
        scene, recording = self._world.scene, self._recording
        robots = len(scene.robots)
        state = recording.by_robot("state", robots)
        force_N = recording.by_robot("force_N", robots)
        work_J = self._fleet.work.work_J()[: force_N.shape[1]]
        return ExecutionLog(
            scene_digest=scene.digest,
            plan_digest=self._plan.digest,
            model_digest=self._world.digest,
            controller=controller,
            control_period_s=self._period_s,
            completed=self._completed(),
            gave_up="" if self._completed() else self._trouble(),
            disturbance=self._disturbance,
            plant=self._plant_name,
            bounded_solves=tuple(self._calls.bounded_solves),
            robots=tuple(robot.id for robot in scene.robots),
            motions=tuple(robot.model.motion_name for robot in scene.robots),
            versions=package_versions(),
            time_s=recording.in_time("time_s"),
            clock_s=recording.in_time("clock_s"),
            state=state,
            reference=recording.by_robot("reference", robots),
            command=recording.by_robot("command", robots),
            multiplier=np.stack([multiplier_at(scene, way) for way in state[..., :2]]),
            force_N=force_N,
            work_J=np.ascontiguousarray(work_J.swapaxes(0, 1)),
            balance_J=self._fleet.work.balance_J() if self._sound else None,
            qpos=recording.in_time("qpos"),
            contacts=tuple(self._contacts.contacts),
            events=events,
            timing={
                "wall_s": wall_s,
                "realtime_factor": self.data.time / wall_s,
                "controller_ms": self._calls.milliseconds(),
            },
        )

    def _settle(self) -> None:
        """Let the tyres take the weight, then start the time."""
        still = np.zeros(len(self._world.scene.robots))
        _, slope = self._slopes_underfoot.under(self._fleet.state())
        parked = self._drive.force(still, still, still, still, slope, self._period_s)
        self._fleet.drive(parked, still, still, _SETTLING_STEPS)
        self.data.time = 0.0
        self._fleet.work.restart()

    def _command(self) -> None:
        """Set the clock's pace and the ramps of the coming tick."""
        if self._ending.finished_s < np.inf:
            self._set_points.brake(self._period_s)
            return
        clock = self._clock
        clock.pace(self._sensing.state, self._planned, self._period_s)
        if self.ticks % TICKS_PER_CORRECTION == 0:
            self._set_points.correct(
                self._sensing.state, clock.time_s, clock.rate, self._calls
            )
        self._coming = self._reference.at(clock.time_s + clock.rate * self._period_s)
        self._set_points.advance(
            self._sensing.axle_speed_m_s,
            self._planned,
            self._coming,
            clock.rate,
            self._period_s,
        )

    def _ground(self, state: np.ndarray, steer: np.ndarray) -> Ground:
        """Return terrain and steering in the middle of the coming tick.

        Args:
            state: true or seen, shape (R, 5).
            steer: at the end of the tick, shape (R,).
        """
        x, y, heading, speed, steer_now = state.T
        way_m = 0.5 * self._period_s * speed
        x_m, y_m = x + way_m * np.cos(heading), y + way_m * np.sin(heading)
        multiplier, turning_multiplier = self._terrain.under(x_m, y_m)
        return Ground(multiplier, 0.5 * (steer_now + steer), turning_multiplier)

    def _observe(self) -> None:
        self._state = self._fleet.state()
        self._slopes = self._slopes_underfoot.under(self._state)
        over_map = self._slopes[0] * self._fleet.axle_speed_m_s()
        self._sensing.look(self._state, over_map, self._set_points.following[:, 0])
        self._planned = self._coming
        self._sound = bool(np.isfinite(self._state.sum() + self._planned.sum()))
        over = self._clock.time_s >= self._reference.duration_s - 1e-9
        self._ending.look(plan_is_over=over, rate=self._clock.rate)

    def _record(self) -> None:
        self._recording.add(
            time_s=self.data.time,
            clock_s=self._clock_s(),
            state=self._state,
            reference=self._planned,
            command=self._set_points.following,
            qpos=self.data.qpos,
        )

    def _clock_s(self) -> float:
        return min(self._clock.time_s, self._reference.duration_s)

    def _completed(self) -> bool:
        return self._ending.is_done(self._state)

    def _trouble(self) -> str:
        return self._ending.trouble(self._state, self._planned, sound=self._sound)
