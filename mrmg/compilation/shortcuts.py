"""What numba works out over and over while it compiles, worked out once.

To find the type of `a + b`, numba tries each of dozens of definitions of `+`, and words
an explanation for each that does not fit, at every place where two such types are added
and in every round of its inference. Here the definition that fitted the same types
before is tried first. Its settings are compared at every such try, option by option;
every call into LLVM is reported twice to whoever listens: nobody; and variables are
listed time and again by looking at what else instructions consist of. Together that is
a quarter of the time to compile; what is compiled is the same.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from llvmlite import binding
from numba.core import errors, ir
from numba.core.target_extension import get_local_target
from numba.core.targetconfig import TargetConfig
from numba.core.types import Poison
from numba.core.types.functions import BaseFunction
from numba.core.types.misc import unliteral
from numba.core.utils import order_by_target_specificity


def take_shortcuts() -> None:
    """Have numba work out less from now on."""
    settings: Any = TargetConfig
    settings.__hash__, settings.__eq__ = _hash, _equal
    function: Any = BaseFunction
    function.get_call_type = _call_type(function.get_call_type)
    instruction: Any = ir.Inst
    instruction._rec_list_vars = _variables
    for callbacks in list(binding.ffi.lib._lock._cblist):
        binding.ffi.unregister_lock_callback(*callbacks)


def _hash(settings: Any) -> int:
    return hash(type(settings))


def _equal(settings: Any, others: Any) -> Any:
    if not isinstance(others, TargetConfig):
        return NotImplemented
    return settings._values == others._values or settings.values() == others.values()


def _variables(instruction: Any, part: Any) -> list[Any]:
    """Return the variables in a part of an instruction, in their order."""
    if isinstance(part, ir.Var):
        return [part]
    if isinstance(part, ir.Inst):
        return list(part.list_vars())
    found: list[Any] = []
    if isinstance(part, _HOLDERS):
        for item in part.values() if isinstance(part, dict) else part:
            if isinstance(item, _HOLDERS):
                found += _variables(instruction, item)
    return found


_HOLDERS = (ir.Var, ir.Inst, list, tuple, dict)
"""All that variables are, or are found in."""


def _call_type(slow: Callable[..., Any]) -> Callable[..., Any]:
    """Return how to find the type of a call; as numba does, `slow`, if it has none."""
    fitting: dict[Any, tuple[type, tuple[Any, ...], dict[str, Any]]] = {}

    @functools.wraps(slow)
    def call_type(kind: BaseFunction, context: Any, args: Any, kws: Any) -> Any:
        call = kind, context, tuple(args), tuple(kws.items())
        if call in fitting:
            found = _type_by(kind, context, *fitting[call])
            if found is not None:
                return found
        plain = tuple(map(unliteral, args))
        plain_kws = {name: unliteral(value) for name, value in kws.items()}
        if any(isinstance(given, Poison) for given in (*plain, *plain_kws.values())):
            return slow(kind, context, args, kws)
        for definition in _by_target(kind, context):
            forms = [(plain, plain_kws), (args, kws)]
            for form in reversed(forms) if definition.prefer_literal else forms:
                found = _type_by(kind, context, definition, *form)
                if found is not None:
                    fitting[call] = definition, *form
                    return found
        return slow(kind, context, args, kws)

    return call_type


def _by_target(kind: BaseFunction, context: Any) -> Any:
    """Return a function's definitions in the order in which numba tries them."""
    return order_by_target_specificity(
        get_local_target(context), kind.templates, fnkey=kind.typing_key
    )


def _type_by(kind: Any, context: Any, definition: Any, args: Any, kws: Any) -> Any:
    """Return the type of a call by one definition; None if that does not fit."""
    template = definition(context)
    try:
        found = template.apply(args, kws)
    except errors.NumbaError:
        return None
    if found is not None:
        kind._impl_keys[found.args] = template.get_impl_key(found)
    return found
