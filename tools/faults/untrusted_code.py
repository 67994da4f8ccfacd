"""Code in files, none of which may run without --trust-code."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from faults.commands import Outcome
from faults.corpus import XACRO
from faults.inputs import EVIL, files, model
from faults.mutations import claimed_array, zipped
from faults.named import Case


def untrusted_code(runs: Path) -> Mapping[str, Case]:
    """Return cases by name, some of them in copies of finished runs."""
    return {
        **_in_arguments(runs),
        **_in_files(runs),
        "motion of a model": Case(write=_own_motion, check=_nothing_ran),
        "motion of a model, trusted": Case(
            write=lambda place: (*_own_motion(place), "--trust-code"),
            codes=(0, 3),
            leaves=True,
            check=_it_ran,
        ),
    }


def _in_arguments(runs: Path) -> Mapping[str, Case]:
    cases = {}
    for name in ("planner", "router", "controller"):
        for value in ("evil:plan", "evil.py:plan", "evil.py", "os:getcwd"):
            record = json.loads((runs / "run" / "run.json").read_text())
            record["arguments"][name] = value
            changed = {
                "run/run.json": json.dumps(record),
                "evil.py": EVIL,
                "run/evil.py": EVIL,
            }
            for command in ("report run", "execute run --overwrite", "verify run"):
                cases[f"{command}: {name} {value} in run.json"] = Case(
                    write=files(changed, command, runs),
                    codes=(0, 2, 3, 6),
                    check=_nothing_ran,
                )
            key = f"{name}s: [{value!r}]"
            campaign = {"c.yaml": f"scenes: [quickstart]\n{key}\n", "evil.py": EVIL}
            cases[f"campaign: {key}"] = Case(
                write=files(campaign, "campaign c.yaml"),
                codes=(2, 3),
                check=_nothing_ran,
            )
    return cases


def _in_files(runs: Path) -> Mapping[str, Case]:
    tag = "!!python/object/apply:builtins.open [ran, w]"
    tagged = f"format: {tag}\nscenes: {tag}\nimage: {tag}\n"
    expression = "${__import__('pathlib').Path('ran').touch()}"
    xacro = XACRO.replace('mass value="40"', f'mass value="{expression}"')
    array = claimed_array("(1,)", "|O", pickle.dumps([_Touch()]))
    pickled = {"run/plan.npz": zipped({"r1.state.npy": array})}
    writes = {
        f"a tag of Python in {file}": files({file: tagged}, command)
        for file, command in (
            ("s.yaml", "scene check s.yaml"),
            ("m.yaml", "scene import m.yaml -o o.yaml"),
            ("c.yaml", "campaign c.yaml"),
        )
    } | {
        "an expression of xacro": files(
            {"a.xacro": xacro}, "robot import a.xacro -o new"
        ),
        "a pickle in plan.npz": files(pickled, "verify run", runs),
    }
    return {
        name: Case(write=write, check=_nothing_ran) for name, write in writes.items()
    }


def _own_motion(place: Path) -> tuple[str, ...]:
    words = model(motion_model="evil.py")(place)
    (place / "mine" / "evil.py").write_text(EVIL)
    return words


class _Touch:
    def __reduce__(self) -> tuple[Any, ...]:
        return open, ("ran", "w")


def _nothing_ran(place: Path, outcome: Outcome) -> str:
    found = [*place.rglob("ran")]
    return f"code ran: {found[0].relative_to(place)}" if found else ""


def _it_ran(place: Path, outcome: Outcome) -> str:
    return "" if [*place.rglob("ran")] else "did not run though trusted"
