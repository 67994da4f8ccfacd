"""Reading pictures that may be damaged, or far too large."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image

MOST_PIXELS = 100_000_000


@contextmanager
def opened_picture(file: Path) -> Iterator[Image]:
    """Open a picture for a block that reads its pixels.

    Args:
        file: in any format.

    Raises:
        ValueError: if it is missing, damaged, or has more than `MOST_PIXELS`.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(file) as picture:
                if picture.width * picture.height > MOST_PIXELS:
                    raise ValueError(f"more than {MOST_PIXELS} pixels")
                yield picture
    except Exception as error:  # readers raise anything, SyntaxError among it
        raise ValueError(str(error)) from error
