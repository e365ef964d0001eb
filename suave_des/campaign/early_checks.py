"""Checks that end a campaign early: it would take very long, or a manager fails in each of its first missions."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

from suave_des.campaign.missions import Finished, JobSpec, MissionFailure, MissionKey, WorkerError
from suave_des.errors import InputError

LARGE = 1_000_000
"""Missions from which a campaign needs to be confirmed."""
_TIMED_RUNS = 3
ALIKE = 20
"""So many missions of a manager that all fail with the same error stop the campaign."""


def check_size(job: JobSpec, total: int, workers: int) -> None:
    """See that a very large campaign is meant.

    Args:
        job: what its missions are run from.
        total: number of missions.
        workers: processes that run them.

    Raises:
        InputError: it has more than LARGE missions; the time that they take is estimated from some of them.
    """
    if total <= LARGE:
        return
    from suave_des.campaign.mission_runner import MissionRunner

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
    """Notices that a manager fails in the same way in all its first missions: it would in all others."""

    def __init__(self, managers: Sequence[str]) -> None:
        self._managers = managers
        self._causes: dict[int, list[str]] = {}
        self._works: set[int] = set()

    def check(self, finished: Iterable[Finished]) -> None:
        """Take outcomes.

        Raises:
            WorkerError: the first ALIKE missions of a manager have failed with the same error.
        """
        for key, outcome in finished:
            if key.manager in self._works:
                continue
            causes = self._causes.setdefault(key.manager, [])
            if (
                not isinstance(outcome, MissionFailure)
                or not outcome.lasting
                or (causes and outcome.cause != causes[0])
            ):
                self._works.add(key.manager)
                continue
            causes.append(outcome.cause)
            if len(causes) == ALIKE:
                raise WorkerError(f"manager {self._managers[key.manager]} fails in each mission: {outcome.cause}")
