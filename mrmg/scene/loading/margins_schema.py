"""Margins and tracking errors, as scene files and `robot.yaml` state them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from mrmg.scene.loading.shape_schema import NotNegative, Strict
from mrmg.scene.margins import LARGEST_M, Margins, TrackingError

FromObstacles = Annotated[
    float, Field(ge=0, le=LARGEST_M["obstacle"], allow_inf_nan=False)
]
FromRobots = Annotated[float, Field(ge=0, le=LARGEST_M["robot"], allow_inf_nan=False)]


class MarginsEntry(Strict):
    """Distances that plans keep; what is left out follows from the robot's model."""

    obstacle: FromObstacles | None = None
    """distance from obstacles and bounds in m, 0..1"""
    robot: FromRobots | None = None
    """distance from other robots in m, 0..2"""

    @property
    def margins(self) -> Margins:
        """The margins as a value."""
        return Margins(obstacle_m=self.obstacle, robot_m=self.robot)


class TrackingErrorEntry(Strict):
    """The largest tracking errors shown in MuJoCo."""

    nominal: NotNegative
    """in m, of a drive as modelled"""
    disturbed: NotNegative
    """in m, under default disturbances"""

    @property
    def value(self) -> TrackingError:
        """The errors as a value."""
        return TrackingError(nominal_m=self.nominal, disturbed_m=self.disturbed)
