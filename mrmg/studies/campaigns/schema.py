"""What a campaign file may say.

    scenes:                      # shipped names, files, or scenes made from one
      - quickstart
      - {scene: hall.yaml, name: hall, populate: {robots: 2, goals: 6, stations: 2}}
      - {scene: scene1, perturb: {goals: 0.5, starts: 0.3, headings: 10}}
      - {scene: scene4, change: {battery: {capacity_m: 300}}}
    seeds: 0-49                  # or a list; default 0
    planners: [path_following, guided_tree]
    routers: [search, exact]
    controllers: [mpc, tvlqr]
    plants: [default, scrub]
    disturbances: [none, default, rolling=+30%]
    parameters:                  # every combination of their values
      soc_margin: [0, 0.1]
      battery.capacity_m: [200, 300]

There is a trial for every combination. Only `scenes` is needed; a key that is left out,
and the word `default`, stand for what `mrmg run` does without its option.

- Files are relative to the campaign file, or else to the working directory.
- A trial's seed is that of its plan, of what is drawn from its disturbance, and of
  scenes that are made: `populate` places a mission as `mrmg scene populate` does, and
  `perturb` moves goals, stations, starts and obstacles by up to so many metres in any
  direction and turns starts by up to `headings` degrees, in a way that leaves the scene
  valid. With a `seed` of their own they make one scene for all trials.
- `change` replaces keys of the scene file, as `Scene.with_` does.
- `disturbances` are as `--disturb` takes them; `none` is an undisturbed drive.
- `parameters` are options of `mrmg run` without their dashes, or keys of the scene
  file, dotted where they are inside others.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from mrmg.runs import argument_values as values
from mrmg.scene.loading.json_schema import schema_of
from mrmg.scene.loading.shape_schema import NotNegative, Strict

MOST_TRIALS = 100_000

Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0)]


def _listed(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _seeds(value: Any) -> Any:
    """Return a list of seeds; `0-49` is one of fifty."""
    if isinstance(value, str):
        first, _, last = value.partition("-")
        try:
            ends = values.seed(first), values.seed(last or first)
        except ValueError:
            return value
        if ends[0] > ends[1]:
            raise PydanticCustomError("falling", "a range that does not fall")
        if ends[1] - ends[0] >= MOST_TRIALS:
            most = f"a range of at most {MOST_TRIALS} seeds"
            raise PydanticCustomError("too_many", most)
        return list(range(ends[0], ends[1] + 1))
    return _listed(value) if isinstance(value, int) else value


def _scene(value: Any) -> Any:
    return {"scene": value} if isinstance(value, str) else value


Names = Annotated[
    list[str],
    BeforeValidator(_listed, json_schema_input_type=str | list[str]),
    Field(min_length=1),
]


class PopulateEntry(Strict):
    """Robots, goals and stations that are placed on a map."""

    robots: Count = 2
    """how many, at least 1"""
    goals: Count = 14
    """how many, at least 1"""
    stations: Count = 5
    """how many, at least 1"""
    model: str = "car"
    """a shipped model, or a folder"""
    seed: Seed | None = None
    """one seed for all trials, in place of each trial's"""


class PerturbEntry(Strict):
    """How far what a scene has is moved."""

    goals: NotNegative = 0.0
    """largest distance in m"""
    stations: NotNegative = 0.0
    """largest distance in m"""
    starts: NotNegative = 0.0
    """largest distance in m"""
    headings: NotNegative = 0.0
    """largest turn in degrees"""
    obstacles: NotNegative = 0.0
    """largest distance in m"""
    seed: Seed | None = None
    """one seed for all trials, in place of each trial's"""


class SourceEntry(Strict):
    """A scene, or how one is made from another."""

    scene: str
    """path of a scene file, or name of a shipped scene"""
    name: str | None = None
    """what tables call it"""
    change: dict[str, Any] | None = None
    """keys of the scene file with other values"""
    populate: PopulateEntry | None = None
    """places a mission on the map, anew for each seed"""
    perturb: PerturbEntry | None = None
    """moves what the scene has, anew for each seed"""


Source = Annotated[
    SourceEntry, BeforeValidator(_scene, json_schema_input_type=str | SourceEntry)
]


class CampaignDocument(Strict):
    """Factors of a campaign, with the values each of them takes."""

    scenes: Annotated[
        list[Source],
        BeforeValidator(_listed, json_schema_input_type=Source | list[Source]),
        Field(min_length=1),
    ]
    """at least one scene"""
    seeds: Annotated[
        list[Seed],
        BeforeValidator(_seeds, json_schema_input_type=int | str | list[Seed]),
        Field(min_length=1),
    ] = [0]
    """whole numbers of at least 0, or a range such as 0-49"""
    planners: Names = ["default"]
    """names of planners"""
    routers: Names = ["default"]
    """names of routers"""
    controllers: Names = ["default"]
    """names of controllers"""
    plants: Names = ["default"]
    """ground contacts"""
    disturbances: Names = ["none"]
    """none, default, or as --disturb takes them"""
    parameters: dict[
        str,
        Annotated[
            list[Any],
            BeforeValidator(_listed, json_schema_input_type=Any),
            Field(min_length=1),
        ],
    ] = {}
    """options of mrmg run, each with its values"""


def campaign_schema() -> dict[str, Any]:
    """Return the format of campaign files as a JSON Schema, for editors."""
    return schema_of(CampaignDocument)
