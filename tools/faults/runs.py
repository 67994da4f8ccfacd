"""Finished runs of one small scene, whose files are damaged or filled with markup."""

from __future__ import annotations

from pathlib import Path

from faults.commands import run_process

FIRST_RUN_S = 900.0
"""Time for a run that may compile kernels first."""

SITE = """format: 1
name: site
objective: makespan
bounds: [0, 0, 24, 16]
stations: [{id: s1, circle: {center: [12, 13], radius: 1.5}}]
robots:
  - {id: r1, model: car, pose: [3, 4, 0]}
  - {id: r2, model: diffdrive, pose: [3, 12, 0]}
goals:
  - {id: g1, circle: {center: [18, 4], radius: 1}}
  - {id: g2, circle: {center: [18, 12], radius: 1}}
"""


def make_runs(folder: Path) -> None:
    """Make a run with trials, and another one of the same plan in which a robot fails.

    They are `run` and `other` in a folder that must not exist yet.
    """
    folder.mkdir(parents=True)
    (folder / "site.yaml").write_text(SITE)
    run_command(folder, "run site.yaml --no-video --out run")
    run_command(folder, "robustness run --trials 2")
    run_command(folder, "execute run --fault r1@2s --replan --out other")


def run_command(folder: Path, command: str) -> None:
    """Run a command in a folder; it must succeed, or leave a mission unfinished."""
    made = run_process(folder, command.split(), longest_s=FIRST_RUN_S)
    if made.code not in (0, 6):
        raise RuntimeError(f"mrmg {command}: {made.err}")
