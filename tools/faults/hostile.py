"""Hostile files: bombs, absurd sizes, markup, climbing paths, code unasked for."""

from __future__ import annotations

import json
import pickle
import shutil
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from protocol import Row

from faults.commands import Outcome, run_process
from faults.corpus import FIRST_RUN_S, SITE, URDF
from faults.mutations import claimed_array, zipped
from faults.named import Case, run_cases
from faults.review import ALIASES, SCENE, Write, capsule, claimed, model
from faults.rows import Options, row_of
from mrmg import shipped, storage

MARK = "</script></title><img src=x onerror=alert(1)>\"'&<b>"

REQUIRED = {
    "bombs and sizes": "one message, 5 s of the processor, a gigabyte",
    "markup": "in no page does a name become an element",
    "climbing paths": "one message; nothing outside is read into results or written",
    "code": "nothing runs without --trust-code",
}


def rows(options: Options) -> Iterator[Row]:
    """Yield a row for each kind of hostile file."""
    runs = _runs(options.work / "hostile")
    groups = {
        "bombs and sizes": _bombs(runs),
        "markup": {**_markup(runs), **_markup_of_scenes()},
        "climbing paths": _climbing(),
        "code": _code(runs),
    }
    for group, cases in groups.items():
        found = options.trials.row(
            partial(run_cases, cases, options.work / "cases" / group.split()[0]),
            part="hostile",
            group=group,
        )
        yield row_of(
            f"hostile: {group}", REQUIRED[group], found["cases"], found["failures"]
        )


def _runs(folder: Path) -> Path:
    """Make a run and a failed one of the same scene."""
    folder.mkdir(parents=True)
    (folder / "site.yaml").write_text(SITE)
    for command in (
        "run site.yaml --no-video --out run",
        "robustness run --trials 2",
        "execute run --fault r1@2s --replan --out other",
    ):
        made = run_process(folder, command.split(), longest_s=FIRST_RUN_S)
        if made.code not in (0, 6):
            raise RuntimeError(f"mrmg {command}: {made.err}")
    return folder


def _copied(runs: Path, change: Callable[[Path], object], command: str) -> Write:
    """Return what copies the runs, changes them and gives a command."""

    def write(place: Path) -> tuple[str, ...]:
        shutil.copytree(runs, place, dirs_exist_ok=True)
        change(place)
        return tuple(command.split())

    return write


def _file(name: str, content: str | bytes, command: str, **others: str) -> Write:
    """Return what writes a file, others beside it, and gives a command."""

    def write(place: Path) -> tuple[str, ...]:
        for other, text in others.items():
            (place / other.replace("_", ".")).write_text(text)
        data = content.encode() if isinstance(content, str) else content
        (place / name).write_bytes(data)
        return tuple(command.split())

    return write


def _bombs(runs: Path) -> Mapping[str, Case]:
    zeros = storage.array_bytes({"time_s": np.zeros(10**8, dtype="u1")})
    many = zipped({f"{number}.npy": b"" for number in range(20_000)})
    cases: dict[str, Write] = {}
    for name in ("plan.npz", "log.npz"):
        for what, content in (
            ("of 10^12 numbers claimed", claimed("(1000000000000,)")),
            ("of a shape of 10^6 axes", claimed(f"({'1,' * 20_000})")),
            ("of long texts", claimed("(1000,)", "<U99999999")),
            ("of 10^8 zeros", zeros),
            ("of 20000 members", many),
            ("inside itself", zipped({"a.npz": zipped({"a.npy": zeros})})),
        ):
            for verb in ("verify", "audit", "report"):
                cases[f"{verb} with {name} {what}"] = _copied(
                    runs,
                    lambda place, name=name, content=content: (  # type: ignore[misc]
                        place / "run" / name
                    ).write_bytes(content),
                    f"{verb} run",
                )
    bombs = {
        "a scene": ("s.yaml", f"{ALIASES}\n{SCENE}", "scene check s.yaml"),
        "a campaign": (
            "c.yaml",
            f"{ALIASES}\nscenes: [quickstart]\nparameters: {{soc_margin: *a11}}\n",
            "campaign c.yaml",
        ),
        "a map": (
            "m.yaml",
            f"{ALIASES}\nimage: *a11\n",
            "scene import m.yaml -o o.yaml",
        ),
        "a layout": ("l.json", "[" * 10**6, "scene import l.json -o o.yaml"),
        "a picture of 10^10 cells": _map(b"P5\n100000 100000\n255\n"),
        "a PNG of 10^9 cells": _map(_png(32_000, 32_000)),
        "a campaign of 10^12 trials": (
            "c.yaml",
            "scenes: [quickstart]\nseeds: 0-999999\nparameters:\n"
            "  soc_margin: [0, 0.1]\n  battery.capacity_m: [1, 2, 3, 4]\n",
            "campaign c.yaml",
        ),
        "a description of entities": (
            "a.urdf",
            _entities(),
            "robot import a.urdf -o n",
        ),
    }
    made = {name: Case(write=write, codes=(0, 2, 3)) for name, write in cases.items()}
    for name, (file, content, command) in bombs.items():
        others = {"m_yaml": _MAP} if file == "m.pgm" else {}
        made[name] = Case(write=_file(file, content, command, **others), codes=(2, 3))
    disturbed = _copied(
        runs,
        lambda place: (place / "d.yaml").write_text(f"{ALIASES}\nmass: *a11\n"),
        "execute run --disturb d.yaml",
    )
    made["disturbances"] = Case(write=disturbed, codes=(2, 3))
    made["a capsule of deep JSON"] = Case(write=capsule(capsule_json=b"[" * 10**6))
    made["a capsule of 20000 models"] = Case(
        write=_file(
            "c.zip",
            zipped({f"models/a/{number}.xml": b"" for number in range(20_000)}),
            "replay c.zip",
        )
    )
    return made


_MAP = (
    "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def _map(picture: bytes) -> tuple[str, bytes, str]:
    return "m.pgm", picture, "scene import m.yaml -o o.yaml"


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


class _Elements(HTMLParser):
    """Notes whether a page has the element that the mark would be."""

    found = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found = self.found or ("src", "x") in attrs


def _pages_are_clean(place: Path, outcome: Outcome) -> str:
    for page in sorted(place.rglob("*.html")):
        parser = _Elements()
        parser.feed(page.read_text())
        if parser.found:
            return f"{page.relative_to(place)} has the element of a name"
    return ""


def _markup(runs: Path) -> Mapping[str, Case]:
    """Return cases that put markup into every text of every file of a run."""
    cases = {}
    for folder in ("run", "other"):
        for path in sorted((runs / folder).glob("*.json")):
            for way in sorted(_texts(json.loads(path.read_text()))):
                change = partial(_mark, name=f"{folder}/{path.name}", way=way)
                for command in (
                    f"report {folder}",
                    "compare run other -o compare.html",
                ):
                    place = "/".join(map(str, way))
                    cases[f"{command.split()[0]}: {folder}/{path.name} {place}"] = Case(
                        write=_copied(runs, change, command),
                        codes=(0, 2, 3, 4, 5, 6),
                        check=_pages_are_clean,
                    )
    return cases


def _texts(value: Any, way: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    """Return the paths of a document's texts, of lists those of the first entry."""
    if isinstance(value, str):
        return {way}
    if not isinstance(value, (dict, list)):
        return set()
    items = value.items() if isinstance(value, dict) else enumerate(value[:1])
    return {found for key, item in items for found in _texts(item, (*way, key))}


def _mark(place: Path, *, name: str, way: tuple[str | int, ...]) -> None:
    document = json.loads((place / name).read_text())
    parent = document
    for key in way[:-1]:
        parent = parent[key]
    parent[way[-1]] += MARK
    (place / name).write_text(json.dumps(document))


def _markup_of_scenes() -> Mapping[str, Case]:
    scene = yaml.safe_load(SITE)
    changes: Mapping[str, Callable[[Any], None]] = {
        "scene": lambda it: it.update(name=MARK),
        "goal": lambda it: it["goals"][0].update(id=MARK),
        "station": lambda it: it["stations"][0].update(id=MARK),
        "robot": lambda it: it["robots"][0].update(id=MARK),
        "model": lambda it: it["robots"][0].update(model=MARK),
    }
    cases = {}
    for what, change in changes.items():
        document = json.loads(json.dumps(scene))
        change(document)
        text = yaml.safe_dump(document)
        for command in (
            "run s.yaml --no-video --out out",
            "campaign c.yaml --out out",
        ):
            cases[f"{command.split()[0]}: name of a {what}"] = Case(
                write=_file(
                    "s.yaml",
                    text,
                    command,
                    c_yaml=yaml.safe_dump(
                        {"scenes": [{"scene": "s.yaml", "name": f"x{MARK}"}]}
                    ),
                ),
                codes=(0, 2, 3),
                check=_pages_are_clean,
            )
    return cases


SECRET = "the content of a file that is nobody's business"


def _climbing() -> Mapping[str, Case]:
    def outside(place: Path, outcome: Outcome) -> str:
        found = [
            path
            for path in place.parent.rglob("*")
            if path.is_file() and path.name == "climbed"
        ]
        return f"wrote {found[0]}" if found else ""

    cases = {}
    for name in (
        "../climbed",
        "models/../../climbed",
        "/tmp/climbed",
        "models/a/../../../climbed",
        "models\\..\\climbed",
        "C:/climbed",
        "models/",
        "models/./climbed",
        "models//climbed",
        "run.json",
    ):
        member = {name: SECRET.encode()}
        cases[f"a capsule's member {name}"] = Case(
            write=partial(_capsule_with, member), check=outside
        )
    cases["a capsule's member of a link"] = Case(write=_capsule_with_link)
    for key in ("mjcf", "motion_model"):
        for name in (
            "../../../etc/passwd",
            "/etc/passwd",
            "a/../../evil.py",
            "/dev/zero",
        ):
            cases[f"{key} of {name}"] = Case(write=model(**{key: name}))
    for name in ("/dev/zero", "/etc/passwd", "../../../../../../etc/passwd"):
        cases[f"a mesh of {name}"] = Case(write=partial(_mesh, name))
    return cases


def _capsule_with(members: Mapping[str, bytes], place: Path) -> tuple[str, ...]:
    words = capsule()(place)
    content = {"capsule.json": b"{}", **members}
    names = ("scene.yaml", "planning.json", "plan.json", "plan.npz", "last.npz")
    (place / "c.zip").write_bytes(zipped(dict.fromkeys(names, b"{}") | content))
    return words


def _capsule_with_link(place: Path) -> tuple[str, ...]:
    import zipfile

    words = capsule()(place)
    info = zipfile.ZipInfo("models/a/link")
    info.external_attr = 0o120777 << 16
    with zipfile.ZipFile(place / "c.zip", "a") as archive:
        archive.writestr(info, "/etc/passwd")
    return words


def _mesh(name: str, place: Path) -> tuple[str, ...]:
    words = model()(place)
    file = place / "mine" / "car.xml"
    mesh = f'<asset><mesh name="m" file="{name}"/></asset><asset>'
    file.write_text(file.read_text().replace("<asset>", mesh, 1))
    return words


def _code(runs: Path) -> Mapping[str, Case]:
    evil = "open('ran', 'w').write('yes')\ndef plan(*a, **k): ...\n"

    def stayed(place: Path, outcome: Outcome) -> str:
        found = [*place.rglob("ran")]
        return f"code ran: {found[0].relative_to(place)}" if found else ""

    def ran(place: Path, outcome: Outcome) -> str:
        return "" if [*place.rglob("ran")] else "did not run though trusted"

    def with_argument(name: str, value: str, place: Path) -> None:
        for folder in (place, place / "run"):
            (folder / "evil.py").write_text(evil)
        record = json.loads((place / "run" / "run.json").read_text())
        record["arguments"][name] = value
        (place / "run" / "run.json").write_text(json.dumps(record))

    cases = {}
    for name in ("planner", "router", "controller"):
        for value in ("evil:plan", "evil.py:plan", "evil.py", "os:getcwd"):
            for command in ("report run", "execute run --overwrite", "verify run"):
                change = partial(with_argument, name, value)
                cases[f"{command}: {name} {value} in run.json"] = Case(
                    write=_copied(runs, change, command),
                    codes=(0, 2, 3, 6),
                    check=stayed,
                )
            key = f"{name}s: [{value!r}]"
            cases[f"campaign: {key}"] = Case(
                write=_file(
                    "c.yaml",
                    f"scenes: [quickstart]\n{key}\n",
                    "campaign c.yaml",
                    evil_py=evil,
                ),
                codes=(2, 3),
                check=stayed,
            )
    tag = "!!python/object/apply:builtins.open [ran, w]"
    for file, command in (
        ("s.yaml", "scene check s.yaml"),
        ("m.yaml", "scene import m.yaml -o o.yaml"),
        ("c.yaml", "campaign c.yaml"),
    ):
        cases[f"a tag of Python in {file}"] = Case(
            write=_file(file, f"format: {tag}\nscenes: {tag}\nimage: {tag}\n", command),
            check=stayed,
        )
    expression = "${__import__('pathlib').Path('ran').touch()}"
    xacro = URDF.replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    cases["an expression of xacro"] = Case(
        write=_file(
            "a.xacro",
            xacro.replace('mass value="40"', f'mass value="{expression}"'),
            "robot import a.xacro -o new",
        ),
        check=stayed,
    )
    cases["a pickle in plan.npz"] = Case(
        write=_copied(runs, _pickled, "verify run"), check=stayed
    )
    own = partial(_own_motion, evil)
    cases["motion of a model"] = Case(write=own, check=stayed)
    cases["motion of a model, trusted"] = Case(
        write=lambda place: (*own(place), "--trust-code"),
        codes=(0, 3),
        leaves=True,
        check=ran,
    )
    return cases


class _Touch:
    def __reduce__(self) -> tuple[Any, ...]:
        return open, ("ran", "w")


def _pickled(place: Path) -> None:
    array = claimed_array("(1,)", "|O", pickle.dumps([_Touch()]))
    (place / "run" / "plan.npz").write_bytes(zipped({"r1.state.npy": array}))


def _own_motion(evil: str, place: Path) -> tuple[str, ...]:
    shutil.copytree(shipped.models_folder() / "car", place / "mine")
    file = place / "mine" / "robot.yaml"
    text = file.read_text().replace("motion_model: car", "motion_model: evil.py")
    file.write_text(text)
    (place / "mine" / "evil.py").write_text(evil)
    (place / "s.yaml").write_text(SCENE.replace("model: car", "model: ./mine"))
    return ("scene", "check", "s.yaml")
