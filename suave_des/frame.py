"""Missions as a data frame that compares and draws itself."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Self, Unpack

import pandas

from suave_des.arguments import plain_arguments
from suave_des.reality.assisted import AssistedComparison, compare_assisted
from suave_des.records.missions import SHARING, Source, missions_in
from suave_des.results.compare import Choices, compare_missions
from suave_des.results.comparison import Comparison

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class CampaignFrame(pandas.DataFrame):
    """Missions, a row for each, with the columns of runs.csv.

    What pandas makes of it, such as a selection of rows, can be compared and drawn, too.

    Example:
        frame = run_campaign("seams2023", ["none", "bt", "metacontrol"], runs=100)
        print(frame.compare().conclusion)
        frame[frame["run"] <= 50].compare(metrics=["distance_inspected_m"], against="none")
        frame.figure().savefig("distributions.pdf")
    """

    @property
    def _constructor(self) -> type[CampaignFrame]:
        return CampaignFrame

    def __finalize__(self, other: Any, method: str | None = None, **keywords: Any) -> Self:
        """Keep how many runs share a draw where frames are joined: pandas keeps attrs only if all
        are equal.
        """
        found: Self = super().__finalize__(other, method, **keywords)  # type: ignore[misc]
        parts: Iterable[Any] = (
            getattr(other, "objs", getattr(other, "input_objs", ())) if method == "concat" else ()
        )
        known = {part.attrs[SHARING] for part in parts if SHARING in part.attrs}
        if known:
            found.attrs[SHARING] = math.lcm(*known)
        return found

    @plain_arguments
    def compare(self, **choices: Unpack[Choices]) -> Comparison:  # type: ignore[override]
        """Compare the managers, as `suave-des compare` does, in place of pandas' comparison cell by
        cell.

        Args:
            choices: what to compare, and how; see Choices.

        Raises:
            InputError: a name is not there, or an extra is not installed.
        """
        return compare_missions(missions_in(self), **choices)

    def assist(
        self,
        real: Source,
        population: Source,
        managers: Sequence[str] = (),
        metrics: Sequence[str] = (),
    ) -> AssistedComparison:
        """Estimate what real missions show, assisted by these, which are of the same conditions.

        Args:
            real: real missions in a few conditions, as a data frame or as folders and files;
                likewise population.
            population: a campaign under many conditions.
            managers: names; empty: all that have real missions.
            metrics: columns of runs.csv; empty: the usual ones.

        Raises:
            InputError: the missions do not belong together, or are too few.
        """
        simulated = missions_in(self), missions_in(population)
        return compare_assisted(missions_in(real), simulated, managers, metrics)

    @plain_arguments
    def figure(self, kind: str = "auto") -> Figure:
        """Draw the missions, as `suave-des figure` does.

        Args:
            kind: as of `suave-des figure --kind`; "auto": means over what was swept, or
                distributions.

        Raises:
            InputError: there is no such kind of figure.
        """
        from suave_des.results.figures import draw_missions

        return draw_missions(missions_in(self), kind)
