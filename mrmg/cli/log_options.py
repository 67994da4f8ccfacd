"""The options of `mrmg calibrate` that name logs and what they were driven on."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg.errors import UsageError

EPILOG = """\
columns of a log (CSV with a line of names; commas, semicolons or tabs between values,
points in numbers; time increasing):
  time                      s
  velL, velR                m/s, at the wheels of each side
  or v, yaw_rate            m/s, rad/s
  power                     W, drawn from the battery
  or current, voltage       A, V; or curL, curR, voltL, voltR of each side
  or curL, curR             A, with the motor constants of robot.yaml; or current
Case and underscores do not count, nor do other columns. A name may state another unit,
as time_ms or "v [km/h]" do: ms, us, ns; km/h, mph, cm/s, mm/s; deg/s; kW; mA; mV.
Gaps of a log (ten times as long as it usually takes to the next row) are left out.

Each --terrain is of the --log or --test files before it; the first one is the plain
ground of robot.yaml. Test files without --terrain are of the terrain whose logs, or
whose name, their folder has; of the only one, if there is one.
"""


@dataclass(slots=True)
class LogGroup:
    """Files named by one --log or --test.

    Attributes:
        tests: whether they are only predicted.
        files: as they were named.
        terrain: what they were driven on; None until it is named.
    """

    tests: bool
    files: list[str]
    terrain: str | None = None


class _Grouped(argparse.Action):
    """Begins a group of files, or names the terrain of the last one."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        groups = namespace.groups
        if option_string != "--terrain":
            group = LogGroup(option_string == "--test", list(values))
            namespace.groups = [*groups, group]
        elif groups and groups[-1].terrain is None:
            groups[-1].terrain = values
        else:
            parser.error("--terrain: name the files with --log or --test before it")


def add_logs(verb: argparse.ArgumentParser) -> None:
    """Add --log, --terrain and --test; `files_by_use` reads what they leave."""
    verb.set_defaults(groups=[])
    for flag, metavar, count, about in (
        ("--log", "FILE", "+", "logs to fit, all of one terrain; may be repeated"),
        ("--terrain", "NAME", None, "what the files before it were driven on"),
        ("--test", "FILE", "+", "logs to predict, not fitted"),
    ):
        verb.add_argument(
            flag,
            nargs=count,
            action=_Grouped,
            dest="groups",
            metavar=metavar,
            help=about,
        )


def files_by_use(
    groups: Sequence[LogGroup],
) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Return (file, terrain) of the logs to fit and of those to predict.

    Raises:
        UsageError: if a terrain is missing, or a file is named twice.
    """
    logs = [
        (file, _terrain_of_logs(group))
        for group in groups
        if not group.tests
        for file in group.files
    ]
    if not logs:
        raise UsageError("--test: name logs to fit, too: --log FILE... --terrain NAME")
    tests = [
        (file, group.terrain or _terrain_of_test(file, logs))
        for group in groups
        if group.tests
        for file in group.files
    ]
    seen: set[Path] = set()
    for file, _ in [*logs, *tests]:
        path = Path(file).resolve()
        if path in seen:
            raise UsageError(f"{file} is named twice; a log is fitted or tested, once")
        seen.add(path)
    return logs, tests


def _terrain_of_logs(group: LogGroup) -> str:
    if group.terrain is None:
        raise UsageError(
            f"--log {group.files[0]}: on what terrain? Add --terrain NAME after the "
            "files"
        )
    return group.terrain


def _terrain_of_test(file: str, logs: Sequence[tuple[str, str]]) -> str:
    terrains = {terrain for _, terrain in logs}
    folder = Path(file).resolve().parent
    same = {terrain for log, terrain in logs if Path(log).resolve().parent == folder}
    named = {terrain for terrain in terrains if terrain.lower() == folder.name.lower()}
    for found in (same, named, terrains):
        if len(found) == 1:
            return next(iter(found))
    raise UsageError(
        f"--test {file}: on what terrain? Add --terrain NAME after the files; fitted "
        f"are {', '.join(sorted(terrains))}"
    )
