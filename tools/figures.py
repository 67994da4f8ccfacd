"""Draw the paper's Figures 1-4 and Table I from files of `tools/bench --output`.

Figure 1: a problem. Figure 2: the method on that problem, namely roadmap, tours and
motion tree. Figure 3: the scenes. Figure 4: the time to the first plan by scene and by
number of robots. Table I: medians over the seeds. `captions.md` holds a caption for
each, with the conditions they were measured under.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from bench_figure import HEAD, draw_runtimes, table_rows
from bench_record import BenchRow, read_rows
from insight import look_inside
from method_figure import draw_method
from problem_figure import draw_problem, draw_problems

import mrmg
from mrmg import storage
from mrmg.errors import MrmgError
from mrmg.planning import profile_params


def main() -> int:
    """Draw the figures; return the exit code of what went wrong."""
    options = parse_options()
    try:
        rows = read_rows(options.bench)
        for path in (*draw_figures(rows, options), *write_texts(rows, options)):
            print(path)
    except MrmgError as error:
        print(f"tools/figures: {error}", file=sys.stderr)
        return int(error.exit_code)
    return 0


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/figures",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bench", nargs="+", type=Path, metavar="BENCH.jsonl")
    parser.add_argument(
        "-o", "--out", type=Path, default=Path("figures"), help="default figures"
    )
    parser.add_argument("--format", default="pdf", choices=("pdf", "svg", "png"))
    parser.add_argument("--problem", metavar="SCENE", help="default: the bench's first")
    parser.add_argument("--seed", type=int, default=0, help="of Figure 2; default 0")
    return parser.parse_args()


def draw_figures(rows: Sequence[BenchRow], options: argparse.Namespace) -> list[Path]:
    """Draw all figures; return their files."""
    files = [options.out / f"figure{number}.{options.format}" for number in range(1, 5)]
    sources = list(dict.fromkeys(row.source for row in rows))
    problem = mrmg.load_scene(options.problem or sources[0])
    draw_problem(problem, files[0])
    inside = look_inside(problem, seed=options.seed, params=profile_params("paper"))
    draw_method(
        problem,
        roadmap=inside.roadmap,
        multiplier=inside.multiplier,
        tours=inside.tours,
        tree=inside.tree,
        paths={item.robot: item.state[:, :2] for item in inside.trajectories},
        path=files[1],
    )
    draw_problems([mrmg.load_scene(source) for source in distinct_maps(rows)], files[2])
    draw_runtimes(rows, files[3])
    return files


def distinct_maps(rows: Sequence[BenchRow]) -> list[str]:
    """Return the sources of the scenes; of one map with several fleets, the first."""
    first: dict[str, str] = {}
    for row in rows:
        first.setdefault(row.family, row.source)
    return list(first.values())


def write_texts(rows: Sequence[BenchRow], options: argparse.Namespace) -> list[Path]:
    """Write captions and Table I; return their files."""
    table = table_rows(rows)
    captions, tex = options.out / "captions.md", options.out / "table1.tex"
    storage.write_text(captions, captions_text(rows, table))
    storage.write_text(tex, tex_table(table))
    return [captions, tex]


def captions_text(rows: Sequence[BenchRow], table: Sequence[Sequence[str]]) -> str:
    """Return the captions, with how the figures were measured, and Table I."""
    seeds = sorted({row.seed for row in rows})
    profiles = ", ".join(dict.fromkeys(row.profile for row in rows))
    measured = "\n".join(f"- {text}" for text in sorted({r.conditions for r in rows}))
    return f"""\
**Figure 1.** A problem: robots at their starts, goals, recharging stations, obstacles,
and areas of terrain on which driving takes a multiple of the energy.

**Figure 2.** The method: (a) the roadmap, its edges the darker the more energy they
take per metre; (b) the tours of the discrete solver, along the roadmap; (c) the edges
of the motion tree and the plan it found (wide); profile paper.

**Figure 3.** The scenes.

**Figure 4.** Time to the first plan, by scene and by number of robots: quartiles, and
the 5th and 95th percentile.

**Table I.** Medians over the runs. Init: until the roadmap is built. Solver: share of
the discrete solver in the total time, within motion trees too. Plans: times the fleet
was driven along tours without a motion tree. Iterations: expansions of motion trees;
where not all runs grew one, median and number of those that did. Timeouts: runs without
a verified plan.

{markdown_table(table)}

Measured by `tools/bench` (one process, one thread, warm; wall-clock): {len(rows)} runs,
seeds {seeds[0]}-{seeds[-1]}, profiles {profiles}.

{measured}
"""


def markdown_table(lines: Sequence[Sequence[str]]) -> str:
    """Return Table I as Markdown."""
    rule = ["---"] * len(HEAD)
    return "\n".join(f"| {' | '.join(line)} |" for line in (HEAD, rule, *lines))


def tex_table(lines: Sequence[Sequence[str]]) -> str:
    """Return Table I as a LaTeX tabular (package booktabs)."""

    def row(cells: Sequence[str]) -> str:
        escaped = (cell.replace("_", r"\_").replace("%", r"\%") for cell in cells)
        return " & ".join(escaped) + r" \\"

    body = "\n".join(row(line) for line in lines)
    return (
        f"\\begin{{tabular}}{{l{'r' * 5}l{'r' * 7}}}\n\\toprule\n{row(HEAD)}\n"
        f"\\midrule\n{body}\n\\bottomrule\n\\end{{tabular}}\n"
    )


if __name__ == "__main__":
    sys.exit(main())
