"""Records in kernels."""

from __future__ import annotations

import numpy as np

from mrmg.compilation import kernel, record_type


@kernel
def longest(records):
    """Return the greatest length."""
    most = 0.0
    for i in range(len(records)):
        most = max(most, records[i].length)
    return most


def test_fields_are_attributes_uncompiled_as_compiled() -> None:
    records = np.zeros(3, record_type([("length", np.float64), ("hard", np.bool_)]))
    records["length"] = [1.0, 4.0, 2.0]
    uncompiled = getattr(longest, "py_func", longest)
    assert longest(records) == uncompiled(records) == 4.0
