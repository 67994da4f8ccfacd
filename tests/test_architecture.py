"""Rules of the architecture that no other tool checks."""

from __future__ import annotations

import ast
import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest
import size

import mrmg

PACKAGE = Path(mrmg.__file__).parent
MODULES = sorted(PACKAGE.rglob("*.py"))
DRAWERS = {"utils", "util", "common", "helpers", "helper", "misc", "tools"}
HEAVY = {"av", "casadi", "matplotlib", "mujoco", "numba", "pydantic", "rich", "scipy"}

FACADES = [
    name
    for _, name, is_package in pkgutil.walk_packages([str(PACKAGE)], "mrmg.")
    if is_package
]


def relative(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_modules_are_named_after_their_subjects(path: Path) -> None:
    assert path.stem not in DRAWERS


def test_modules_and_functions_stay_readable() -> None:
    found = size.too_long(PACKAGE, size.TOOLS)
    assert found == {"long_modules": [], "long_functions": [], "wide_functions": []}


@pytest.mark.parametrize("name", ["mrmg", *FACADES])
def test_every_exported_name_exists(name: str) -> None:
    module = importlib.import_module(name)
    exported = getattr(module, "__all__", [])
    assert [item for item in exported if not hasattr(module, item)] == []
    assert list(exported) == sorted(exported)


def test_nothing_is_done_in_assertions() -> None:
    """Python leaves them out with `-O` and `PYTHONOPTIMIZE`."""
    done = [
        f"{relative(path)}:{node.lineno}"
        for path in MODULES
        if path.parent.name != "testing"  # pytest's own
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Assert)
        for call in ast.walk(node.test)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name)
    ]
    assert done == []


def test_unknown_names_of_the_package_are_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = mrmg.nonsense


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*_kernels.py")), ids=relative)
def test_kernels_import_only_what_can_be_compiled(path: Path) -> None:
    """The cache of compiled kernels is keyed by these files and sees no others."""
    allowed = {"__future__", "heapq", "llvmlite", "math", "numba", "numpy", "typing"}
    for name in imported_names(path):
        inside = name.startswith("mrmg.")
        feeds_cache = name.endswith("_kernels") or name in {
            "mrmg.compilation",
            "mrmg.energy.model",
            "mrmg.motion.dynamics",
        }
        assert feeds_cache if inside else name.split(".")[0] in allowed, name


@pytest.mark.parametrize("path", MODULES, ids=relative)
def test_mujoco_is_imported_at_one_place(path: Path) -> None:
    is_door = path.name == "mujoco_import.py"
    assert ("mujoco" in imported_names(path)) == is_door


def imported_names(path: Path) -> list[str]:
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            within = [f"{node.module}.{alias.name}" for alias in node.names]
            is_module = [
                (PACKAGE.parent / (name.replace(".", "/") + ".py")).exists()
                for name in within
            ]
            names += [
                full if is_one else str(node.module)
                for full, is_one in zip(within, is_module, strict=True)
            ]
    return names


@pytest.mark.parametrize(
    "statement",
    ["import mrmg", "from mrmg.cli.parser import make_parser; make_parser()"],
)
def test_nothing_heavy_is_imported_before_a_command_runs(statement: str) -> None:
    code = f"import sys; {statement}; print(*sys.modules)"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    loaded = {name.split(".")[0] for name in answer.stdout.split()}
    assert sorted(loaded & HEAVY) == []
