"""Seeded damage to files: values, keys, structure, bytes, arrays and archives."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import PurePath
from random import Random
from typing import Any

import numpy as np
import yaml

LONG_INTEGER = "9" * 5000
"""Longer than the 4,300 digits that Python reads as an integer by default."""

DEPTH = 3000
"""Levels of nesting beyond what a recursive reader survives."""

TOKENS = (
    *("nan", ".nan", ".inf", "-.inf", "NaN", "Infinity", "1e999", "-1e308", "1e-320"),
    *("0", "-0.0", "-1", "1e6", "1e15", LONG_INTEGER, f"0x{'f' * 5000}", "1_000"),
    *("!!int foo", "!!float x", "!!binary zz", "!!timestamp x", "!!set {a}"),
    *("!!python/object/apply:os.system ['true']", "!unknown 1", "&a [*a]", "*nowhere"),
    *("\u00b2", "\u0661\u0662", "null", "~", "true", "''", '""', "[]", "{}", "[{}]"),
    *("2026-01-01", "\x1b[31mred", "<script>alert(1)</script>", "../../etc/passwd"),
    *("/etc/passwd", "a" * 100_000, '"\\ud800"', '"\\u0000"', "- - -", ": :", "#"),
    *("[" * DEPTH + "]" * DEPTH, "{a: " * DEPTH + "}" * DEPTH),
)
"""What takes the place of a number, a word or a key of a text."""

HUGE, DEEP, ENDLESS = "@huge@", "@deep@", "@nan@"
"""Stand for values that cannot be dumped; replaced in the text afterwards."""

VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 10**18, 0.5, -0.0, 1e308, 1e300, 1e-320, 1e7),
    *(1e5, -1e8, 1e-4),
    *("", "x", "x" * 5000, "<b>&", "\x1b[31m", "\ud800", "../x", "/etc/passwd", "1"),
    *([], {}, [None], [[]], {"": None}, {"a": 1}, [1, 2], [1, 2, 3], ["x", "y"]),
    *(HUGE, DEEP, ENDLESS, float("inf")),
)
"""What takes the place of a value of a document."""

BYTES = (b"\0", b"\xff", b"\xed\xa0\x80", b"\r", b"\x1b", b"\xef\xbb\xbf", b"%", b"\n")

_TOKEN = re.compile(r"[^\s,:\[\]{}<>\"'=]+")


def mutated(name: str, content: bytes, random: Random) -> bytes:
    """Return the content of a file with one fault, or a few, of its kind or of any."""
    damage = _BY_SUFFIX.get(PurePath(name).suffix, mutate_bytes)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        chosen = damage if random.random() < 0.85 else mutate_bytes
        with suppress(Exception):  # what one fault made unreadable takes no second one
            content = chosen(content, random)
    return content


def mutate_bytes(content: bytes, random: Random) -> bytes:
    """Cut off, flip, remove, repeat, insert or re-encode bytes."""
    at = random.randrange(len(content) + 1)
    end = min(len(content), at + random.choice((1, 2, 8, 64, 512)))
    match random.randrange(7):
        case 0:
            return content[:at]
        case 1:
            flipped = bytearray(content or b"\0")
            for _ in range(random.choice((1, 1, 4, 32))):
                flipped[random.randrange(len(flipped))] ^= 1 << random.randrange(8)
            return bytes(flipped)
        case 2:
            return content[:at] + content[end:]
        case 3:
            return (
                content[:end] + content[at:end] * random.choice((1, 3)) + content[end:]
            )
        case 4:
            return content[:at] + random.choice(BYTES) + content[at:]
        case 5:
            return content[:at] + random.randbytes(end - at) + content[end:]
    text = content.decode("utf-8", errors="replace")
    return text.encode(random.choice(("utf-16", "utf-32", "utf-8-sig", "cp037")))


def mutate_text(content: bytes, random: Random) -> bytes:
    """Replace a token, or remove, repeat, swap or shift lines."""
    text = content.decode()
    lines = text.splitlines(keepends=True) or [""]
    at = random.randrange(len(lines))
    match random.randrange(6):
        case 0:
            del lines[at]
        case 1:
            lines.insert(at, lines[at])
        case 2:
            other = random.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
        case 3:
            lines[at] = random.choice((" ", "\t", "- ", "  ")) + lines[at]
        case _:
            found = [*_TOKEN.finditer(text)]
            if not found:
                return content
            token = random.choice(found)
            inserted = random.choice(TOKENS)
            return (text[: token.start()] + inserted + text[token.end() :]).encode()
    return "".join(lines).encode()


def mutate_value(document: Any, random: Random) -> Any:
    """Replace, remove, repeat, wrap, exchange or rename one part of plain data."""
    places = [*_places(document, ())]
    if not places:
        return random.choice(VALUES)
    *way, last = random.choice(places)
    parent = document
    for key in way:
        parent = parent[key]
    value = parent[last]
    match random.randrange(8):
        case 0:
            del parent[last]
        case 1:
            parent[last] = [value]
        case 2:
            parent[last] = {"value": value}
        case 3 if isinstance(parent, dict):
            parent[random.choice(("", "x", "\u00b2", f"{last}s", "<b>"))] = parent.pop(
                last
            )
        case 3:
            parent.append(value)
        case 4:
            *other, end = random.choice(places)
            source = document
            for key in other:
                source = source[key]
            parent[last] = json.loads(json.dumps(source[end]))
        case _:
            parent[last] = random.choice(VALUES)
    return document


def _places(value: Any, way: tuple[Any, ...]) -> Any:
    items: Any = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value[:40])
    for key, item in items:
        yield (*way, key)
        yield from _places(item, (*way, key))


def _mutate_yaml(content: bytes, random: Random) -> bytes:
    if random.random() < 0.4:
        return mutate_text(content, random)
    document = mutate_value(yaml.safe_load(content), random)
    return _placed(yaml.safe_dump(document, sort_keys=False), ".nan")


def _mutate_json(content: bytes, random: Random) -> bytes:
    if random.random() < 0.3:
        return mutate_text(content, random)
    return _placed(json.dumps(mutate_value(json.loads(content), random)), "NaN")


def _placed(text: str, nan: str) -> bytes:
    values = {HUGE: LONG_INTEGER, DEEP: "[" * DEPTH + "]" * DEPTH, ENDLESS: nan}
    for name, value in values.items():
        text = text.replace(f'"{name}"', value).replace(f"'{name}'", value)
    return text.encode("utf-8", errors="surrogatepass")


def _mutate_arrays(content: bytes, random: Random) -> bytes:
    if random.random() < 0.2:
        return mutate_archive(content, random)
    with np.load(io.BytesIO(content)) as archive:
        arrays = {name: archive[name] for name in archive.files}
    name = random.choice(sorted(arrays))
    changed = _ARRAY_DAMAGE[random.randrange(len(_ARRAY_DAMAGE))](arrays[name], random)
    members = {key: _npy(value) for key, value in arrays.items()}
    del members[name]
    if changed is not None:
        renamed = random.random() < 0.1
        members[f"{name}x" if renamed else name] = changed
    return zipped({f"{key}.npy": value for key, value in members.items()})


def _with_value(values: np.ndarray, random: Random) -> bytes:
    changed = np.array(
        values, dtype=float if values.dtype.kind == "f" else values.dtype
    )
    if changed.size and changed.dtype.kind in "if":
        huge = (np.nan, np.inf, -np.inf, 1e308, -1.0, 1e9, 0.0)
        small = (-1, 0, 2**31 - 1, 10**6)
        at = random.randrange(changed.size)
        changed.flat[at] = random.choice(huge if changed.dtype.kind == "f" else small)
    return _npy(changed)


def _with_shape(values: np.ndarray, random: Random) -> bytes:
    shapes: tuple[Callable[[], np.ndarray], ...] = (
        lambda: values[:0],
        lambda: values[:-1],
        lambda: values[None],
        values.ravel,
        lambda: values.T,
        lambda: values[..., :1],
        lambda: np.concatenate([values, values]),
        lambda: values.sum(),
    )
    with suppress(IndexError, TypeError):
        return _npy(np.asarray(random.choice(shapes)()))
    return _npy(np.zeros(3))


def _with_type(values: np.ndarray, random: Random) -> bytes:
    with suppress(ValueError, TypeError), np.errstate(all="ignore"):
        kind = random.choice(("i4", "f2", "c16", "U8", "?", "S4", ">f8", "u1"))
        return _npy(values.astype(kind))
    return _npy(np.zeros(3, dtype="U4"))


def claimed_array(shape: str, kind: str = "<f8", data: bytes = b"") -> bytes:
    """Return a .npy file whose header states a shape, whatever data it has."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
    header = text.ljust(128 - 11) + "\n"
    return (
        b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + data
    )


def _with_claim(values: np.ndarray, random: Random) -> bytes:
    shapes = (
        "(10**12,)",
        "(4000000000, 5)",
        "(-1,)",
        "(2, 1000000000)",
        "()",
        "(1.5,)",
    )
    return claimed_array(
        random.choice(shapes), random.choice(("<f8", "|O", "<U999999999", "V8", "x"))
    )


_ARRAY_DAMAGE: tuple[Callable[[np.ndarray, Random], bytes | None], ...] = (
    _with_value,
    _with_value,
    _with_shape,
    _with_type,
    _with_claim,
    lambda values, random: None,
    lambda values, random: mutate_bytes(_npy(values), random),
)


def _npy(values: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.asarray(values), allow_pickle=False)
    return buffer.getvalue()


def zipped(members: Mapping[str, bytes]) -> bytes:
    """Return a zip of members by name, dated as of no clock."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, content)
    return buffer.getvalue()


def mutate_archive(content: bytes, random: Random) -> bytes:
    """Damage, remove, rename or add a member of a zip."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = random.choice(sorted(members))
    match random.randrange(5):
        case 0:
            del members[name]
        case 1:
            wanted = (
                "../x",
                "/x",
                "models/../../x",
                f"{name}/",
                "x",
                "models/a/b.yaml",
            )
            members[random.choice(wanted)] = members.pop(name)
        case _:
            members[name] = mutated(name, members[name], random)
    return zipped(members)


_BY_SUFFIX: dict[str, Callable[[bytes, Random], bytes]] = {
    ".yaml": _mutate_yaml,
    ".json": _mutate_json,
    ".geojson": _mutate_json,
    ".npz": _mutate_arrays,
    ".zip": mutate_archive,
    **dict.fromkeys((".xml", ".urdf", ".xacro", ".txt", ".tri", ".csv"), mutate_text),
}
