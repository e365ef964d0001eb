"""Early ends of a campaign: an interval is narrow enough, it would take very long, or a manager always fails."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from suave_des.campaign.missions import COLUMN_TYPES, Finished, JobSpec, MissionFailure, MissionKey, WorkerError
from suave_des.errors import InputError, nearest
from suave_des.files import as_number

FEWEST_RUNS = 20
"""Missions with a value that a manager has at least: the interval of fewer is not reliable (estimates.py)."""
FEWEST_PAIRS = 100
"""Runs at least, for a difference: most runs differ little, a few by far, and fewer runs may have none of these.

Where 9% of the differences between two managers' search times were beyond 20 s, intervals at which a campaign stopped
covered the true one in 81% of cases if it might stop after 20 runs, in 94% if after 100.
"""
SEARCH_TIME = "search_time_s"

METRICS = tuple(name for name, kind in COLUMN_TYPES.items() if name not in ("run", "seed") and kind in ("float", "int"))
"""Columns of runs.csv that have a mean."""

LARGE = 1_000_000
"""Missions from which a campaign needs to be confirmed."""
_TIMED_RUNS = 3
ALIKE = 20
"""So many missions of a manager that all fail with the same error stop the campaign."""


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
        """Check that the managers of the difference are among those of the campaign.

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
            raise _wrong(text, "expected a difference of two managers", f"give A - B: METRIC: HALF_WIDTH, as {example}")
        pair = first, second
        text = ":".join(parts)
    name, colon, number = (part.strip() for part in text.partition(":"))
    if not colon:
        raise _wrong(text, "there is no colon in it", f"give METRIC:HALF_WIDTH, for instance {SEARCH_TIME}:5")
    if name not in METRICS:
        meant = nearest(name, METRICS)
        remedy = f"{f'{meant} ' if meant else ''}there are {', '.join(METRICS)}"
        raise _wrong(text, f"runs.csv has no metric {name!r}", remedy)
    half_width = as_number(number)
    if not 0.0 < half_width < math.inf:
        raise _wrong(text, f"{number!r} is not a half-width", "give a number above 0, in the metric's unit")
    return UntilCi(name, half_width, pair)


def _wrong(text: str, what: str, remedy: str) -> InputError:
    return InputError(f"{text!r}: {what}", place="until_ci", remedy=remedy)


def check_size(job: JobSpec, total: int, workers: int) -> None:
    """Check that a very large campaign is intended.

    Args:
        job: what its missions are run from.
        total: number of missions.
        workers: processes that run them.

    Raises:
        InputError: it has more than LARGE missions; the time that they take is estimated from some of them.
    """
    if total <= LARGE:
        return
    from suave_des.campaign.executors.mission_runner import MissionRunner

    managers = range(len(job.managers))
    few = tuple(MissionKey(0, manager, run) for manager in managers for run in range(1, _TIMED_RUNS + 1))
    runner = MissionRunner(job)
    list(runner.each(few[::_TIMED_RUNS]))  # compiles, and fills the reasoner's cache
    began_s = time.perf_counter()
    list(runner.each(few))
    expected_s = (time.perf_counter() - began_s) / len(few) * total / workers
    by = f"{workers} worker{'s' if workers > 1 else ''}"
    problem = f"{total:,} missions take about {_duration_text(expected_s)} with {by} on this machine"
    raise InputError(problem, remedy="confirm with --yes")


def _duration_text(seconds: float) -> str:
    units = (("year", 31_557_600.0), ("day", 86_400.0), ("hour", 3_600.0), ("minute", 60.0))
    for unit, length_s in units:
        if seconds >= 2 * length_s:
            return f"{seconds / length_s:,.0f} {unit}s"
    return f"{seconds:.0f} seconds"


class FirstFailures:
    """Detects that a manager fails in the same way in all its first missions, and so would in all others."""

    def __init__(self, managers: Sequence[str]) -> None:
        self._managers = managers
        self._causes: dict[int, list[str | None]] = {}

    def check(self, finished: Iterable[Finished]) -> None:
        """Take outcomes.

        Raises:
            WorkerError: the first ALIKE missions of a manager have failed with the same error.
        """
        for key, outcome in finished:
            causes = self._causes.setdefault(key.manager, [])
            if len(causes) < ALIKE:
                cause = outcome.cause if isinstance(outcome, MissionFailure) and outcome.lasting else None
                causes.append(cause)
                if cause is not None and causes == [cause] * ALIKE:
                    raise WorkerError(f"manager {self._managers[key.manager]} fails in each mission: {cause}")
