"""What a run is started with: the one specification of its arguments.

The command line's options, the keywords of `mrmg.run`, the fingerprints of a run's
steps, the record in `run.json` and the report's command are all made from the fields of
`RunArguments`. A new argument is one more field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import Field, asdict, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Self

from mrmg.errors import UsageError
from mrmg.runs import argument_values as values

if TYPE_CHECKING:
    from mrmg.scene.types import Scene

DISTURBANCE_HELP = (
    "drive robots that differ from their models: in mass, friction, rolling, "
    "drive_gain, steering_gain, lag, position_noise, heading_noise, speed_noise, "
    "delay, start_x, start_y, start_heading, capacity; SPEC is key=value,... such as "
    "rolling=+30%,lag=0..80ms, or a YAML file of such keys, and changes the defaults "
    "(mass=+-5%,friction=+-20%,rolling=+-10%,lag=50ms,position_noise=2cm); "
    "a leading 'none' starts from no disturbance"
)

_OPTION = "option"
_VERBS = {
    "plan": ("run", "plan"),
    "drive": ("run", "execute"),
    "audit": ("run", "execute", "audit"),
    "": (),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """How one argument is spelled, read and used.

    Attributes:
        name: of the field and of the keyword of `mrmg.run`.
        type: of its values, as annotated.
        flag: of the command line.
        help: what it does.
        read: returns the value of a text or of a value, or raises ValueError.
        decides: "plan", "drive" or "audit", what its value decides; "" for none.
        verbs: of the command line that take it.
        metavar: name of its value in the help; None for a switch or with `choices`.
        choices: allowed values, where they are few.
        bare: value of the flag alone, where its value may be left out.
        group: name of a set of options that exclude each other.
        formerly: retired names of the field, still read everywhere and shown nowhere.
        default: of the field.
    """

    name: str
    type: str
    flag: str
    help: str
    read: Callable[[Any], Any]
    decides: str
    verbs: tuple[str, ...]
    metavar: str | None
    choices: tuple[str, ...] | None
    bare: str | None
    group: str | None
    formerly: tuple[str, ...]
    default: Any

    def words(self, value: Any) -> list[str]:
        """Return the words of a command line that give `value`."""
        if value == self.default:
            return []
        if value == self.bare or value is True:
            return [self.flag]
        if value is False:
            return [self.flag.replace("--", "--no-", 1)]
        if isinstance(self.default, tuple) and self.read is values.words:
            return [word for each in value for word in (self.flag, each)]
        return [self.flag, _text(value)]


def _text(value: Any) -> str:
    if isinstance(value, Mapping):  # the weights of an objective
        return f"{_text(value['energy'])}:{_text(value['makespan'])}"
    if isinstance(value, tuple):
        return "x".join(str(each) for each in value)
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    return str(value)


def _option(default: Any, help: str, **details: Any) -> Any:
    """Return a dataclass field that is an option; `details` as in `Option`."""
    metadata = {_OPTION: {"help": help, "default": default, **details}}
    return field(default=default, metadata=metadata)


def options_of(arguments: type[RunArguments] | type[VideoArguments]) -> list[Option]:
    """Return the options of a class of arguments, in the order of their fields."""
    return [
        _option_of(each) for each in fields(arguments) if each.metadata.get(_OPTION)
    ]


def _option_of(each: Field[Any]) -> Option:
    details = dict(each.metadata[_OPTION])
    decides = details.pop("decides", "")
    complete = {
        "flag": "--" + each.name.removesuffix("_s").replace("_", "-"),
        "read": str,
        "decides": decides,
        "verbs": _VERBS[decides],
        "metavar": None,
        "choices": None,
        "bare": None,
        "group": None,
        "formerly": (),
        **details,
    }
    return Option(name=each.name, type=str(each.type), **complete)


class _Checked:
    """Arguments whose values are read by their options' readers."""

    __slots__ = ()

    def __post_init__(self) -> None:
        groups: dict[str, str] = {}
        for option in options_of(type(self)):  # type: ignore[arg-type]
            value = getattr(self, option.name)
            if value == option.default:
                continue
            try:
                value = option.read(value)
            except ValueError as error:
                raise UsageError(f"{option.name}: {error}") from error
            if option.choices and value not in option.choices:
                allowed = ", ".join(option.choices)
                raise UsageError(f"{option.name}: {value!r}; allowed: {allowed}")
            object.__setattr__(self, option.name, value)
            other = groups.setdefault(option.group or option.name, option.name)
            if other != option.name:
                raise UsageError(f"{option.name} is not allowed with {other}")


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoArguments(_Checked):
    """How the video is made."""

    view: str = _option(
        "top", "what is shown", verbs=("render",), choices=("top", "chase", "split")
    )
    speed: float | None = _option(
        None,
        "simulated seconds shown per second; default fits the mission to half a minute",
        verbs=("render",),
        read=values.positive,
        metavar="FACTOR",
    )
    size: tuple[int, int] = _option(
        (1280, 720),
        "in pixels, such as 1280x720",
        verbs=("render",),
        read=values.size,
        metavar="WxH",
    )
    fps: int = _option(
        30, "frames per second", verbs=("render",), read=values.count, metavar="N"
    )
    robot: str | None = _option(
        None,
        "followed by the chase camera; default the first",
        verbs=("render",),
        metavar="ID",
    )
    from_s: float = _option(
        0.0,
        "mission time of the first frame",
        verbs=("render",),
        read=values.time,
        metavar="SECONDS",
    )
    to_s: float | None = _option(
        None,
        "mission time of the last frame",
        verbs=("render",),
        read=values.time,
        metavar="SECONDS",
    )
    gif: bool = _option(
        False,
        "make a GIF of less than 5 MB, too",
        verbs=("render",),
        read=values.switch,
    )


DEFAULT_VIDEO = VideoArguments()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunArguments(_Checked):
    """Everything but the scene that decides what a run leaves."""

    seed: int = _option(
        0,
        "of all random streams; default 0",
        decides="plan",
        read=values.seed,
        metavar="N",
    )
    profile: str = _option(
        "default",
        "'paper' is the published method: planner guided_tree with router nrpa",
        decides="plan",
        choices=("default", "paper"),
    )
    planner: str | None = _option(
        None,
        "path_following, which is the default, or guided_tree, the published method",
        decides="plan",
        choices=("path_following", "guided_tree"),
    )
    router: str | None = _option(
        None,
        "what finds tours: search, which is the default, nrpa or exact; guided_tree "
        "takes nrpa only",
        decides="plan",
        choices=("nrpa", "search", "exact"),
    )
    objective: str | Mapping[str, float] | None = _option(
        None,
        "what plans minimise, instead of what the scene says; E and M are the weights "
        "of each J and each s",
        decides="plan",
        read=values.objective,
        metavar="energy|makespan|E:M",
    )
    time_limit_s: float | None = _option(
        None,
        "by when all robots are at rest, instead of what the scene says",
        decides="plan",
        read=values.positive,
        metavar="SECONDS",
    )
    budget_s: float | None = _option(
        None,
        "go on improving the plan for so long; Ctrl-C ends it earlier",
        decides="plan",
        read=values.positive,
        metavar="SECONDS",
        group="limit",
    )
    trees: int | None = _option(
        None,
        "go on improving for so many motion trees: the same plan every time",
        decides="plan",
        read=values.count,
        metavar="N",
        group="limit",
    )
    soc_margin: float | None = _option(
        None,
        "state-of-charge margin: share of every battery's capacity that plans leave "
        "above the reserve where that can be; default 0.1",
        decides="plan",
        read=values.share,
        metavar="SHARE",
        formerly=("spare",),
    )
    workers: int = _option(
        1,
        "threads that plan; default 1",
        verbs=("run", "plan"),
        read=values.count,
        metavar="N",
    )
    controller: str = _option(
        "mpc",
        "tracking controller; default mpc, or that of the run",
        decides="drive",
        verbs=("run", "execute", "robustness"),
        metavar="NAME",
    )
    disturb: str | None = _option(
        None, DISTURBANCE_HELP, decides="drive", bare="", metavar="SPEC"
    )
    disturb_seed: int = _option(
        0,
        "of what is drawn from the disturbances; default 0",
        decides="drive",
        read=values.seed,
        metavar="N",
    )
    faults: tuple[str, ...] = _option(
        (),
        "let a robot break down on the way, such as r2@40s; may be repeated",
        decides="drive",
        flag="--fault",
        read=values.words,
        metavar="ROBOT@TIME",
    )
    replan: bool = _option(
        False,
        "when a robot breaks down, or energy or tracking leave their corridor, stop "
        "the fleet and plan the rest of the mission anew",
        decides="drive",
        verbs=("run", "execute", "robustness"),
        read=values.switch,
    )
    energy_tolerance_pct: float = _option(
        5.0,
        "by which a robot's measured energy may differ from planned in an undisturbed "
        "drive; beyond it the model does not describe the robot; default 5",
        decides="audit",
        flag="--energy-tolerance",
        read=values.positive,
        metavar="PERCENT",
    )
    video: VideoArguments = DEFAULT_VIDEO

    def deciding(self, what: str) -> dict[str, Any]:
        """Return the arguments that decide "plan", "drive" or "audit", by name."""
        return {
            option.name: getattr(self, option.name)
            for option in options_of(RunArguments)
            if option.decides == what
        }

    def words(self) -> list[str]:
        """Return the options of `mrmg run` that make the same plan and drive again."""
        return [
            word
            for option in options_of(RunArguments)
            if option.decides
            for word in option.words(getattr(self, option.name))
        ]

    def scene(self, scene: Scene) -> Scene:
        """Return `scene` with the objective and the time limit of the arguments."""
        wanted = {"objective": self.objective, "time_limit": self.time_limit_s}
        changes: dict[str, Any] = {
            key: value for key, value in wanted.items() if value is not None
        }
        return scene.with_(**changes) if changes else scene

    def changed(self, video: Mapping[str, Any], **changes: Any) -> Self:
        """Return the arguments with some of them, and of the video's, changed."""
        return replace(self, video=replace(self.video, **video), **changes)

    def to_json(self) -> dict[str, Any]:
        """Return the arguments as JSON data."""
        return asdict(self)

    @staticmethod
    def from_json(data: Mapping[str, Any]) -> RunArguments:
        """Rebuild arguments from `to_json`, also of versions that knew fewer."""
        named = {keyword(name): value for name, value in data.items()}
        video = VideoArguments(**named.pop("video", {}))
        return RunArguments(**named, video=video)


def keyword(name: str) -> str:
    """Return the field of a keyword; it may be spelled as its flag is, or was once."""
    for option in options_of(RunArguments):
        flag = option.flag.removeprefix("--").replace("-", "_")
        if name in (flag, *option.formerly):
            return option.name
    return name
