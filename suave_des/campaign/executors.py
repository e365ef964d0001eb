"""Where missions run: in this process, in worker processes (pool.py), or on a cluster (dask_cluster.py).

An executor takes missions and gives their outcomes, in whatever order they finish. Everything that a worker needs
travels to it by value.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Protocol, Self

from suave_des.campaign.outcomes import Finished, Job
from suave_des.campaign.plan import MissionKey
from suave_des.errors import InputError, SuaveDesError

if TYPE_CHECKING:
    from suave_des.campaign.worker import Worker

_LARGEST_CHUNK = 10


class Executor(Protocol):
    """Runs missions somewhere."""

    def outcomes(self, job: Job, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Outcomes of all missions, some at a time, in the order in which they finish.

        Args:
            job: what the missions have in common.
            missions: to run; asked for no earlier than there is room for them.
            total: about how many there are.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
            WorkerError: workers end before their work is done, again and again.
        """
        ...


class WorkerError(SuaveDesError):
    """Missions cannot be run, because the processes that should run them end."""


def check_place(workers: int, scheduler: str | None) -> None:
    """See that it is clear where missions shall run.

    Raises:
        InputError: it is not, or what is given is no address.
    """
    if scheduler is None:
        return
    if workers != 1:
        raise InputError(
            f"workers: {workers} has no use with a scheduler, whose own workers run the missions",
            remedy="leave it out; `dask worker --nthreads N` says how many missions run there at a time",
        )
    from suave_des.campaign.dask_cluster import check_address

    check_address(scheduler)


class Place(ExitStack):
    """Where a campaign's missions will run: in this process, in several, or on the workers of a cluster.

    Worker processes start at once: they import what they need while this process reads and checks. A cluster is asked
    only when all is checked. At the end, workers are stopped.

    Args:
        managers: that missions are run of.
        workers: number of processes; with one, missions run in this process.
        scheduler: address of a Dask scheduler, whose workers are used instead.
        ready: worker processes that have been started already.
    """

    def __init__(
        self, managers: Sequence[str], workers: int, scheduler: str | None = None, ready: Sequence[Worker] = ()
    ) -> None:
        super().__init__()
        self._managers, self._workers, self._scheduler, self._ready = managers, workers, scheduler, ready
        self._started: Executor | None = None

    def __enter__(self) -> Self:
        """Start what can start."""
        if self._scheduler is None and self._workers > 1:
            from suave_des.campaign.pool import process_pool

            self._started = self.enter_context(process_pool(self._managers, self._workers, self._ready))
        return self

    def executor(self) -> Executor:
        """What runs the missions.

        Raises:
            InputError: the scheduler does not answer, or its workers are not fit for missions.
        """
        if self._scheduler is not None:
            from suave_des.campaign.dask_cluster import connected

            return self.enter_context(connected(self._scheduler))
        return self._started or InProcess()


class InProcess:
    """Runs missions one after the other in this process."""

    def outcomes(self, job: Job, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Outcomes mission by mission; see Executor."""
        from suave_des.campaign.missions import MissionRunner  # with it comes the compiler, which takes a while

        for finished in MissionRunner(job).each(iter(missions)):
            yield [finished]


def chunk_size(total: int, workers: int) -> int:
    """Missions to a chunk: small, as chunks under way are lost when a campaign is stopped, and workers end together."""
    return max(1, min(_LARGEST_CHUNK, total // (workers * 10)))
