"""Robots with a motion of their own change places where there is little room."""

from __future__ import annotations

from pathlib import Path

import bench_kinodynamic
import generate_traffic
import numpy as np
import pytest
import yaml

import mrmg
from mrmg.planning import plan_mission


@pytest.mark.parametrize(
    ("name", "seed"), [("window", 302), ("window", 1002), ("alcove", 1000)]
)
def test_robots_change_places(tmp_path: Path, name: str, seed: int) -> None:
    """In window 302 one robot would be first if it could turn in no time.

    In window 1002 one has to turn round before it can set out.
    """
    rng = np.random.default_rng((list(generate_traffic.CLASSES).index(name), seed))
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.safe_dump(generate_traffic.CLASSES[name](rng)))
    scene = bench_kinodynamic.benchmark_scene(path, tmp_path)
    result = plan_mission(scene, params=bench_kinodynamic.PARAMS)
    assert result.plan is not None, result.reason
    assert mrmg.verify(scene, result.plan).ok
