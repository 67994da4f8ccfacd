"""Packages that only some commands need, and that come with an extra of mrmg."""

from __future__ import annotations

import importlib
from typing import Any

from mrmg.errors import MachineError


def import_extra(module: str, *, extra: str, purpose: str) -> Any:
    """Return a module of an optional package.

    Args:
        module: full name of the module, such as "rasterio" or "mcap.writer".
        extra: extra of mrmg that installs its package, such as "geo".
        purpose: what the package does here, in the third person: "reads GeoTIFF".

    Raises:
        MachineError: if the package is not installed; names the install line.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise MachineError(
            f"{package}, which {purpose}, is not installed: pip install 'mrmg[{extra}]'"
        ) from error
