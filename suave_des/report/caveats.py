"""What a reader of a comparison should know about missions without a value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from suave_des.report.compared_metrics import FOUND, SEARCH_TIME, ComparedMetric

if TYPE_CHECKING:
    from suave_des.report.grouping import Group

_SAME_LIMIT_S = 1.5
"""Programs write limits that differ by a second for the same one."""
_MOST_NAMED = 6


def caveats(groups: Sequence[Group], metrics: Sequence[ComparedMetric]) -> Iterator[str]:
    """Yield what is to be known of missions that never found the pipeline, and of those without a value of a metric."""
    for metric in metrics:
        if metric.name == SEARCH_TIME:
            yield from _never_found(groups)
        elif metric.name != FOUND:
            yield from _left_out(groups, metric)


def _never_found(groups: Sequence[Group]) -> Iterator[str]:
    counts, ends_s = [], {}
    for group in groups:
        found, times_s = group.values(FOUND), group.values(SEARCH_TIME)
        lost = found < 1.0
        if lost.any() and group.is_of_missions:
            counts.append(f"{group.name} {int(lost.sum())} of {len(found)}")
            ends_s[group.name] = float(np.median(times_s[lost]))
        elif lost.any():
            counts.append(f"{group.name} {1.0 - np.mean(found):.1%}")
    if counts:
        yield (
            f"the search time of missions that never found the pipeline ({_listed(counts)}) is the time at which they"
            " ended: a mean search time is the mean up to that limit, and would be longer without it"
        )
    if ends_s and max(ends_s.values()) - min(ends_s.values()) > _SAME_LIMIT_S:
        limits = _listed([f"{name} after {end_s:.0f} s" for name, end_s in ends_s.items()])
        yield (
            f"missions that never found the pipeline ended at different times ({limits}): means, differences and tests"
            " of the search time are not comparable, but the means to the same limit are"
        )


def _left_out(groups: Sequence[Group], metric: ComparedMetric) -> Iterator[str]:
    sizes = [(group.name, len(group.known_values(metric.name)), len(group.frame)) for group in groups]
    counts = [f"{name} {n - known} of {n}" for name, known, n in sizes if 0 < known < n]
    if counts:
        yield (
            f"missions without a {metric.title} ({_listed(counts)}) are left out of it; they may be those that went"
            " worst"
        )


def _listed(parts: Sequence[str]) -> str:
    more = len(parts) - _MOST_NAMED
    return ", ".join(parts[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
