"""The figures of a run on one page, for people and machines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mrmg
from mrmg.energy.audit_record import ENERGY_IMBALANCE, MODEL_MISMATCH, EnergyAudit
from mrmg.plans import Plan, PlanStatus
from mrmg.runs.folder import RunFolder
from mrmg.runs.summary_model import Summary
from mrmg.scene.margins import sentences_on_margins
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, log_in_force, require_same_mission
from mrmg.verification.verdict import Verdict


def summarize(scene: Scene, folder: Path) -> dict[str, Any]:
    """Return the summary of a run folder, as far as the run came.

    Args:
        scene: of the run.
        folder: holds `planning.json`, and what later steps have left.

    Raises:
        RunFolderError: if nothing was planned, a file cannot be read, or plan or log
            are of another scene.
    """
    run = RunFolder(folder)
    planning = run.read_json("planning.json", remedy="mrmg plan")
    solved = planning["status"] == PlanStatus.SOLVED.value
    plan = Plan.load(folder) if solved else None
    require_same_mission(scene, plan)
    if plan is None:
        seed = run.read_json("run.json", remedy="mrmg plan")["arguments"]["seed"]
        return summary_of(scene, planning, seed=seed)
    outcomes = outcomes_in(folder, scene)
    return summary_of(scene, planning, seed=plan.seed, plan=plan, **outcomes)


def outcomes_in(folder: Path, scene: Scene) -> dict[str, Any]:
    """Return what became of a folder's plan: verdict, log and audit.

    Those that were not reached are None.
    """
    log = log_in_force(folder, scene)
    judged = (folder / "verdict.json").exists()
    audited = log is not None and (folder / "audit.json").exists()
    return {
        "verdict": Verdict.load(folder) if judged else None,
        "log": log,
        "audit": EnergyAudit.load(folder) if audited else None,
    }


def summary_of(
    scene: Scene,
    planning: Mapping[str, Any],
    *,
    seed: int,
    plan: Plan | None = None,
    verdict: Verdict | None = None,
    log: ExecutionLog | None = None,
    audit: EnergyAudit | None = None,
) -> dict[str, Any]:
    """Return the summary of a mission; what was not reached is None.

    Args:
        scene: the problem.
        planning: how planning ended: `status` and `statistics` of the PlanResult.
        seed: of the planner.
        plan: None if none was found.
        verdict: None if the plan was not verified.
        log: None if the plan was not executed.
        audit: None if the execution was not audited.
    """
    figures = {
        "status": _status(audit) or planning["status"],
        "mission_ok": bool(verdict and verdict.ok and audit and audit.mission_ok),
        "scene": scene.name,
        "seed": seed,
        "robots": len(scene.robots),
        "goals": len(scene.goals),
        "stations": len(scene.stations),
        "hints": list(planning.get("hints", ())),
        "skipped_goals": [
            {"goal": goal, "proof": proof}
            for goal, proof in (plan.skipped if plan else {}).items()
        ],
        "plan": _plan_figures(scene, plan, planning["statistics"]) if plan else None,
        "verdict": _verdict_figures(verdict) if verdict else None,
        "execution": _execution_figures(log, audit) if log and audit else None,
        "energy": _energy_figures(audit) if audit else None,
        "versions": {
            "mrmg": mrmg.__version__,
            **(plan.versions if plan else {}),
            **(log.versions if log else {}),
        },
    }
    return Summary.model_validate(figures).model_dump(mode="json", exclude_unset=True)


def _status(audit: EnergyAudit | None) -> str:
    """Return what an audit found of the energy, which goes before all else; or ""."""
    causes = audit.causes if audit else ()
    found = {ENERGY_IMBALANCE: "energy_imbalance", MODEL_MISMATCH: "model_mismatch"}
    return next((status for cause, status in found.items() if cause in causes), "")


def _plan_figures(
    scene: Scene, plan: Plan, statistics: Mapping[str, Any]
) -> dict[str, Any]:
    limit_s = scene.time_limit_s
    times = ("init", "routing", "first_solution", "total")
    capped = ("iterations", "iteration_cap")
    return {
        "cost_J": plan.cost_J,
        "bound_J": statistics.get("bound_J"),
        "gap": statistics.get("gap"),
        "makespan_s": plan.makespan_s,
        "bound_s": statistics.get("bound_s"),
        "time_limit_s": limit_s if math.isfinite(limit_s) else None,
        "objective": {
            "name": scene.objective.name,
            "unit": scene.objective.unit,
            "energy_weight": scene.objective.energy_weight,
            "makespan_weight": scene.objective.makespan_weight,
            "value": scene.objective.value(plan.cost_J, plan.makespan_s),
            "bound": statistics.get("bound"),
        },
        "margins": {
            robot: {"obstacle_m": obstacle_m, "robot_m": robot_m}
            for robot, (obstacle_m, robot_m) in plan.margins.items()
        },
        "margins_kept": sentences_on_margins(scene.robots, plan.margins),
        "narrow_passages": plan.narrow,
        "improvements": list(statistics.get("improvements", [])),
        "path_following_plans": statistics.get(
            "path_following_plans",
            statistics.get("drafts", 0),  # runs of 0.1.0
        ),
        "vertices": statistics["vertices"],
        "groups": statistics["groups"],
        "router_calls": statistics["router_calls"],
        "time_s": {name: statistics["time_s"][name] for name in times},
        **{name: statistics[name] for name in capped if name in statistics},
    }


def _verdict_figures(verdict: Verdict) -> dict[str, Any]:
    return {
        "ok": verdict.ok,
        "min_obstacle_clearance_m": verdict.min_obstacle_clearance_m,
        "min_robot_distance_m": verdict.min_robot_distance_m,
        "violations": len(verdict.violations),
    }


def _execution_figures(log: ExecutionLog, audit: EnergyAudit) -> dict[str, Any]:
    controller_ms = log.timing["controller_ms"]
    squares = [robot.tracking_rms_m**2 for robot in audit.robots]
    return {
        "goals_visited": len(audit.goals_visited),
        "contacts": len(log.contacts),
        "gave_up": log.gave_up,
        "disturbance": log.disturbance,
        "realtime_factor": log.timing["realtime_factor"],
        "controller_ms": {
            **{name: controller_ms[name] for name in ("median", "p99")},
            **{name: controller_ms.get(name) for name in ("riccati", "qp")},
        },
        "bounded_solves": sum(log.bounded_solves),
        "tracking": {
            "rms_m": (sum(squares) / len(squares)) ** 0.5,
            "max_m": max(robot.tracking_max_m for robot in audit.robots),
        },
        "events": [asdict(event) for event in log.events],
        "replans": sum(event.action == "replan" for event in log.events),
    }


def _energy_figures(audit: EnergyAudit) -> dict[str, Any]:
    metered = [robot.metered_error_pct for robot in audit.robots]
    measured = [robot.measured_error_pct for robot in audit.robots]
    residuals = [robot.balance.residual_pct for robot in audit.robots if robot.balance]
    return {
        "planned_J": audit.planned.total_J(),
        "metered_J": audit.metered.total_J(),
        "measured_J": audit.measured.total_J(),
        "metered_error_pct": max(metered, key=abs),
        "measured_error_pct": max(measured, key=abs),
        "balance_residual_pct": max(residuals, key=abs, default=None),
        "min_charge_fraction": min(robot.min_charge_fraction for robot in audit.robots),
        "recharges": len(audit.recharges),
    }
