"""From pydantic's errors to faults a user can act on."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, RootModel, ValidationError
from pydantic.fields import FieldInfo

from mrmg.counted import counted
from mrmg.errors import Fault, SceneError, nearest

_Model = TypeVar("_Model", bound=BaseModel)

NO_NAME = "''"
"""An empty key in the path of a fault."""

_KINDS = {
    "float_type": "expected a number",
    "float_parsing": "expected a number",
    "int_type": "expected a whole number",
    "string_type": "expected text (put it in quotes)",
    "bool_type": "expected true or false",
    "list_type": "expected a list",
    "finite_number": "expected a finite number",
    "string_pattern_mismatch": "ids are made of letters, digits, '_', '.' and '-'",
    "recursion_loop": "contains itself",
    "invalid_key": "keys must be text",
}


class EntryError(Exception):
    """A well-formed entry states what cannot be; carries its faults."""

    def __init__(self, *faults: Fault) -> None:
        super().__init__(*faults)
        self.faults = faults


def parsed(model: type[_Model], item: Any) -> _Model | None:
    """Return `item` as an entry, or None: its faults are reported with the file's."""
    try:
        return model.model_validate(item)
    except ValidationError:
        return None


def validated(model: type[_Model], document: Any, source: str) -> _Model:
    """Return a document as the model of its format.

    Args:
        model: of the format.
        document: plain data.
        source: what error messages call it.

    Raises:
        SceneError: naming every fault of the document.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise SceneError(source, faults_of(error, model)) from error


def faults_of(error: ValidationError, model: type[BaseModel]) -> list[Fault]:
    """Return one fault per error: its path, the value, and what is allowed there."""
    details = [dict(detail) for detail in error.errors()]
    return [_fault(detail, model) for detail in details if _is_meant(detail)]


def _is_meant(detail: dict[str, Any]) -> bool:
    """Return whether an error is about what the user meant of a word or a mapping."""
    end = detail["loc"][-1] if detail["loc"] else ""
    if _is_word(end):
        return not isinstance(detail["input"], dict)
    return not (detail["type"] == "model_type" and _is_model(end))


def _is_word(part: str | int) -> bool:
    return isinstance(part, str) and part.startswith("literal[")


def _is_model(part: str | int) -> bool:
    return isinstance(part, str) and part.endswith("Entry")


def _fault(detail: dict[str, Any], model: type[BaseModel]) -> Fault:
    *inner, end = detail["loc"] or ("",)
    loc: tuple[str | int, ...] = tuple(part for part in inner if not _is_model(part))
    loc += () if _is_word(end) or not detail["loc"] else (end,)
    kind: str = detail["type"]
    value = detail["input"]
    # A start energy is mostly spelt as a bare number, which means a fraction.
    path = ".".join(str(part) or NO_NAME for part in loc).removesuffix(".fraction")
    if kind == "extra_forbidden":
        return Fault(path, unknown_key(str(loc[-1]), _known_keys(model, loc[:-1])))
    wanted = _description(model, loc)
    if kind == "missing":
        return Fault(path, "missing" + (f"; expected {wanted}" if wanted else ""))
    if kind in ("too_short", "too_long"):
        items = counted(len(value), "item")
        allowed = wanted or f"{_allowed(detail)} items"
        return Fault(path, f"got {items}, {shown(value)}; expected {allowed}")
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        keys = ", ".join(_known_keys(model, loc))
        return Fault(path, f"got {shown(value)}; expected a mapping with keys {keys}")
    if kind == "model_reference":
        return Fault(path, f"got {shown(value)}; expected {detail['msg']}")
    rule = _KINDS.get(kind) or f"must be {_allowed(detail)}"
    about = f" ({wanted})" if wanted else ""
    if not wanted and _is_word(end) and (keys := ", ".join(_known_keys(model, loc))):
        about += f", or a mapping with keys {keys}"
    return Fault(path, f"got {shown(value)}; {rule}{about}")


def _allowed(detail: dict[str, Any]) -> str:
    """Return the bound a value broke, in the words of the error's context."""
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    context = detail.get("ctx", {})
    for key, sign in signs.items():
        if key in context:
            return f"{sign} {context[key]:g}"
    if "expected" in context:
        return str(context["expected"])
    if "min_length" in context:
        return f"at least {context['min_length']}"
    if "max_length" in context:
        return f"at most {context['max_length']}"
    return str(detail["msg"]).removeprefix("Input should be ")


def unknown_key(key: str, known: Iterable[str]) -> str:
    """Return the message for a key that is not in the format."""
    names = sorted(known)
    return f"unknown key{nearest(key, names)}; known keys: {', '.join(names)}"


def unknown_robot(name: str, robots: Sequence[str]) -> str:
    """Return the message for a robot that a scene does not have."""
    known = ", ".join(robots) or "none"
    return f"no robot '{name}'{nearest(name, robots)}; robots: {known}"


def shown(value: Any) -> str:
    """Return a value as the file might spell it, cut to a readable length."""
    if value is None:
        return "nothing"
    text = repr(value) if not isinstance(value, bool) else str(value).lower()
    return text if len(text) <= 60 else text[:57] + "..."


def keys_of(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the fields of a model by their keys in files."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _known_keys(model: type[BaseModel], loc: tuple[str | int, ...]) -> list[str]:
    inner, _ = _walk(model, loc)
    return [] if inner is None else list(keys_of(inner))


def _description(model: type[BaseModel], loc: tuple[str | int, ...]) -> str | None:
    _, field = _walk(model, loc)
    stated = None if field is None else field.description
    return stated and stated.replace("\n", " ")


def _walk(
    model: type[BaseModel], loc: tuple[str | int, ...]
) -> tuple[type[BaseModel] | None, FieldInfo | None]:
    """Return the model that a path leads to, and the field if it ends on one."""
    inner: type[BaseModel] | None = model
    field: FieldInfo | None = None
    for part in loc:
        if isinstance(part, int):
            field = None
            continue
        if inner is not None and issubclass(inner, RootModel):  # a mapping of any keys
            root = inner.model_fields["root"].annotation
            inner, field = _model_in(typing.get_args(root)[-1]), None
            continue
        if inner is None or part not in keys_of(inner):
            return None, None
        field = keys_of(inner)[part]
        inner = _model_in(field.annotation)
    return inner, field


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    origin = typing.get_origin(annotation)
    if origin in (list, typing.Union, types.UnionType, typing.Annotated):
        found = (_model_in(argument) for argument in typing.get_args(annotation))
        return next((model for model in found if model is not None), None)
    return None
