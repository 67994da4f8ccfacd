"""What a run is started with: the one specification of its arguments.

The command line's options, the keywords of `mrmg.run`, the fingerprints of a run's
steps, the record in `run.json` and the report's command are all made from the fields of
`RunArguments`. A new argument is one more field.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from mrmg import extensions, storage
from mrmg.errors import Fault, RunFolderError, UsageError
from mrmg.runs import argument_values as values
from mrmg.runs.options import Checked, option, options_of

if TYPE_CHECKING:
    from mrmg.runs.folder import RunFolder
    from mrmg.scene.types import Scene


_shown = partial(option, verbs=("render",))
_named = partial(option, None, decides="plan", read=values.name, metavar="NAME")


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoArguments(Checked):
    """How the video is made."""

    view: str = _shown("top", choices=("top", "chase", "split"))
    """what is shown"""
    speed: float | None = _shown(None, read=values.positive, metavar="FACTOR")
    """simulated seconds shown per second; default fits the mission to half a minute"""
    size: tuple[int, int] = _shown((1280, 720), read=values.size, metavar="WxH")
    """in pixels, such as 1280x720"""
    fps: int = _shown(30, read=values.count, metavar="N")
    """frames per second"""
    robot: str | None = _shown(None, metavar="ID")
    """followed by the chase camera; default the first"""
    from_s: float = _shown(0.0, read=values.time, metavar="SECONDS")
    """mission time of the first frame"""
    to_s: float | None = _shown(None, read=values.time, metavar="SECONDS")
    """mission time of the last frame"""
    gif: bool = _shown(False, read=values.switch)
    """make a GIF of less than 5 MB, too"""


DEFAULT_VIDEO = VideoArguments()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunArguments(Checked):
    """Everything but the scene that decides what a run leaves."""

    seed: int = option(0, decides="plan", read=values.seed, metavar="N")
    """of all random streams; default 0"""
    profile: str = option("default", decides="plan", choices=("default", "paper"))
    """'paper' is the published method: planner guided_tree with router nrpa"""
    planner: str | None = _named(extended=extensions.PLANNERS)
    """path_following, which is the default, guided_tree, the published method, or one
    that another package adds"""
    router: str | None = _named(extended=extensions.ROUTERS)
    """what finds tours: search, which is the default, nrpa, exact (for energy alone, no
    time limit and few goals; else it searches), or one that another package adds;
    guided_tree takes nrpa only"""
    objective: str | Mapping[str, float] | None = option(
        None, decides="plan", read=values.objective, metavar="energy|makespan|E:M"
    )
    """what plans minimise, in place of the scene's objective; E and M are the weights
    of each J and each s"""
    time_limit_s: float | None = option(
        None, decides="plan", read=values.positive, metavar="SECONDS"
    )
    """by when all robots are at rest, in place of the scene's time limit"""
    budget_s: float | None = option(
        None, decides="plan", read=values.positive, metavar="SECONDS", group="limit"
    )
    """go on improving the plan for so long; Ctrl-C ends it earlier"""
    trees: int | None = option(
        None, decides="plan", read=values.count, metavar="N", group="limit"
    )
    """go on improving for so many attempts: the same plan every time"""
    soc_margin: float | None = option(
        None, decides="plan", read=values.share, metavar="SHARE", formerly=("spare",)
    )
    """state-of-charge margin: share of every battery's capacity that plans leave above
    the reserve where that can be; default 0.1"""
    margins: Mapping[str, float] | None = option(
        None, decides="plan", read=values.margins, metavar="KEY=M,..."
    )
    """distances in m that plans keep from obstacles and between robots, such as
    obstacle=0.1,robot=0.3, in place of those of the scene and its robots; where only a
    smaller one opens a passage, that one is used there"""
    skip_unreachable: bool = option(False, decides="plan", read=values.switch)
    """plan without the goals that are proven out of reach; the mission then ends with
    exit code 6, and they are listed with their proofs"""
    workers: int = option(1, verbs=("run", "plan"), read=values.count, metavar="N")
    """threads that plan; default 1"""
    controller: str = option(
        "mpc", decides="drive", verbs=("run", "execute", "robustness"), metavar="NAME"
    )
    """tracking controller; default mpc, or that of the run"""
    plant: str = option(
        "default",
        decides="drive",
        verbs=("run", "execute", "robustness", "calibrate"),
        choices=("default", "scrub"),
    )
    """ground contact: default, as the energy model has it, or scrub, which it does not
    know: by wheel, load and slip; default: default, or that of a run driven anew"""
    disturb: str | None = option(None, decides="drive", bare="", metavar="SPEC")
    """drive robots that differ from their models: in mass, friction, rolling,
    drive_gain, steering_gain, lag, position_noise, heading_noise, speed_noise, delay,
    start_x, start_y, start_heading, capacity; SPEC is key=value,... such as
    rolling=+30%,lag=0..80ms, or a YAML file of such keys, and changes the defaults
    (mass=+-5%,friction=+-20%,rolling=+-10%,lag=50ms,position_noise=2cm); a leading
    'none' starts from no disturbance, a leading 'field:snow' (or asphalt, flooring,
    ice, sandy_loam) from the spread found in logs of a robot on it"""
    disturb_seed: int = option(0, decides="drive", read=values.seed, metavar="N")
    """of what is drawn from the disturbances; default 0"""
    faults: tuple[str, ...] = option(
        (), decides="drive", flag="--fault", read=values.words, metavar="ROBOT@TIME"
    )
    """let a robot break down on the way, such as r2@40s; may be repeated"""
    replan: bool = option(
        False,
        decides="drive",
        verbs=("run", "execute", "robustness"),
        read=values.switch,
    )
    """when a robot breaks down, or energy or tracking leave their corridor, stop the
    fleet and plan the rest of the mission anew"""
    energy_tolerance_pct: float = option(
        5.0,
        decides="audit",
        flag="--energy-tolerance",
        read=values.positive,
        metavar="PERCENT",
    )
    """by which a robot's measured energy may differ from planned in an undisturbed
    drive; beyond it the model does not describe the robot; default 5"""
    video: VideoArguments = DEFAULT_VIDEO

    def deciding(self, what: str) -> dict[str, Any]:
        """Return the arguments that decide "plan", "drive" or "audit", by name."""
        return {
            each.name: getattr(self, each.name)
            for each in options_of(RunArguments)
            if each.decides == what
        }

    def require_names(self) -> None:
        """Refuse names of planner and router that nothing installed has.

        Raises:
            UsageError: naming those allowed.
        """
        for group, name in self._added():
            extensions.require(group, name)

    def planning(self) -> list[Any]:
        """Return what decides the plan: arguments, and versions of other packages."""
        added = [extensions.origin(group, name) for group, name in self._added()]
        return [self.deciding("plan"), *filter(None, added)]

    def _added(self) -> list[tuple[str, str]]:
        """Return groups of entry points with the names that are requested of them."""
        return [
            (each.extended, getattr(self, each.name))
            for each in options_of(RunArguments)
            if each.extended and getattr(self, each.name)
        ]

    def words(self) -> list[str]:
        """Return the options of `mrmg run` that make the same plan and drive again."""
        return [
            word
            for each in options_of(RunArguments)
            if each.decides
            for word in each.words(getattr(self, each.name))
        ]

    def scene(self, scene: Scene) -> Scene:
        """Return `scene` with the objective and the time limit of the arguments."""
        wanted = {"objective": self.objective, "time_limit": self.time_limit_s}
        changes: dict[str, Any] = {
            key: value for key, value in wanted.items() if value is not None
        }
        return scene.with_(**changes) if changes else scene

    def to_json(self) -> dict[str, Any]:
        """Return the arguments as JSON data."""
        return asdict(self)

    @staticmethod
    def from_json(data: Mapping[str, Any]) -> RunArguments:
        """Rebuild arguments from `to_json`, also of versions that knew fewer.

        Raises:
            UsageError: if they are damaged, or of a later version.
        """
        try:
            named = {keyword(name): value for name, value in data.items()}
            video = VideoArguments(**named.pop("video", {}))
            return RunArguments(**named, video=video)
        except (*storage.UNREADABLE, UsageError) as error:
            message = f"arguments that this version does not know ({error})"
            raise UsageError(message) from error


def recorded(folder: RunFolder) -> RunArguments:
    """Return the arguments that the folder's results were made with.

    Raises:
        RunFolderError: if they are damaged, or of a later version.
    """
    try:
        return RunArguments.from_json(folder.arguments())
    except UsageError as error:
        fault = Fault("run.json", f"{error}; run 'mrmg run' into another folder")
        raise RunFolderError(str(folder.path), [fault]) from error


def keyword(name: str) -> str:
    """Return the field of a keyword; it may be spelled as its flag is, or was once."""
    for each in options_of(RunArguments):
        flag = each.flag.removeprefix("--").replace("-", "_")
        if name in (flag, *each.formerly):
            return each.name
    return name
