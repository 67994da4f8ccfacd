from __future__ import annotations

from pathlib import Path

import pytest

from mrmg.errors import RunFolderError
from mrmg.verification.verdict import Verdict, Violation, ViolationKind


def verdict_with(*kinds: ViolationKind) -> Verdict:
    violations = tuple(
        Violation(
            kind=kind,
            robot="r1",
            other="wall",
            time_s=0.1 + index,
            x_m=1 / 3,
            y_m=-2.0,
            amount=1e-17,
            message=f"r1: broke {kind.value}",
        )
        for index, kind in enumerate(kinds)
    )
    return Verdict(
        ok=not kinds,
        violations=violations,
        min_obstacle_clearance_m=0.1,
        min_robot_distance_m=None,
    )


@pytest.mark.parametrize("kinds", [(), tuple(ViolationKind)])
def test_verdict_survives_saving(
    kinds: tuple[ViolationKind, ...], tmp_path: Path
) -> None:
    verdict = verdict_with(*kinds)
    verdict.save(tmp_path)
    assert Verdict.load(tmp_path) == verdict


@pytest.mark.parametrize("kind", ViolationKind)
def test_rows_name_kind_and_unit(kind: ViolationKind) -> None:
    row = verdict_with(kind).violations[0].to_row()
    assert row["kind"] == kind.value
    assert row["unit"] in {"1", "SI", "m", "m^2", "rad", "s", "J"}


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"format": 99, "violations": []}']
)
def test_unreadable_verdict_names_the_cure(content: str, tmp_path: Path) -> None:
    (tmp_path / "verdict.json").write_text(content)
    with pytest.raises(RunFolderError, match="mrmg verify"):
        Verdict.load(tmp_path)


def test_missing_verdict_names_the_cure(tmp_path: Path) -> None:
    with pytest.raises(RunFolderError, match="mrmg verify"):
        Verdict.load(tmp_path)
