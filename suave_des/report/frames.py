"""Results of a campaign as a data frame that can be compared and drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Self

import pandas

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from suave_des.report.compare import Comparison


_SHARING = "runs_sharing_draw"


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
        """Keep how many runs share a draw where frames are joined: pandas keeps attrs only if all are equal."""
        found: Self = super().__finalize__(other, method, **keywords)  # type: ignore[misc]
        parts: Iterable[Any] = getattr(other, "objs", getattr(other, "input_objs", ())) if method == "concat" else ()
        known = {part.attrs[_SHARING] for part in parts if _SHARING in part.attrs}
        if known:
            found.attrs[_SHARING] = math.lcm(*known)
        return found

    def compare(  # type: ignore[override]
        self,
        *,
        managers: Sequence[str] = (),
        metrics: Sequence[str] = (),
        by: Sequence[str] = (),
        against: str | None = None,
        half_widths: Sequence[str] = (),
        unpaired: bool = False,
        bootstrap: bool = False,
    ) -> Comparison:
        """Compare the managers, as `suave-des compare` does, in place of pandas' comparison cell by cell.

        Args:
            managers: names of the managers to include; empty: all.
            metrics: columns; empty: search time, distance, share that found the pipeline, reaction time.
            by: swept parameters whose values are also compared.
            against: the one that all others are compared with; None: each with each.
            half_widths: METRIC:HALF_WIDTH of intervals for which the number of runs is to be given.
            unpaired: whether runs are taken as independent though they share their random numbers.
            bootstrap: whether intervals of means are BCa bootstrap intervals instead of those of t.

        Raises:
            InputError: a name is not there, or an extra is not installed.
        """
        from suave_des.report.compare import Choices, compare_frame

        return compare_frame(self, Choices(managers, metrics, by, against, half_widths, unpaired, bootstrap))

    def figure(self, kind: str = "auto") -> Figure:
        """Draw the missions, as `suave-des figure` does.

        Args:
            kind: as of `suave-des figure --kind`; "auto": means over what was swept, or distributions.

        Raises:
            InputError: there is no such kind of figure.
        """
        from suave_des.report.figures import draw_frame

        return draw_frame(self, kind)
