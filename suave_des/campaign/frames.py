"""Rows of runs.csv as pandas data frames whose columns have types."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from itertools import islice
from typing import TYPE_CHECKING, Any

from suave_des.campaign.outcomes import Row
from suave_des.simulation.result import MissionMetrics

if TYPE_CHECKING:
    import pandas

_TYPES = {"float": "float64", "int": "int64", "bool": "bool"}
"""Of columns of numbers; a float that is none is nan."""
_LARGEST_INT64 = 2**63 - 1


def typed_frame(
    rows: Iterable[Row], columns: Sequence[str], scenario: str, managers: Sequence[str], seed: int
) -> pandas.DataFrame:
    """A data frame of rows; its types do not depend on what is in them, so that pieces go together.

    Columns scenario and manager are categories, the managers in the campaign's order; run, seed and adaptations int64;
    pipeline_found bool; other metrics float64. What a sweep varies has the type that pandas finds for it.

    Args:
        rows: of runs.csv.
        columns: their names.
        scenario: name of the scenario.
        managers: names, in the campaign's order.
        seed: the campaign's.
    """
    import pandas

    types: dict[str, Any] = {
        field.name: _TYPES[str(field.type).removesuffix(" | None")]
        for field in fields(MissionMetrics)
        if str(field.type).removesuffix(" | None") in _TYPES
    }
    types["scenario"] = pandas.CategoricalDtype([scenario])
    types["manager"] = pandas.CategoricalDtype(list(managers))
    if abs(seed) > _LARGEST_INT64:  # seeds have no limit, integers of pandas do
        types["seed"] = "object"
    return pandas.DataFrame.from_records(list(rows), columns=list(columns)).astype(types)


def pieces(rows: Iterable[Row], size: int) -> Iterator[tuple[Row, ...]]:
    """Rows, `size` at a time."""
    rest = iter(rows)
    while piece := tuple(islice(rest, size)):
        yield piece
