"""Guard of the expressions in xacro files: data in, data out, and no code of the file.

xacro evaluates `${...}` and `$(eval ...)` as Python. It hides builtins from them, which
any attribute of any value gets around. Here every text is checked right before Python
evaluates it, after xacro has put it together from properties and arguments.
"""

from __future__ import annotations

import ast
import importlib.util
import math
import re
from collections.abc import Callable, Mapping
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


LARGEST = 100_000
"""Bits, characters or items that the operands of an expression give at most."""

_COUNTING = ("range", "factorial", "comb", "perm")
"""Functions whose results grow with their arguments."""

TOO_LARGE = (
    f"be too large: allowed are numbers of {LARGEST} bits, and texts and lists of as "
    "many characters and items"
)


class ExpressionError(ValueError):
    """An expression of a file that is not evaluated, as it could do harm."""

    def __init__(
        self, expression: str, part: str, harm: str = f"run code: {ALLOWED}"
    ) -> None:
        what = f"'{_short(part)}' in it" if part != expression else "it"
        super().__init__(
            f"expression '{_short(expression)}' is not evaluated, as {what} could "
            f"{harm}"
        )


def cause_of(error: Exception) -> Exception:
    """Return what an error of xacro, which wraps others in its own, is about."""
    inner = getattr(error, "exc", None)
    return cause_of(inner) if isinstance(inner, Exception) else error


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
        require_harmless(expression, lambda part: evaluate(part, *names))
        value = evaluate(expression, *names)
        # A property that held a function could be called by an allowed name.
        if _holds_function(value):
            raise ExpressionError(expression, expression)
        return value

    def guarded_extension(text: str) -> Any:
        command = text.removeprefix("$(").removesuffix(")").lstrip()
        if command.startswith("eval"):
            require_harmless(  # it gives texts: those of lists tell types
                command.removeprefix("eval"),
                lambda part: ast.literal_eval(extend(f"$(eval [{part}])"))[0],
            )
        return extend(text)

    vars(own).update(safe_eval=guarded_evaluation, eval_extension=guarded_extension)
    return own


def require_harmless(expression: str, value_of: Callable[[str], Any]) -> None:
    """Refuse an expression that could run code or give something too large.

    Args:
        expression: to be evaluated.
        value_of: evaluates a part of it that can run no code.

    Raises:
        ExpressionError: naming the part that could.
        SyntaxError: if it is no expression.
    """
    text = expression.strip()
    nodes = list(ast.walk(ast.parse(text, "<expression>", mode="eval")))
    for node in nodes:
        if not _harmless(node):
            part = ast.get_source_segment(text, node)
            raise ExpressionError(text, part or text)
    for node in reversed(nodes):  # inner ones first
        if isinstance(node, ast.BinOp):
            parts = [node.left, node.right]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(_COUNTING):
            parts = node.args
        else:
            continue
        try:
            operands = [value_of(ast.unparse(part)) for part in parts]
            if isinstance(node, ast.BinOp):
                size = _size(node.op, *operands)
            else:
                size = max(map(abs, operands))
        except Exception as error:
            if isinstance(cause_of(error), ExpressionError):
                raise
            continue  # if it counts, evaluating it all raises it again
        if size > LARGEST:
            raise ExpressionError(text, ast.unparse(node), TOO_LARGE)


def _size(operator: ast.operator, left: Any, right: Any) -> int:
    """Return about how many bits, characters or items an operator gives at most."""
    whole = isinstance(left, int) and isinstance(right, int)
    match operator:
        case ast.Pow() if whole:
            return int(left.bit_length() * right)
        case ast.LShift() if whole:
            return int(left.bit_length() + right)
        case ast.Mult() if not whole:
            times, size = (left, right) if isinstance(left, int) else (right, left)
            return int(times * len(size))
        case ast.Mod() if isinstance(left, str):  # widths may be operands, too
            return LARGEST + 1 if re.search(r"%[^a-zA-Z%]*(\*|\d{4})", left) else 0
        case _ if whole:
            return int(left.bit_length() + right.bit_length())
    return len(left) + len(right)


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
