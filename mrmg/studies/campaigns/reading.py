"""From a campaign file to its trials, or to the list of everything wrong with it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mrmg import extensions, shipped, storage
from mrmg.errors import Fault, FileError, MrmgError, UsageError, nearest
from mrmg.runs.arguments import RunArguments, keyword
from mrmg.runs.code_digest import code_digest
from mrmg.runs.options import options_of
from mrmg.scene.loading.faults import faults_of, shown
from mrmg.scene.loading.places import composed, line_at
from mrmg.scene.loading.reading import scene_path
from mrmg.scene.loading.schema import SceneDocument
from mrmg.scene.loading.yaml_text import read_yaml
from mrmg.simulation.controller import controller_names
from mrmg.simulation.disturbance_spec import written_out
from mrmg.studies.campaigns.scenes import SceneSource, loaded_scene
from mrmg.studies.campaigns.schema import MOST_TRIALS, CampaignDocument
from mrmg.studies.campaigns.trial import TrialOrder

DEFAULT, UNDISTURBED = "default", "none"

_METHODS = {
    "planner": "planners",
    "router": "routers",
    "controller": "controllers",
    "plant": "plants",
}
"""Options of a run with a key of their own, whose values are names."""

_OWN_KEYS = {**_METHODS, "seed": "seeds", "disturb": "disturbances"}
"""Options of a run that are no parameters, as a key of the campaign is for them."""

_CHOICES = {each.name: each.choices or () for each in options_of(RunArguments)}


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignTrial:
    """One combination of the values of all factors.

    Attributes:
        factors: value of each factor, as tables show it.
        source: of its scene.
        order: what is made.
        key: fingerprint of all that decides the result; names its files.
    """

    factors: Mapping[str, str | int | float | bool]
    source: SceneSource
    order: TrialOrder
    key: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """What a campaign file states.

    Attributes:
        name: of the file.
        document: its content, complete.
        trials: in the order of the file.
    """

    name: str
    document: Mapping[str, Any]
    trials: tuple[CampaignTrial, ...]


def read_campaign(
    path: Path, *, trust_code: bool = False, with_runs: bool = False
) -> Campaign:
    """Read a campaign file.

    Args:
        path: of the file.
        trust_code: whether robot models may bring Python code (`loading.trust`).
        with_runs: whether trials leave run folders.

    Raises:
        FileError: naming every fault of the file.
    """
    if not path.is_file():
        found = "is a folder" if path.is_dir() else "no such file"
        raise FileError(str(path), [Fault("", f"{found}; expected a campaign file")])
    document, faults = _well_formed(read_yaml(path, source=str(path)))
    factors = _Factors(document, path.parent)
    faults += factors.faults()
    sources: list[SceneSource] = []
    for number, entry in enumerate(document["scenes"]):
        try:
            sources.append(factors.source(entry, trust_code))
        except MrmgError as error:
            faults += _scene_faults(f"scenes.{number}", error)
    names = [source.name for source in sources]
    faults += _repeated("scenes", names, "give one of them another name")
    faults += factors.scene_faults(sources)
    if faults:
        raise _refused(path, faults)
    try:
        trials = tuple(factors.trials(sources, with_runs))
    except UsageError as error:
        raise _refused(path, [Fault("parameters", str(error))]) from error
    return Campaign(name=path.stem, document=document, trials=trials)


def _well_formed(content: Any) -> tuple[dict[str, Any], list[Fault]]:
    """Return the well-formed part of a file's content, and the faults of the rest."""
    try:
        return CampaignDocument.model_validate(content).model_dump(), []
    except ValidationError as error:
        faults = list(faults_of(error, CampaignDocument))
    wrong = {fault.path.partition(".")[0] for fault in faults}
    given = content if isinstance(content, dict) else {}
    rest = {key: value for key, value in given.items() if str(key) not in wrong}
    document = CampaignDocument.model_validate({"scenes": ["quickstart"], **rest})
    lacking: dict[str, Any] = {} if "scenes" in rest else {"scenes": []}
    return document.model_dump() | lacking, faults


def _refused(path: Path, faults: Sequence[Fault]) -> FileError:
    root = composed(path)
    lined = [replace(fault, line=line_at(root, fault.path)) for fault in faults]
    return FileError(str(path), sorted(lined, key=lambda fault: fault.line or 0))


def _scene_faults(place: str, error: MrmgError) -> list[Fault]:
    if isinstance(error, FileError):
        return [Fault(place, f"{error.source}: {fault}") for fault in error.faults]
    return [Fault(place, str(error))]


def _repeated(
    place: str, names: Sequence[Any], remedy: str = "leave it out"
) -> Iterator[Fault]:
    seen: set[str] = set()
    for number, name in enumerate(names):
        if repr(name) in seen:
            message = f"{shown(name)} is given twice; {remedy}"
            yield Fault(f"{place}.{number}", message)
        seen.add(repr(name))


class _Factors:
    """The factors of a campaign, and what of their values is allowed."""

    def __init__(self, document: Mapping[str, Any], base: Path) -> None:
        self._document = document
        self._base = base
        self._parameters: dict[str, list[Any]] = document["parameters"]

    def faults(self) -> Iterator[Fault]:
        """Yield what is wrong, scenes apart."""
        document = self._document
        allowed = {
            "planners": extensions.names(extensions.PLANNERS),
            "routers": extensions.names(extensions.ROUTERS),
            "controllers": controller_names(),
            "plants": _CHOICES["plant"],
        }
        for key, names in allowed.items():
            known = list(dict.fromkeys([DEFAULT, *names]))
            for number, name in enumerate(document[key]):
                if name not in known:
                    message = (
                        f"got {shown(name)}{nearest(name, known)}; allowed: "
                        f"{', '.join(known)}"
                    )
                    yield Fault(f"{key}.{number}", message)
        for number, spec in enumerate(document["disturbances"]):
            try:
                self._disturb(spec)
            except MrmgError as error:
                yield Fault(f"disturbances.{number}", str(error))
        for key in (*allowed, "seeds", "disturbances"):
            yield from _repeated(key, document[key])
        yield from self._faults_of_parameters()
        factors = {**document, **self._parameters, "parameters": [1]}
        count = prod(map(len, factors.values()))
        if count > MOST_TRIALS:
            message = f"these are {count} trials; allowed: {MOST_TRIALS} in a campaign"
            yield Fault("", message)

    def _faults_of_parameters(self) -> Iterator[Fault]:
        options = [
            each.name
            for each in options_of(RunArguments)
            if each.decides and each.name not in _OWN_KEYS
        ]
        for name, levels in self._parameters.items():
            place, option = f"parameters.{name}", keyword(name)
            yield from _repeated(place, levels)
            for outer in self._parameters:
                if name.startswith(f"{outer}."):
                    yield Fault(place, f"is part of {outer}, which is given, too")
            if option in _OWN_KEYS:
                yield Fault(place, f"has a key of its own: {_OWN_KEYS[option]}")
            elif option in options:
                for number, value in enumerate(levels):
                    try:
                        RunArguments(**{option: value})
                    except (UsageError, TypeError) as error:
                        yield Fault(f"{place}.{number}", str(error))
            elif not self._is_of_scene(name):
                known = [*options, *sorted(SceneDocument.model_fields)]
                message = (
                    f"unknown parameter{nearest(name, known)}; allowed: options of a "
                    f"run ({', '.join(options)}) and keys of the scene file, such as "
                    "battery.capacity_m"
                )
                yield Fault(place, message)

    @staticmethod
    def _is_of_scene(name: str) -> bool:
        fields = {*SceneDocument.model_fields} - {"format", "name"}
        return keyword(name) not in _CHOICES and name.partition(".")[0] in fields

    def scene_faults(self, sources: Sequence[SceneSource]) -> Iterator[Fault]:
        """Yield which values of scene keys make which scenes invalid."""
        for name, levels in self._parameters.items():
            for number, value in enumerate(levels if self._is_of_scene(name) else ()):
                for source in sources:
                    try:
                        loaded_scene(source).with_(**_nested({name: value}))
                    except MrmgError as error:
                        yield from _scene_faults(f"parameters.{name}.{number}", error)

    def source(self, entry: Mapping[str, Any], trust_code: bool) -> SceneSource:
        """Return the source of an entry of `scenes`."""
        path = Path(entry["scene"])
        if str(path) not in shipped.scene_names():
            path = self._file(path)
        return SceneSource.of(
            entry, scene_path(path), self._base, trust_code=trust_code
        )

    def _file(self, path: Path) -> Path:
        """Return a file beside the campaign's, or else of the working directory."""
        beside = self._base / path
        return beside if beside.exists() else path

    def _disturb(self, spec: str) -> str | None:
        """Return the disturbance of a run."""
        if spec == UNDISTURBED:
            return None
        if spec.endswith((".yaml", ".yml")):
            spec = str(self._file(Path(spec)))
        return written_out("" if spec == DEFAULT else spec)

    def trials(
        self, sources: Sequence[SceneSource], with_runs: bool
    ) -> Iterator[CampaignTrial]:
        """Yield every combination of the values of all factors."""
        document = self._document
        disturb = {spec: self._disturb(spec) for spec in document["disturbances"]}
        of_scene = {name for name in self._parameters if self._is_of_scene(name)}
        levels = {
            "scene": sources,
            "seed": document["seeds"],
            **{name: document[key] for name, key in _METHODS.items()},
            "disturbance": document["disturbances"],
            **self._parameters,
        }
        for values in product(*levels.values()):
            chosen = dict(zip(levels, values, strict=True))
            source, seed = chosen["scene"], chosen["seed"]
            named: dict[str, Any] = {"disturb_seed": seed}
            for name in (*_METHODS, *self._parameters):
                if name not in of_scene and not (
                    name in _METHODS and chosen[name] == DEFAULT
                ):
                    named[keyword(name)] = chosen[name]
            arguments = RunArguments(
                seed=seed, disturb=disturb[chosen["disturbance"]], **named
            )
            order = TrialOrder(
                arguments=arguments,
                changes=_nested({name: chosen[name] for name in of_scene}),
                code=code_digest(),
                with_run=with_runs,
            )
            chosen["scene"] = source.name
            yield CampaignTrial(
                factors={name: _plain(value) for name, value in chosen.items()},
                source=source,
                order=order,
                key=_key(source, order),
            )


def _key(source: SceneSource, order: TrialOrder) -> str:
    arguments = order.arguments
    deciding = [arguments.planning(), *map(arguments.deciding, ("drive", "audit"))]
    content = [source.content(), deciding, order.changes, order.code]
    return storage.digest(storage.canonical_json(content))


def _nested(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return keys of a scene file that are dotted as mappings inside each other."""
    nested: dict[str, Any] = {}
    for name, value in changes.items():
        *outer, last = name.split(".")
        place = nested
        for key in outer:
            place = place.setdefault(key, {})
        place[last] = value
    return nested


def _plain(value: Any) -> str | int | float | bool:
    """Return a value as one cell of a table."""
    if isinstance(value, str | int | float):
        return value
    return json.dumps(value, sort_keys=True)
