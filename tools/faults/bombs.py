"""Bombs: small files that stand for huge content, and files of absurd sizes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from faults.inputs import ALIASES, SCENE, Write, capsule, claimed, files
from faults.mutations import zipped
from faults.named import Case
from mrmg import storage


def bombs(runs: Path) -> Mapping[str, Case]:
    """Return cases by name, some of them in copies of finished runs."""
    disturbances = {"d.yaml": f"{ALIASES}\nmass: *a11\n"}
    models = zipped({f"models/a/{number}.xml": b"" for number in range(20_000)})
    writes = {
        **_documents(),
        "disturbances": files(disturbances, "execute run --disturb d.yaml", runs),
    }
    return {
        **_arrays(runs),
        **{name: Case(write=write, codes=(2, 3)) for name, write in writes.items()},
        "a capsule of deep JSON": Case(
            write=capsule({"capsule.json": b"[" * 10**6}),
        ),
        "a capsule of 20000 models": Case(
            write=files({"c.zip": models}, "replay c.zip"),
        ),
    }


def _arrays(runs: Path) -> Mapping[str, Case]:
    zeros = storage.array_bytes({"time_s": np.zeros(10**8, dtype="u1")})
    contents = {
        "of 10^12 numbers claimed": claimed("(1000000000000,)"),
        "of a shape of 10^6 axes": claimed(f"({'1,' * 20_000})"),
        "of long texts": claimed("(1000,)", "<U99999999"),
        "of 10^8 zeros": zeros,
        "of 20000 members": zipped({f"{n}.npy": b"" for n in range(20_000)}),
        "inside itself": zipped({"a.npz": zipped({"a.npy": zeros})}),
    }
    return {
        f"{verb} with {name} {what}": Case(
            write=files({f"run/{name}": content}, f"{verb} run", runs),
            codes=(0, 2, 3),
        )
        for name in ("plan.npz", "log.npz")
        for what, content in contents.items()
        for verb in ("verify", "audit", "report")
    }


def _documents() -> Mapping[str, Write]:
    campaign = f"{ALIASES}\nscenes: [quickstart]\nparameters: {{soc_margin: *a11}}\n"
    trials = (
        "scenes: [quickstart]\nseeds: 0-999999\nparameters:\n"
        "  soc_margin: [0, 0.1]\n  battery.capacity_m: [1, 2, 3, 4]\n"
    )
    into = "-o o.yaml"
    return {
        "a scene": files({"s.yaml": f"{ALIASES}\n{SCENE}"}, "scene check s.yaml"),
        "a campaign": files({"c.yaml": campaign}, "campaign c.yaml"),
        "a map": files(
            {"m.yaml": f"{ALIASES}\nimage: *a11\n"}, f"scene import m.yaml {into}"
        ),
        "a layout": files({"l.json": "[" * 10**6}, f"scene import l.json {into}"),
        "a picture of 10^10 cells": _map(b"P5\n100000 100000\n255\n"),
        "a PNG of 10^9 cells": _map(_png(32_000, 32_000)),
        "a campaign of 10^12 trials": files({"c.yaml": trials}, "campaign c.yaml"),
        "a description of entities": files(
            {"a.urdf": _entities()}, "robot import a.urdf -o n"
        ),
    }


_MAP = (
    "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def _map(picture: bytes) -> Write:
    return files({"m.yaml": _MAP, "m.pgm": picture}, "scene import m.yaml -o o.yaml")


def _png(width: int, height: int) -> bytes:
    """Return a PNG of one grey, which packs to almost nothing."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checked = kind + data
        return (
            struct.pack(">I", len(data))
            + checked
            + struct.pack(">I", zlib.crc32(checked))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    packer = zlib.compressobj(1)
    row = bytes(width + 1)
    data = b"".join([*(packer.compress(row) for _ in range(height)), packer.flush()])
    parts = chunk(b"IHDR", head), chunk(b"IDAT", data), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _entities() -> str:
    lines = ['<!ENTITY a0 "aaaaaaaaaa">']
    lines += [f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12)]
    return (
        f"<!DOCTYPE r [{''.join(lines)}]><robot name='r'><link name='&a11;'/></robot>"
    )
