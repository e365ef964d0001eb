"""Published missions as the vectors that a calibration compares."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from suave_des.calibration.distance import Array, missions_as_vectors
from suave_des.validation.shares import Share, count, read_shares, shares_beside

if TYPE_CHECKING:
    import pandas


def published_shares(frame: pandas.DataFrame, managers: Sequence[str], data: Path) -> tuple[tuple[Share, float], ...]:
    """The clusters named beside the data file that are the managers', each with its share of the published missions."""
    beside = shares_beside(data)
    if beside is None:
        return ()
    counted = [(share, count(share, frame).share) for share in read_shares(beside) if share.manager in managers]
    return tuple((share, published) for share, published in counted if published is not None)


def as_vectors(frame: pandas.DataFrame, managers: Sequence[str]) -> dict[str, Array]:
    """Missions by manager, shape (n, 2 or 3): a component that is never known for a manager is not compared at all.

    Args:
        frame: missions with the columns of suave_des.validation.runs.
        managers: which to take.
    """
    vectors = {}
    for name in managers:
        rows = frame[frame["manager"] == name]
        columns = [rows[each].to_numpy(float) for each in ("search_time_s", "distance_inspected_m", "detection_x_m")]
        missions = missions_as_vectors(*columns)
        vectors[name] = missions[:, ~np.isnan(missions).all(axis=0)]
    return vectors
