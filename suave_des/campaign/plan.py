"""What a campaign is to run: which missions, in which order, in which portions."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import islice
from typing import NamedTuple

from suave_des.errors import InputError, shown
from suave_des.imports import gc_paused
from suave_des.managing.registry import manager_class

RUNS_LIMIT = 1_000_000
SEED_LIMIT = 2**63 - 1
"""What tools that read the result files can hold."""
_WORKERS_PER_CORE = 4


class MissionKey(NamedTuple):
    """Which mission of a campaign; missions and their rows are in the order of their keys.

    Attributes:
        point: number of the sweep's point, from 0; 0 without a sweep.
        manager: place among the campaign's managers, from 0.
        run: number of the run, from 1; equal runs of different managers and points meet the same sea.
    """

    point: int
    manager: int
    run: int


Chunk = tuple[MissionKey, ...]
Group = tuple[int, int]
"""Point and manager: the missions that differ in the run only."""


def plan(
    points: int,
    managers: int,
    runs: int,
    settled: Callable[[Group], Collection[int]] = lambda group: (),
    is_over: Callable[[Group], bool] = lambda group: False,
) -> Iterator[MissionKey]:
    """The missions still to run, in order.

    Args:
        points: number of points of the sweep.
        managers: number of managers.
        runs: for each manager at each point.
        settled: runs of a group that need not be run, asked for once, when the group's turn comes.
        is_over: whether a group needs no further runs, asked before each.
    """
    for group in ((point, manager) for point in range(points) for manager in range(managers)):
        known = settled(group)
        for run in range(1, runs + 1):
            if is_over(group):
                break
            if run not in known:
                yield MissionKey(*group, run)


def chunked(missions: Iterable[MissionKey], size: int) -> Iterator[Chunk]:
    """Portions of `size` missions, the last one perhaps smaller."""
    rest = iter(missions)
    while chunk := tuple(islice(rest, size)):
        yield chunk


def check_range(what: str, number: int, least: int, greatest: int) -> None:
    """See that a number lies between two others.

    Raises:
        InputError: it does not.
    """
    if not least <= number <= greatest:
        raise InputError(f"{what}: {shown(number)} is out of range", remedy=f"give {least} to {greatest}")


def check_seed(seed: int) -> None:
    """See that a seed fits into result files.

    Raises:
        InputError: it does not.
    """
    check_range("seed", seed, 0, SEED_LIMIT)


def check_plan(managers: Sequence[str], runs: int, workers: int) -> None:
    """See that a campaign can be run.

    Raises:
        InputError: no or unknown or repeated managers, or numbers that make no sense.
    """
    if not managers:
        raise InputError("no managers are given", remedy="for instance none,random,metacontrol")
    for place, manager in enumerate(managers):
        with gc_paused():  # it is imported
            manager_class(manager)
        if manager in managers[:place]:
            raise InputError(f"manager {manager!r} is given twice", remedy="name each manager once")
    check_range("runs", runs, 1, RUNS_LIMIT)
    check_workers(workers)


def check_workers(workers: int) -> None:
    """See that so many processes make sense on this machine.

    Raises:
        InputError: they do not.
    """
    cores = os.cpu_count() or 1
    limit = _WORKERS_PER_CORE * cores
    if not 1 <= workers <= limit:
        raise InputError(
            f"workers: {workers} is out of range",
            remedy=f"give 1 to {limit}; this machine has {cores} cores, and more workers than cores gain nothing",
        )
