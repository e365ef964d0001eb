"""Which cells of a design with three factors are run each time, and which by `-m slow` only."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import Any

import pytest


def each_pair(fewest: Iterable[Any], second: Iterable[Any], third: Iterable[Any]) -> list[Any]:
    """Return all cells as parameters of a test, of which those are quick that have each pair of levels among them.

    Args:
        fewest: levels of the factor with fewest; its pairs with the others are all there, as its levels take turns.
        second: levels of another factor; all its pairs with the third are there.
        third: levels of the last.
    """
    rotated = list(fewest)
    cells = []
    for (i, one), (j, two), (k, three) in product(enumerate(rotated), enumerate(second), enumerate(third)):
        is_quick = i == (j + k) % len(rotated)
        cells.append(pytest.param(one, two, three, marks=() if is_quick else pytest.mark.slow))
    return cells
