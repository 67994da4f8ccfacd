"""Planners and routers that other packages add by entry points.

A package adds them in its `pyproject.toml`:

    [project.entry-points."mrmg.planners"]
    potential_field = "my_package.planning:PotentialField"

The object is a `planning.Planner` or a `planning.Router`, or a class that makes one
without arguments. What a package adds is imported only when it is asked for by name.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cache, wraps
from importlib.metadata import PackageNotFoundError, entry_points, version
from typing import Any

from mrmg.errors import MachineError, MrmgError, UsageError, require_known

PLANNERS, ROUTERS = "mrmg.planners", "mrmg.routers"
"""Groups of entry points."""

BUILT_IN = {
    PLANNERS: ("path_following", "guided_tree"),
    ROUTERS: ("search", "nrpa", "exact"),
}
"""Names of what this package has itself, which no other package can replace."""

_KIND = {PLANNERS: "planner", ROUTERS: "router"}


def names(group: str) -> list[str]:
    """Return all names of a group, this package's own first, without importing any."""
    added = entry_points(group=group).names - {*BUILT_IN[group]}
    return [*BUILT_IN[group], *sorted(added)]


def require(group: str, name: str) -> str:
    """Return a name that a group has.

    Raises:
        UsageError: if there is none of that name; lists those there are.
    """
    if name not in BUILT_IN[group]:  # or what is installed need not be looked through
        require_known(_KIND[group], name, names(group))
    return name


def load(group: str, name: str) -> Callable[..., Any]:
    """Import and return what another package adds under a name.

    Whatever goes wrong in it, then or when it is called, is one `MachineError` that
    names the package.

    Raises:
        UsageError: if no package adds the name, or several do.
        MachineError: if it cannot be imported or called.
    """
    require(group, name)
    found = tuple(entry_points(group=group, name=name))
    if len(found) > 1:
        raise UsageError(
            f"{_KIND[group]} {name!r} is added by several packages: "
            f"{origin(group, name)}; uninstall all but one"
        )
    added = _guarded(found[0].load, group, name, "cannot be imported")()
    if isinstance(added, type):
        added = _guarded(added, group, name, "cannot be made")()
    if not callable(added):
        raise fault(group, name, f"is {added!r}, which is not callable")
    return _guarded(added, group, name, "failed")


def name_of(given: object) -> str:
    """Return the name that a planner or router is recorded by; a name is its own."""
    if isinstance(given, str):
        return given
    kind = given if hasattr(given, "__qualname__") else type(given)
    return f"{kind.__module__}:{kind.__qualname__}"


@cache
def origin(group: str, name: str) -> str:
    """Return package and version that a planner or router comes from.

    It is "" for those of this package, and for those that no package has.
    """
    if name in BUILT_IN[group]:
        return ""
    module, of_object, _ = name.partition(":")
    if of_object:
        package = module.partition(".")[0]
        with suppress(PackageNotFoundError):
            return f"{package} {version(package)}"
        return ""
    return ", ".join(
        f"{entry.dist.name} {entry.dist.version}"
        for entry in entry_points(group=group, name=name)
        if entry.dist
    )


def fault(group: str, name: str, what: str) -> MachineError:
    """Return the error that a planner or router is broken, with its package."""
    package, kind = origin(group, name), _KIND[group]
    source, remedy = "", f"choose another {kind} ({', '.join(BUILT_IN[group])})"
    if package:
        source, remedy = f" of package {package}", f"update that package, or {remedy}"
    return MachineError(f"{kind} {name!r}{source} {what}; {remedy}")


def _guarded(
    call: Callable[..., Any], group: str, name: str, what: str
) -> Callable[..., Any]:
    """Return a call whose errors name the package that they come from."""

    @wraps(call)
    def guarded(*args: Any, **options: Any) -> Any:
        try:
            return call(*args, **options)
        except MrmgError:
            raise
        except Exception as error:  # another package's code may do anything
            reason = f"{what}: {type(error).__name__}: {error}"
            raise fault(group, name, reason) from error

    return guarded
