"""When a campaign need not go on: a 95% interval that is narrow enough, as `--until-ci` asks for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches

from suave_des.errors import InputError
from suave_des.metrics.result import MissionMetrics

FEWEST_RUNS = 20
"""Missions with a value that a manager has at least: the interval of fewer is not reliable (estimates.py)."""
FEWEST_PAIRS = 100
"""Runs at least, for a difference: most runs differ little, a few by far, and fewer runs may have none of these.

Of differences between metacontrol and bt in search time (9% of them beyond 20 s), intervals at which a campaign stops
cover the true one in 81% of cases if it may stop after 20 runs, in 94% if after 100.
"""
RUNS_LIMIT_DEFAULT = 10_000
"""Runs at most, when a limit to the interval is given and no number of runs."""
SEARCH_TIME = "search_time_s"

METRICS = tuple(
    field.name
    for field in fields(MissionMetrics)
    if field.name not in ("run", "seed") and str(field.type).removesuffix(" | None") in ("float", "int")
)
"""Columns of runs.csv that have a mean."""


@dataclass(frozen=True, slots=True)
class UntilCi:
    """Missions are run until the 95% interval of a metric's mean, or of the difference of two managers, is narrow.

    Attributes:
        metric: column of runs.csv.
        half_width: half the interval's width is to be below this, in the metric's unit.
        pair: the managers whose difference run by run counts; None: the mean of each manager.
    """

    metric: str
    half_width: float
    pair: tuple[str, str] | None = None

    def plain(self) -> dict[str, object]:
        """Return it as plain data; `pair` only where there is one."""
        one = {"metric": self.metric, "half_width": self.half_width}
        return one if self.pair is None else {**one, "pair": list(self.pair)}

    def check(self, managers: Sequence[str]) -> None:
        """See that the managers of the difference are among those of the campaign.

        Raises:
            InputError: one is not.
        """
        for name in self.pair or ():
            if name not in managers:
                problem = f"the difference needs {name!r}, which is not among the managers"
                raise InputError(problem, place="until_ci", remedy=f"there are {', '.join(managers)}")


def parse_until_ci(text: str) -> UntilCi:
    """Read METRIC:HALF_WIDTH or MANAGER - MANAGER:METRIC:HALF_WIDTH, for instance metacontrol - bt: search_time_s: 2.

    Raises:
        InputError: it has no such form, there is no such metric, or the number is not above 0.
    """
    pair = None
    parts = [part.strip() for part in text.rsplit(":", 2)]
    if " - " in f"{parts[0]} ":
        first, _, second = (name.strip() for name in f"{parts.pop(0)} ".partition(" - "))
        if not second or first == second or len(parts) != 2:
            example = f"metacontrol - bt: {SEARCH_TIME}: 2"
            raise _wrong(text, "it is no difference of two managers", f"give A - B: METRIC: HALF_WIDTH, as {example}")
        pair = first, second
        text = ":".join(parts)
    name, colon, number = (part.strip() for part in text.partition(":"))
    if not colon:
        raise _wrong(text, "there is no colon in it", f"give METRIC:HALF_WIDTH, for instance {SEARCH_TIME}:5")
    if name not in METRICS:
        near = get_close_matches(name, METRICS, n=1)
        meant = f"did you mean {near[0]}? " if near else ""
        raise _wrong(text, f"runs.csv has no metric {name!r}", f"{meant}there are {', '.join(METRICS)}")
    try:
        half_width = float(number)
    except ValueError:
        half_width = math.nan
    if not 0.0 < half_width < math.inf:
        raise _wrong(text, f"{number!r} is not a half-width", "give a number above 0, in the metric's unit")
    return UntilCi(name, half_width, pair)


def _wrong(text: str, what: str, remedy: str) -> InputError:
    return InputError(f"{text!r}: {what}", place="until_ci", remedy=remedy)
