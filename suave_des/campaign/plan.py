"""What a campaign is to run: which missions, in which order, in which portions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from suave_des.errors import InputError
from suave_des.managing.registry import manager_class

RUNS_LIMIT = 1_000_000
_WORKERS_PER_CORE = 4


@dataclass(frozen=True, slots=True)
class RunSpec:
    """One mission of a campaign: everything that decides its row, but for the files of its scenario.

    Attributes:
        scenario: the scenario's name.
        manager: name of the managing subsystem, or module:Class.
        run: number of the run, from 1; equal runs of different managers meet the same sea.
        seed: the campaign's seed.
    """

    scenario: str
    manager: str
    run: int
    seed: int


Chunk = tuple[RunSpec, ...]


def plan(scenario: str, managers: Sequence[str], runs: int, seed: int) -> Iterator[RunSpec]:
    """All missions in the order of their rows: managers as given, runs 1 to `runs` of each."""
    return (RunSpec(scenario, manager, run, seed) for manager in managers for run in range(1, runs + 1))


def chunked(missions: Iterable[RunSpec], size: int) -> Iterator[Chunk]:
    """Portions of `size` missions, the last one perhaps smaller."""
    rest = iter(missions)
    while chunk := tuple(islice(rest, size)):
        yield chunk


def check_plan(managers: Sequence[str], runs: int, workers: int) -> None:
    """See that a campaign can be run.

    Raises:
        InputError: no or unknown or repeated managers, or numbers that make no sense.
    """
    if not managers:
        raise InputError("no managers are given", remedy="for instance none,random,metacontrol")
    for place, manager in enumerate(managers):
        manager_class(manager)
        if manager in managers[:place]:
            raise InputError(f"manager {manager!r} is given twice", remedy="name each manager once")
    if not 1 <= runs <= RUNS_LIMIT:
        raise InputError(f"runs: {runs} is out of range", remedy=f"give 1 to {RUNS_LIMIT}")
    cores = os.cpu_count() or 1
    limit = _WORKERS_PER_CORE * cores
    if not 1 <= workers <= limit:
        raise InputError(
            f"workers: {workers} is out of range",
            remedy=f"give 1 to {limit}; this machine has {cores} cores, and more workers than cores gain nothing",
        )
