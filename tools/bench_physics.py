"""Hold the physics to its figures: energy, tracking, speed of simulation, yaw rates.

Every scene is planned, verified, driven in MuJoCo and audited once per seed, with the
default controller, each mission in one process and one thread. Per robot, metered (the
energy model over the driven motion) and measured (the work of the drives) are compared
with planned energy. Speeds are simulated time over time of the process on its
processor, from the building of the world to the log, and over the time on the clock,
which other processes stretch; the former is judged. Controllers are set up and kernels
compiled before anything is timed. The first mission is driven again, and must give the
same log. Every circle of the second table is driven alone on plain ground.

With --disturb, scenes 1 and 4 are planned with ten seeds, and the trials are spread
evenly over these plans: under the default disturbances, and, with replanning, with the
rolling resistance raised by 30 % besides. As plans leave a margin of charge that
carries even that, the same is asked of plans without it (`--soc-margin 0`), and there
what replanning gains, over both scenes together. A trial is feasible when all goals are
visited without contact and no battery falls below its reserve. One trial is driven
again in this process, and must give the same log.

Missions are kept in the file --output and trials in the folder --runs: the same command
goes on from there after an interruption. What was made with other sources, models,
scenes, versions or on another processor is not used. The last table names each figure,
what was found and what is required: PASS or FAIL; the exit code is 1 if any fails.

Rows of --json: `scene`, `robots`, `feasible` of `missions`, errors `metered_pct_...`
and `measured_pct_...` (`median`, `worst`), `rms_m_worst`, `max_m_worst`,
`x_real_processor`, `x_real_clock`, `control_ms_median`, `control_ms_p99_worst`,
`faults`. `yaw` has the circles: `robot`, `turn`, `unit`, `speeds_m_s`, `errors_pct`,
`worst_pct`. `disturbances` has the trials: `scene`, `plans`, `disturb`, `replan`,
`feasible` of `trials`, `interval_95`, `charge_worst`, `charge_median`, `failures` by
cause, `least` share that must be feasible. `figures` has the last table: `what`,
`found`, `asked`, `holds`, `value`, `limit`.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from physics.figures import Figure, print_figures
from physics.missions import mission_figures
from physics.trials import TrialOptions, disturbance_figures
from physics.yaw import yaw_figures
from protocol import (
    Row,
    Trials,
    add_file_options,
    run,
    seed_range,
    state,
    versions,
    write_document,
)

from mrmg import shipped


def main() -> int:
    """Run the bench; return 1 if a figure fails."""
    options = parse_options()
    seeds = f"seeds {options.seeds.start}-{options.seeds.stop - 1}"
    print(f"{__doc__}\n{seeds}; {versions()}; state {state()}", flush=True)
    parts: list[tuple[list[Figure], list[Row]]] = [([], []), ([], []), ([], [])]
    if options.scenes:
        finished = Trials(options.output)
        parts[0] = mission_figures(
            options.scenes, options.seeds, finished, options.workers
        )
    if not options.no_yaw:
        parts[1] = yaw_figures()
    if options.disturb:
        trials = TrialOptions(
            trials=options.trials,
            plan_seeds=options.plan_seeds,
            workers=options.workers,
            runs=options.runs,
        )
        parts[2] = disturbance_figures(trials)
    figures = [figure for found, _ in parts for figure in found]
    print_figures(figures)
    ok = all(figure.holds for figure in figures)
    (_, rows), (_, yaw), (_, disturbances) = parts
    write_document(
        options,
        "bench_physics",
        rows,
        ok,
        yaw=yaw,
        disturbances=disturbances,
        figures=list(map(asdict, figures)),
    )
    return 0 if ok else 1


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/bench_physics",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--scenes", nargs="*", default=shipped.scene_names(), metavar="SCENE"
    )
    parser.add_argument(
        "--seeds", type=seed_range, default="0-9", help="first-last, default 0-9"
    )
    add_file_options(parser)
    parser.add_argument("--no-yaw", action="store_true", help="leave out yaw rates")
    parser.add_argument("--disturb", action="store_true", help="robustness, too")
    parser.add_argument("--trials", type=int, default=100, help="of each row of it")
    parser.add_argument(
        "--plan-seeds", type=seed_range, default="0-9", help="of the plans in it"
    )
    parser.add_argument(
        "--runs",
        type=Path,
        default=Path("runs/bench_physics"),
        help="folder of the trials, default runs/bench_physics",
    )
    parser.add_argument(
        "--workers",
        type=int,
        default=1,
        help="processes that make missions and trials, default 1",
    )
    options = parser.parse_args()
    if options.trials < len(options.plan_seeds):
        parser.error("--trials must not be fewer than the plans of --plan-seeds")
    return options


if __name__ == "__main__":
    run(main)
