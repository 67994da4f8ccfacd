"""Of numba, this package uses what its documentation lists, and sets nothing."""

from __future__ import annotations

import ast
from pathlib import Path

import mrmg

ROOT = Path(mrmg.__file__).parents[1]

DOCUMENTED = {
    "numba": {"__version__", "cfunc", "config", "njit", "objmode", "types"},
    "numba.config": {"CACHE_DIR", "CPU_FEATURES", "CPU_NAME", "DISABLE_JIT"},
    "numba.extending": {"intrinsic", "overload"},
    "llvmlite": {"binding", "ir"},
}
"""Names by module; settings have environment variables of their names."""


def names_used(tree: ast.Module) -> set[tuple[str, str]]:
    """Return what a module takes from numba and llvmlite: (module, name)."""
    used = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            used |= {(node.module, alias.name) for alias in node.names}
        elif isinstance(node, ast.Import):
            used |= {(alias.name, "") for alias in node.names}
        elif isinstance(node, ast.Attribute):
            whose, _, name = ast.unparse(node).rpartition(".")
            used.add((whose, name))
    owners = ("numba", "llvmlite")
    return {(module, name) for module, name in used if module.split(".")[0] in owners}


def settings_changed(tree: ast.Module) -> list[str]:
    """Return the settings of numba that a module assigns to."""
    targets = [
        ast.unparse(node)
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
    ]
    return [name for name in targets if name.startswith("numba")]


def test_numba_is_used_as_documented_and_left_as_it_is() -> None:
    used: dict[str, set[str]] = {}
    for folder in ("mrmg", "tools"):
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text()
            if "numba" not in text and "llvmlite" not in text:
                continue
            tree = ast.parse(text)
            assert settings_changed(tree) == [], path
            for module, name in names_used(tree):
                used.setdefault(module, set()).add(name)
    for module, names in used.items():
        assert names - {""} <= DOCUMENTED.get(module, set()), module
    assert used.keys() == DOCUMENTED.keys()
