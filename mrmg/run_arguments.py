"""What a run is started with, and what its folder remembers of that."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoArguments:
    """How the video is made.

    Attributes:
        view: "top", "chase" or "split".
        speed: simulated seconds shown per second; None fits the mission to half a
            minute.
        size: width and height in pixels.
        fps: frames per second.
        robot: id of the robot a chase camera follows; None takes the first.
        from_s, to_s: the part of the mission; None goes to its end.
        gif: make a GIF, too.
    """

    view: str = "top"
    speed: float | None = None
    size: tuple[int, int] = (1280, 720)
    fps: int = 30
    robot: str | None = None
    from_s: float = 0.0
    to_s: float | None = None
    gif: bool = False


DEFAULT_VIDEO = VideoArguments()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunArguments:
    """Everything but the scene that decides what a run leaves.

    Attributes:
        seed: of all random streams.
        profile: "default" or "paper".
        budget_s: wall-clock limit of planning; None for none.
        trees: number of motion trees to grow; None for the profile's.
        spare: share of every battery's capacity that plans leave above the reserve
            where they can; None for the profile's.
        workers: threads that grow them; without a time limit they decide nothing.
        controller: name of the tracking controller.
        disturb: specification of the disturbances driven under; None for none.
        disturb_seed: of what is drawn from them.
        replan: whether to plan anew where the mission leaves its plan.
        faults: robots that break down on the way, such as `r2@40s`.
        video: how the video is made.
    """

    seed: int = 0
    profile: str = "default"
    budget_s: float | None = None
    trees: int | None = None
    spare: float | None = None
    workers: int = 1
    controller: str = "mpc"
    disturb: str | None = None
    disturb_seed: int = 0
    replan: bool = False
    faults: tuple[str, ...] = ()
    video: VideoArguments = DEFAULT_VIDEO

    def to_json(self) -> dict[str, Any]:
        """Return the arguments as JSON data."""
        return asdict(self)

    @staticmethod
    def from_json(data: dict[str, Any]) -> RunArguments:
        """Rebuild arguments from `to_json`."""
        video = data.get("video", {})
        if "size" in video:
            video = {**video, "size": tuple(video["size"])}
        faults = tuple(data.get("faults", ()))
        return RunArguments(
            **{**data, "video": VideoArguments(**video), "faults": faults}
        )
