"""The MJCF file of an imported robot: the parts that the simulation drives by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mrmg.scene.importing.robots.parameters import Parameter
from mrmg.scene.importing.robots.survey import Survey, Wheel

_RATE_RAD_S = 150.0
"""Bandwidth of the servos of steered wheels, critically damped."""

_GAP_SHARE = 0.04
"""Height of the support that carries nothing, as a share of the wheels' radius."""

_HEAD = """\
<!-- {name}: imported from {source}; robot.yaml has the same masses, lengths, limits.
     Frame: the chassis' origin is the middle of the driven axle on the ground, x
     forward, y left. Spheres inside the wheels touch the floor; the hull, which is the
     footprint, extruded, touches obstacles and hulls. Groups: 1 drawn, 3 hidden. -->
<mujoco model="{name}">
  <compiler angle="radian" autolimits="true" balanceinertia="true"/>
  <custom>
    <!-- what the tyres really lose, over the weight; robot.yaml: what is believed -->
    <numeric name="rolling_coefficient" data="{rolling:g}"/>
    <numeric name="turning_coefficient" data="{turning:g}"/>
  </custom>
  <default>
    <geom contype="0" conaffinity="0" mass="0" group="1"/>
    <joint damping="0" limited="false"/>
    <default class="tyre">
      <geom type="sphere" size="{radius:g}" conaffinity="1" condim="3" priority="1"
            friction="{friction:g} 0.005 0.0001" solref="0.008 1" group="3"/>
    </default>
    <default class="support">
      <geom type="sphere" conaffinity="1" condim="1" priority="1" solref="0.008 1"
            group="3"/>
    </default>
  </default>
  <asset>
    <material name="paint" rgba="0.0 0.45 0.70 1" specular="0.2" shininess="0.4"/>
    <material name="rubber" rgba="0.10 0.10 0.11 1" specular="0"/>
"""


def mjcf_text(
    name: str,
    source: str,
    found: Survey,
    values: Mapping[str, Parameter],
    drawn: Mapping[int, Sequence[str]],
    assets: Sequence[str],
) -> str:
    """Return the MJCF file of a robot.

    Args:
        name: of the model.
        source: name of the description.
        found: measurements.
        values: parameters of `robot.yaml`.
        drawn: geoms by index of the wheel they turn with; -1 for the chassis.
        assets: meshes.
    """
    rolling = values["rolling_coefficient"].value
    head = _HEAD.format(
        name=name,
        source=source.replace("--", "- -"),
        rolling=rolling,
        turning=values["turning_coefficient"].value,
        radius=values["wheel.radius"].value,
        friction=values["friction_coefficient"].value,
    )
    wheels = (*found.driven, *found.steered)
    is_car = bool(found.steered)
    names = ("rl", "rr", "fl", "fr") if is_car else ("l", "r")
    lines = [f"    {line}" for line in assets]
    lines += ["  </asset>", "  <worldbody>", '    <body name="chassis">']
    lines += [f"      {line}" for line in _chassis(found, values, is_car)]
    lines += [f"      {line}" for line in drawn.get(-1, ())]
    for index, (wheel, own) in enumerate(zip(wheels, names, strict=True)):
        steering = is_car and index > 1
        lines += _wheel(own, wheel, steering, drawn.get(index, ()))
    lines += ["    </body>", "  </worldbody>"]
    return head + "\n".join([*lines, *_drive(found, values, rolling), "</mujoco>", ""])


def _chassis(found: Survey, values: Mapping[str, Parameter], is_car: bool) -> list[str]:
    mass, center, inertia = found.chassis
    outline = np.array(values["footprint"].value)
    low, high = outline.min(axis=0), outline.max(axis=0)
    half, middle = (high - low) / 2, (high + low) / 2
    top = values["height"].value
    six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    lines = [
        '<freejoint name="root"/>',
        f'<inertial pos="{_row(center)}" mass="{mass:.9g}" fullinertia="{_row(six)}"/>',
        f'<geom name="hull" type="box" pos="{_row([*middle, top / 2])}"',
        f'      size="{_row([*half, top / 2])}" contype="2" conaffinity="6"',
        '      friction="0.4" solref="0.02 1" group="3"/>',
    ]
    if is_car:
        return lines
    # Without friction, as casters that swivel at once. One carries its share of the
    # weight; the other one, a little higher, keeps the robot from tipping.
    radius = values["wheel.radius"].value
    size = min(0.4 * radius, 0.4 * top)
    ahead = found.lead_m >= 0.0
    reach = values["wheelbase"].value
    for name, x, low_end in (
        ("support_front", min(reach, high[0] - size), ahead),
        ("support_rear", -min(reach, -low[0] - size), not ahead),
    ):
        lift = 0.0 if low_end else _GAP_SHARE * radius
        lines.append(
            f'<geom name="{name}" class="support" size="{size:.6g}" '
            f'pos="{_row([x, 0.0, size + lift])}"/>'
        )
    return lines


def _wheel(own: str, wheel: Wheel, steering: bool, drawn: Sequence[str]) -> list[str]:
    spin, across = wheel.inertia
    lines = [
        f'<body name="wheel_{own}" pos="{_row(wheel.place_m)}">',
        f'  <inertial pos="0 0 0" mass="{wheel.mass_kg:.9g}" '
        f'diaginertia="{_row([across, spin, across])}"/>',
    ]
    if steering:
        lines.append(
            f'  <joint name="steer_{own}" axis="0 0 1" limited="true" '
            'range="-1.5 1.5"/>'
        )
    lines += [
        f'  <joint name="spin_{own}" axis="0 1 0" armature="{wheel.armature:.9g}"/>',
        f'  <geom name="tyre_{own}" class="tyre"/>',
        *(f"  {line}" for line in drawn),
        "</body>",
    ]
    return [f"      {line}" for line in lines]


def _drive(found: Survey, values: Mapping[str, Parameter], rolling: float) -> list[str]:
    radius = values["wheel.radius"].value
    if not found.steered:
        return [
            "  <tendon>",
            "    <!-- ways rolled: of the axle's middle, and right wheel less left -->",
            '    <fixed name="axle" frictionloss="1" solreffriction="0.008 1">',
            f'      <joint joint="spin_l" coef="{radius / 2:.9g}"/>',
            f'      <joint joint="spin_r" coef="{radius / 2:.9g}"/>',
            "    </fixed>",
            '    <fixed name="swing" frictionloss="1" solreffriction="0.008 1">',
            f'      <joint joint="spin_l" coef="{-radius:.9g}"/>',
            f'      <joint joint="spin_r" coef="{radius:.9g}"/>',
            "    </fixed>",
            "  </tendon>",
            "  <actuator>",
            f'    <motor name="drive_l" joint="spin_l" gear="{radius:.9g}"/>',
            f'    <motor name="drive_r" joint="spin_r" gear="{radius:.9g}"/>',
            "  </actuator>",
        ]
    inertia = max(wheel.inertia[1] for wheel in found.steered)
    gains = f'kp="{inertia * _RATE_RAD_S**2:.6g}" kv="{2 * inertia * _RATE_RAD_S:.6g}"'
    servos = [
        f'    <position name="steer_{side}" joint="steer_f{side}" {gains} '
        'ctrlrange="-1.5 1.5"/>'
        for side in "lr"
    ]
    return [
        "  <tendon>",
        "    <!-- way rolled by the driven axle: an open differential -->",
        '    <fixed name="axle">',
        f'      <joint joint="spin_rl" coef="{radius / 2:.9g}"/>',
        f'      <joint joint="spin_rr" coef="{radius / 2:.9g}"/>',
        "    </fixed>",
        "  </tendon>",
        "  <actuator>",
        *servos,
        '    <motor name="drive" tendon="axle" gear="1"/>',
        "  </actuator>",
    ]


def _row(values: Any) -> str:
    return " ".join(f"{float(value) + 0.0:.9g}" for value in values)
