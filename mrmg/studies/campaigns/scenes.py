"""Scenes of trials: as they are, or made anew for each seed, on whatever machine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from mrmg import storage
from mrmg.errors import SceneError
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.loading.carrying import SCENE_FILE, carried_files
from mrmg.scene.loading.yaml_text import parse_yaml
from mrmg.scene.populating.populate import populate
from mrmg.scene.types import Scene
from mrmg.seeding import stream

_Entry = dict[str, Any]

_MOST_DRAWS = 100
"""How often what makes a perturbed scene invalid is drawn anew."""

_MOVED = {
    "goals": "goals",
    "stations": "stations",
    "obstacles": "obstacles",
    "robots": "starts",
}
"""Sections of a scene, and what a perturbation calls how far their entries move."""


@dataclass(frozen=True, kw_only=True)
class SceneSource:
    """What the scenes of trials are made from; holds all files that they need.

    Attributes:
        name: what tables call it.
        digest: of the scene in `files`.
        files: the scene with its models, by path (`scene.loading.carrying`).
        populate: keywords of `populate` for a mission that is placed; its `seed` is
            None where each trial's counts.
        perturb: amounts by which what the scene has is moved; `seed` as above.
        trust_code: whether its robot models may run Python code that they bring.
    """

    name: str
    digest: str
    files: Mapping[str, bytes] = field(repr=False)
    populate: Mapping[str, Any] | None
    perturb: Mapping[str, Any] | None
    trust_code: bool

    @staticmethod
    def of(
        entry: Mapping[str, Any], path: Path, models: Path, *, trust_code: bool
    ) -> SceneSource:
        """Return the source of a campaign's entry.

        Args:
            entry: as the campaign file has it, with all keys.
            path: of the scene file.
            models: folder that a placed robot's model is relative to.
            trust_code: whether robot models may bring Python code.

        Raises:
            SceneError: if the scene, or what is changed of it, is invalid.
            UsageError: if the map has no room for the mission that is to be placed.
        """
        scene = load_scene(path, trust_code=trust_code)
        if entry["change"]:
            scene = scene.with_(trust_code=trust_code, **entry["change"])
        placed = entry["populate"]
        if placed:
            model = placed["model"]
            if "/" in model:
                beside = models / model
                model = str((beside if beside.exists() else Path(model)).resolve())
            first = {**placed, "model": model, "seed": placed["seed"] or 0}
            scene = populate(scene, trust_code=trust_code, **first)
        return SceneSource(
            name=entry["name"] or scene.name,
            digest=scene.digest,
            files=carried_files(scene),
            populate=placed,
            perturb=entry["perturb"],
            trust_code=scene.has_custom_motion,
        )

    def content(self) -> list[Any]:
        """Return what decides the scenes, as JSON data."""
        return [self.digest, self.populate, self.perturb]

    def scene(self, seed: int, changes: Mapping[str, Any]) -> Scene:
        """Return the scene of a trial.

        Args:
            seed: of the trial.
            changes: keys of the scene file with other values.

        Raises:
            SceneError, UsageError: if there is none.
        """
        scene = loaded_scene(self)
        if self.populate:
            model = scene.robots[0].model.origin
            own = {"model": model.reference} if model else {}
            recipe = _seeded(self.populate, seed) | own
            scene = populate(scene, trust_code=self.trust_code, **recipe)
        if self.perturb:
            scene = perturbed(scene, self.perturb, _seeded(self.perturb, seed)["seed"])
        return scene.with_(**changes) if changes else scene

    def __hash__(self) -> int:
        return hash((self.name, self.digest))


def _seeded(recipe: Mapping[str, Any], seed: int) -> _Entry:
    return {**recipe, "seed": seed if recipe["seed"] is None else recipe["seed"]}


@lru_cache(maxsize=4)
def loaded_scene(source: SceneSource) -> Scene:
    """Return the scene of a source's files.

    Models of the user's own need a folder: there is one for each in the user's cache.
    """
    if len(source.files) == 1:
        document = parse_yaml(source.files[SCENE_FILE].decode(), source=source.name)
        return scene_from_document(document, source=source.name)
    folder = storage.user_cache_folder() / "scenes" / source.digest
    for name, content in source.files.items():
        storage.write_bytes(folder / name, content)
    return load_scene(folder / SCENE_FILE, trust_code=source.trust_code)


def perturbed(scene: Scene, reach: Mapping[str, float], seed: int) -> Scene:
    """Return a valid scene in which everything lies a little elsewhere.

    Entries that make the scene invalid are drawn anew.

    Args:
        scene: what is perturbed.
        reach: how far `goals`, `stations`, `obstacles` and `starts` are moved at most
            [m], and starts are turned (`headings`) [deg]; what is left out stays.
        seed: of the draws.

    Raises:
        SceneError: if no draws gave a valid scene.
    """
    rng = stream(seed, "perturb")
    before = scene.document
    turn_rad = math.radians(reach.get("headings", 0.0))
    movable = [
        (section, number)
        for section, name in _MOVED.items()
        for number in range(len(before.get(section, ())))
        if reach.get(name, 0.0) > 0.0 or (section == "robots" and turn_rad > 0.0)
    ]
    entries: dict[str, Any] = {section: [*before[section]] for section, _ in movable}
    pending = movable
    for draw in range(_MOST_DRAWS):
        for section, number in pending:
            entry = before[section][number]
            by_m = _offset(rng, reach.get(_MOVED[section], 0.0))
            turn = turn_rad * rng.uniform(-1.0, 1.0)
            entries[section][number] = _moved(entry, by_m, turn)
        try:
            return scene.with_(**entries)
        except SceneError as error:
            if draw == _MOST_DRAWS - 1:
                raise
            at_fault = {tuple(fault.path.split(".")[:2]) for fault in error.faults}
            named = [at for at in movable if (at[0], str(at[1])) in at_fault]
            pending = named or movable
    raise AssertionError("a perturbed scene is returned or refused")


def _offset(rng: np.random.Generator, reach_m: float) -> np.ndarray:
    """Return a point of the disc about the origin, drawn evenly [m], shape (2,)."""
    angle, distance_m = rng.uniform(0.0, math.tau), reach_m * math.sqrt(rng.uniform())
    return distance_m * np.array([math.cos(angle), math.sin(angle)])


def _moved(entry: _Entry, by_m: np.ndarray, turn: float) -> _Entry:
    """Return an entry of a scene file that is moved; a robot's start is turned, too."""

    def point(given: list[float]) -> list[float]:
        return [float(value) for value in np.add(given[:2], by_m)]

    if "pose" in entry:
        return {**entry, "pose": [*point(entry["pose"]), entry["pose"][2] + turn]}
    if "polygon" in entry:
        holes = [
            [point(corner) for corner in ring] for ring in entry.get("holes") or ()
        ]
        ring = [point(corner) for corner in entry["polygon"]]
        return {**entry, "polygon": ring, **({"holes": holes} if holes else {})}
    kind = "box" if "box" in entry else "circle"
    return {**entry, kind: {**entry[kind], "center": point(entry[kind]["center"])}}
