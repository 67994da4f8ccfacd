"""The MJCF file of an imported robot: the parts that the simulation drives by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mrmg.scene.importing.robots.parameters import Parameter
from mrmg.scene.importing.robots.survey import Survey
from mrmg.templates import rendered

_RATE_RAD_S = 150.0
"""Bandwidth of the servos of steered wheels, critically damped."""

_GAP_SHARE = 0.04
"""Height of the support that carries nothing, as a share of the wheels' radius."""


class DrawnGeom(NamedTuple):
    """A geom that is only drawn.

    Attributes:
        type: as MJCF calls it.
        size: as MJCF has it; of a mesh without meaning.
        pos: relative to its wheel, or to the chassis [m].
        quat: its turn.
        mesh: name of its mesh, if it is one.
    """

    type: str
    size: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    mesh: str | None


def mjcf_text(
    name: str,
    source: str,
    found: Survey,
    values: Mapping[str, Parameter],
    drawn: Mapping[int, Sequence[DrawnGeom]],
) -> str:
    """Return the MJCF file of a robot.

    Args:
        name: of the model.
        source: name of the description.
        found: measurements.
        values: parameters of `robot.yaml`.
        drawn: geoms by index of the wheel they turn with; -1 for the chassis.
    """
    outline = np.array(values["footprint"].value)
    low, high = outline.min(axis=0), outline.max(axis=0)
    radius, height = values["wheel.radius"].value, values["height"].value
    support_m, reach = min(0.4 * radius, 0.4 * height), values["wheelbase"].value
    lift_m, ahead = _GAP_SHARE * radius, found.lead_m >= 0.0
    supports = [
        ("front", min(reach, high[0] - support_m), 0.0 if ahead else lift_m),
        ("rear", -min(reach, -low[0] - support_m), lift_m if ahead else 0.0),
    ]
    names = ("rl", "rr", "fl", "fr") if found.steered else ("l", "r")
    servo = max((wheel.inertia[1] for wheel in found.steered), default=0.0)
    return rendered(
        __package__,
        "robot.xml.jinja",
        {"row": _row, "number": "{:.9g}".format},
        name=name,
        source=source.replace("--", "- -"),
        found=found,
        values=values,
        radius=radius,
        inertia=found.chassis[2][[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        half_m=[*(high - low) / 2, height / 2],
        middle_m=[*(high + low) / 2, height / 2],
        supports=[] if found.steered else supports,
        support_m=support_m,
        wheels=dict(zip(names, (*found.driven, *found.steered), strict=True)),
        stiffness=servo * _RATE_RAD_S**2,
        damping=2 * servo * _RATE_RAD_S,
        drawn=drawn,
        meshes=dict.fromkeys(geom.mesh for own in drawn.values() for geom in own),
    )


def _row(values: Any) -> str:
    return " ".join(f"{float(value) + 0.0:.9g}" for value in values)
