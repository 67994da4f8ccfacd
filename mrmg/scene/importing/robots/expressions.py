"""Guard of the expressions in xacro files: data in, data out, and no code of the file.

xacro evaluates `${...}` and `$(eval ...)` as Python. It hides builtins from them, which
any attribute of any value gets around. Here every text is checked right before Python
evaluates it, after xacro has put it together from properties and arguments.
"""

from __future__ import annotations

import ast
import importlib.util
import math
from collections.abc import Mapping
from types import ModuleType
from typing import Any

ALLOWED = (
    "allowed are numbers, text, names, lists, arithmetic, comparisons, conditions and "
    "calls such as sin(), round(), lower() or xacro.load_yaml(); if you trust the "
    "file, expand it yourself (xacro FILE > robot.urdf) and import that"
)
"""What expressions may consist of, and what to do with others; part of messages."""

_NODES = (
    *(ast.Expression, ast.Constant, ast.Name, ast.Load, ast.Attribute),
    *(ast.List, ast.Tuple, ast.Dict, ast.Subscript, ast.Slice),
    *(ast.BinOp, ast.operator, ast.UnaryOp, ast.unaryop, ast.BoolOp, ast.boolop),
    *(ast.Compare, ast.cmpop, ast.IfExp, ast.Call, ast.keyword),
)
_FUNCTIONS = """
    abs all any bool dict divmod enumerate float int len list max min range
    reversed round set sorted str sum tuple zip
    abs_filename arg dotify error fatal load_yaml message tokenize warning
    dirname env find optenv
    get items keys values
    endswith join lower replace split startswith strip upper
"""  # and not `format`, whose fields reach attributes
_CALLS = {*_FUNCTIONS.split(), *(name for name in dir(math) if name[0] != "_")}


class ExpressionError(ValueError):
    """An expression of a file that is not evaluated, as it could run code."""

    def __init__(self, expression: str, part: str) -> None:
        what = f"'{_short(part)}' in it" if part != expression else "it"
        super().__init__(
            f"expression '{_short(expression)}' is not evaluated, as {what} could run "
            f"code: {ALLOWED}"
        )


def guarded(xacro: ModuleType) -> Any:
    """Return a copy of the module xacro that refuses expressions that could run code.

    All evaluations pass through two of its functions, which the copy replaces; the
    module itself stays as it is for everybody else.

    Raises:
        AttributeError: if a version of xacro does not have these functions.
    """
    spec = xacro.__spec__
    assert spec is not None
    assert spec.loader is not None
    own = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(own)
    evaluate, extend = own.safe_eval, own.eval_extension

    def guarded_evaluation(expression: str, *names: Any) -> Any:
        require_harmless(expression)
        value = evaluate(expression, *names)
        # A property that held a function could be called by an allowed name.
        if _holds_function(value):
            raise ExpressionError(expression, expression)
        return value

    def guarded_extension(text: str) -> Any:
        command = text.removeprefix("$(").removesuffix(")").lstrip()
        if command.startswith("eval"):
            require_harmless(command.removeprefix("eval"))
        return extend(text)

    vars(own).update(safe_eval=guarded_evaluation, eval_extension=guarded_extension)
    return own


def require_harmless(expression: str) -> None:
    """Raise an ExpressionError unless evaluating an expression can run no code of it.

    Raises:
        ExpressionError: naming the part that could.
        SyntaxError: if it is no expression.
    """
    text = expression.strip()
    for node in ast.walk(ast.parse(text, "<expression>", mode="eval")):
        if not _harmless(node):
            part = ast.get_source_segment(text, node)
            raise ExpressionError(text, part or text)


def _harmless(node: ast.AST) -> bool:
    match node:
        case ast.Name(id=name):
            return not name.startswith("__")
        case ast.Attribute(attr=name):
            return not name.startswith("_")
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
            # Keywords of other functions may be functions: `key`.
            return name in _CALLS and (name == "dict" or not node.keywords)
        case ast.Call():
            return False
    return isinstance(node, _NODES)


def _holds_function(value: Any) -> bool:
    if isinstance(value, Mapping):
        return any(_holds_function(item) for item in value.values())
    if isinstance(value, list | tuple | set):
        return any(_holds_function(item) for item in value)
    return callable(value)


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
