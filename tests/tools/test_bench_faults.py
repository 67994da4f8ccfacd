"""The bench of faults: its damage is seeded, and it sees what it is to see."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from faults import plans
from faults.commands import MOST_BYTES, Outcome
from faults.damage import DAMAGES
from faults.mutations import mutated, zipped
from faults.rows import Options
from protocol import Trials

from mrmg import storage

FILES = {
    "a.yaml": b"format: 1\nbounds: [0, 0, 20, 10]\ngoals: [{id: g1, radius: 1.5}]\n",
    "a.json": b'{"format": 1, "rows": [{"a": 1.5, "b": "x"}, {"a": 2.5}]}',
    "a.npz": storage.array_bytes(
        {"a": np.arange(6.0).reshape(2, 3), "b": np.arange(3)}
    ),
    "a.zip": zipped({"a.json": b'{"a": [1, 2]}', "b.yaml": b"a: 1\n"}),
    "a.txt": b"[SCALE]\n1\n[BORDER]\n0 0\n9 0\n9 9\n",
    "a.tif": bytes(range(256)),
}


@pytest.mark.parametrize("name", FILES)
def test_equal_seeds_damage_equally_and_others_otherwise(name: str) -> None:
    def damaged(seed: int) -> bytes:
        return mutated(name, FILES[name], Random(seed))

    assert [damaged(seed) for seed in range(30)] == [damaged(n) for n in range(30)]
    found = {damaged(seed) for seed in range(30)}
    assert len(found) > 20
    assert len(found - {FILES[name]}) >= len(found) - 1


@pytest.mark.parametrize(
    ("outcome", "fault"),
    [
        ({"code": 3, "err": "mrmg: a.yaml: 1 fault\n  bounds: got 1\n"}, ""),
        ({"code": 0, "out": "valid\n"}, ""),
        ({"code": 0, "err": "mrmg: a note\nmrmg: another one\n"}, ""),
        ({"code": 4, "out": "infeasible: goal g1\n"}, ""),
        ({"code": 2, "err": "mrmg run: no\nusage: mrmg run SCENE; more\n"}, ""),
        ({"code": 1, "trace": "Traceback\nValueError: x"}, "traceback: ValueError: x"),
        ({"code": 1, "err": "Traceback (most recent call last):\nx"}, "traceback: x"),
        ({"code": None}, "hang: it did not end"),
        ({"code": 0, "cpu_s": 5.1}, "hang: took 5.1 s of the processor"),
        ({"code": 0, "peak_bytes": MOST_BYTES + 1}, "memory: 1000 MB"),
        ({"code": 1}, "exit code 1 is none of the documented ones"),
        ({"code": 3}, "message: none with exit code 3"),
        ({"code": 3, "err": "mrmg: a\nmrmg: b\n"}, "message: 2 of them: mrmg: b"),
        ({"code": 3, "err": "a.py:3: Warning\n"}, "message: a line of another kind"),
        ({"code": 3, "err": "mrmg: \x1b[31m\n"}, "message: control characters"),
        ({"code": 3, "err": f"mrmg: {'x' * 600}\n"}, "message: a line of 606 char"),
    ],
)
def test_the_end_of_a_command_is_judged(outcome: dict[str, Any], fault: str) -> None:
    found = Outcome(**outcome).fault()
    assert found.startswith(fault) if fault else not found


@pytest.mark.slow
def test_every_damage_of_a_plan_is_done_and_caught(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some need a robot that turns on the spot, others a car with a station."""
    monkeypatch.setattr(plans, "SCENES", ("quickstart", "mixed"))
    options = Options(
        seed=1,
        files=0,
        plans=len(DAMAGES),
        kills=0,
        missions=0,
        work=tmp_path,
        keep=None,
        trials=Trials(None),
    )
    found = list(plans.rows(options))
    assert sum(row["cases"] for row in found) == len(DAMAGES)
    assert [row["failures"] for row in found] == [[]] * len(found)
