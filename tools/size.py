"""Count the lines of code by package, and list modules and functions that are long.

Lines of code are those without blanks, comments and docstrings. They are counted of
mrmg alone; the lists are of mrmg and of the tools. Keys of --json:
`packages` (lines of code by package; the modules of mrmg itself are one entry), `core`
(the sum of planning, compilation, motion and world), `total`, and three lists:
`long_modules` (`module` and its `lines`, blanks and comments included),
`long_functions` (`module`, `function`, `lines`, the docstring included) and
`wide_functions` (`module`, `function`, `parameters`).
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TOOLS = Path(__file__).resolve().parent
PACKAGE = TOOLS.with_name("mrmg")

CORE = ("planning", "compilation", "motion", "world")
"""Packages whose sum is reported."""

LONGEST_MODULE = 350
"""Lines of a module, everything included."""

LONGEST_FUNCTION = 60
"""Lines of a function, from `def` to its last one, docstring included."""

MOST_PARAMETERS = 8
"""Parameters of a function; `self` and `cls` do not count."""

_LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
_FUNCTION = ast.FunctionDef | ast.AsyncFunctionDef


def code_lines(source: str) -> int:
    """Return how many lines of a module are neither blank, comment nor docstring."""
    documentation: set[int] = set()
    for node in _statements(ast.parse(source)):
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            documentation.update(range(value.lineno, (value.end_lineno or 0) + 1))
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _LAYOUT:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - documentation)


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements within a node, and leave their expressions unread."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr):
            yield child
            yield from _statements(child)


def functions(source: str) -> list[tuple[str, int, int]]:
    """Return (qualified name, lines, parameters) of every function of a module."""
    found: list[tuple[str, int, int]] = []

    def visit(node: ast.AST, prefix: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, _FUNCTION | ast.ClassDef):
                name = f"{prefix}.{child.name}" if prefix else child.name
                if isinstance(child, _FUNCTION):
                    lines = (child.end_lineno or 0) - child.lineno + 1
                    found.append((name, lines, _parameters(child)))
                visit(child, name)
            elif not isinstance(child, ast.expr):
                visit(child, prefix)

    visit(ast.parse(source), "")
    return found


def _parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    given = function.args
    named = [*given.posonlyargs, *given.args, *given.kwonlyargs]
    own = bool(named) and named[0].arg in ("self", "cls")
    return len(named) - own + bool(given.vararg) + bool(given.kwarg)


def measure(package: Path, tools: Path) -> dict[str, Any]:
    """Return the document of --json for the package and the tools in two folders."""
    lines: Counter[str] = Counter()
    for path in sorted(package.rglob("*.py")):
        place = path.relative_to(package.parent)
        owner = place.parts[1] if len(place.parts) > 2 else package.name
        lines[owner] += code_lines(path.read_text())
    return {
        "packages": dict(sorted(lines.items())),
        "total": sum(lines.values()),
        "core": sum(lines[name] for name in CORE),
        **too_long(package, tools),
    }


def too_long(package: Path, tools: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the three lists of --json."""
    modules, lengthy, wide = [], [], []
    for path in (*sorted(package.rglob("*.py")), *sorted(tools.rglob("*.py"))):
        source, place = path.read_text(), path.relative_to(package.parent)
        module = ".".join(place.with_suffix("").parts)
        length = len(source.splitlines())
        if length > LONGEST_MODULE:
            modules.append({"module": module, "lines": length})
        for name, size, parameters in functions(source):
            row = {"module": module, "function": name}
            if size > LONGEST_FUNCTION:
                lengthy.append(row | {"lines": size})
            if parameters > MOST_PARAMETERS:
                wide.append(row | {"parameters": parameters})
    return {
        "long_modules": modules,
        "long_functions": lengthy,
        "wide_functions": wide,
    }


def main() -> None:
    """Measure package and tools, print the tables, and write the document."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write the figures as JSON, too"
    )
    arguments = parser.parse_args()
    found = measure(PACKAGE, TOOLS)
    for package, lines in found["packages"].items():
        print(f"{lines:7,d}  {package}")
    print(f"{found['core']:7,d}  {' + '.join(CORE)}")
    print(f"{found['total']:7,d}  total")
    for title, key in (
        (f"Modules over {LONGEST_MODULE} lines", "long_modules"),
        (f"Functions over {LONGEST_FUNCTION} lines", "long_functions"),
        (f"Functions of more than {MOST_PARAMETERS} parameters", "wide_functions"),
    ):
        print(f"\n{title}: {len(found[key]) or 'none'}")
        rows = [tuple(row.values()) for row in found[key]]
        for *name, number in sorted(rows, key=lambda row: -row[-1]):
            print(f"{number:7,d}  {'.'.join(name)}")
    if arguments.json:
        arguments.json.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
