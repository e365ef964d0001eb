"""Measure what a mission costs as a multiple of its vehicle kernel's CPU time: a figure that holds
on any machine.

The vehicle's equations of motion are computed by compiled functions; all else in a mission (events,
functions, monitors, reasoning) is overhead. The calls that missions make of these functions are
recorded with their arguments. Then each mission and its recorded calls alone are timed in turn, so
that a slower machine slows both down. The replay of the calls must give the mission's own track: a
call that was not recorded is an error, not a better ratio. Of each mission the quickest of several
rounds counts: other work on the machine slows a mission down more than the kernel.

    python benchmarks/kernel.py [MISSIONS [ROUNDS]]

prints the figures as JSON, in some ten seconds.
"""

from __future__ import annotations

import gc
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from suave_des.compiling import Array
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle import kernel

SCENARIO, MANAGER, SEED = "seams2023", "metacontrol", 1
MISSIONS, ROUNDS = 100, 8
_SUBSTEP_RUNS = 50
_STEPPING = ("advance", "fly_waypoints")
"""The kernel's functions that step the track. Arguments 0 and 1 of each are the track and the row
to start from; argument 2 of the first is the last row to fill.
"""


class KernelCall(NamedTuple):
    """A call of a compiled function of the kernel.

    Attributes:
        function: that was called.
        first: number of the row to start from.
        start: that row of the track, shape (columns,).
        arguments: all that follow these; arrays as they were before the call.
    """

    function: Callable[..., object]
    first: int
    start: Array
    arguments: tuple[object, ...]


class Replay:
    """The kernel calls of one mission, which can be made again.

    Args:
        calls: in their order.
        track: of the mission after its end, shape (rows, columns).

    Raises:
        RuntimeError: the calls alone do not give the mission's track, so some were not recorded.
    """

    def __init__(self, calls: list[KernelCall], track: Array) -> None:
        self.calls, self.shape = calls, track.shape
        scratch = np.full_like(track, np.nan)
        scratch[0] = calls[0].start if calls else np.nan
        for call in calls:
            if not np.array_equal(scratch[call.first], call.start):
                raise RuntimeError(
                    "a call of the vehicle's kernel was not recorded: the others give another track"
                )
            call.function(scratch, call.first, *_copied(call.arguments))
        filled = ~np.isnan(scratch[:, 0])
        if not filled.any() or not np.array_equal(scratch[filled], track[filled]):
            raise RuntimeError(
                "the recorded calls of the vehicle's kernel do not give the mission's track"
            )

    def cpu_ns(self, track: Array) -> int:
        """Make the calls again on a track that may be overwritten, and return their CPU time."""
        calls = [(call.function, call.first, _copied(call.arguments)) for call in self.calls]
        track[0] = self.calls[0].start
        begun_ns = time.process_time_ns()
        for function, first, arguments in calls:
            function(track, first, *arguments)
        return time.process_time_ns() - begun_ns

    def ns_per_substep(self, track: Array) -> float:
        """Advance over a whole track with the control of the first recorded advance; return the CPU
        time of a row.
        """
        call = next(call for call in self.calls if call.function is getattr(kernel, _STEPPING[0]))
        _, *control = _copied(call.arguments)
        track[0], last = call.start, len(track) - 1
        begun_ns = time.process_time_ns()
        call.function(track, 0, last, *control)
        return (time.process_time_ns() - begun_ns) / last


def record(mission: Callable[[], object]) -> Replay:
    """Run a mission and record its calls of the kernel.

    Raises:
        RuntimeError: some calls were not recorded, or all.
    """
    calls: list[KernelCall] = []
    tracks: list[Array] = []
    with _recording(calls, tracks):
        mission()
    return Replay(calls, tracks[-1] if tracks else np.empty((1, 1)))


@contextmanager
def _recording(calls: list[KernelCall], tracks: list[Array]) -> Iterator[None]:
    def recorded(function: Callable[..., object]) -> Callable[..., object]:
        def call(track: Array, first: int, *others: object) -> object:
            calls.append(KernelCall(function, first, track[first].copy(), _copied(others)))
            tracks[:] = [track]
            return function(track, first, *others)

        return call

    with ExitStack() as patches:
        for name in _STEPPING:
            patches.enter_context(patch.object(kernel, name, recorded(getattr(kernel, name))))
        yield


def _copied(arguments: tuple[object, ...]) -> tuple[object, ...]:
    """Copy the arrays among some arguments and in their tuples, as the kernel writes into some of
    them.
    """

    def copy(argument: object) -> object:
        if isinstance(argument, tuple):
            return _copied(argument)
        return argument.copy() if isinstance(argument, np.ndarray) else argument

    return tuple(map(copy, arguments))


def figures(missions: int = MISSIONS, rounds: int = ROUNDS) -> Mapping[str, float]:
    """Time missions and their kernel calls in turn.

    Returns:
        CPU and wall time of a mission and CPU time of its kernel calls in us, means over the
        missions; the ratio of the CPU times; how many kernel calls a mission makes, and the CPU
        time of one 6-DOF substep in ns.
    """
    simulator = Simulator(load_scenario(SCENARIO))

    def mission(run: int) -> object:
        return simulator.run(MANAGER, run, SEED)

    runs = range(1, missions + 1)
    for run in runs:  # compiles, and fills the caches
        mission(run)
    replays = [record(lambda run=run: mission(run)) for run in runs]  # type: ignore[misc]
    track = np.empty(replays[0].shape)
    gc.collect()
    gc.freeze()  # what was imported is not searched for cycles while missions are timed
    cpu_ns, wall_ns, kernel_ns = np.empty((3, rounds, missions))
    for turn in range(rounds):
        for place, (run, replay) in enumerate(zip(runs, replays, strict=True)):
            begun_cpu_ns, begun_wall_ns = time.process_time_ns(), time.perf_counter_ns()
            mission(run)
            cpu_ns[turn, place] = time.process_time_ns() - begun_cpu_ns
            wall_ns[turn, place] = time.perf_counter_ns() - begun_wall_ns
            kernel_ns[turn, place] = replay.cpu_ns(track)
    mission_us, mission_wall_us, kernel_us = (
        float(times.min(axis=0).mean()) / 1e3 for times in (cpu_ns, wall_ns, kernel_ns)
    )
    return {
        "missions": missions,
        "rounds": rounds,
        "mission_wall_us": mission_wall_us,
        "mission_cpu_us": mission_us,
        "kernel_cpu_us": kernel_us,
        "mission_over_kernel": mission_us / kernel_us,
        "kernel_calls_a_mission": statistics.fmean(len(replay.calls) for replay in replays),
        "kernel_ns_a_substep": statistics.median(
            replays[0].ns_per_substep(track) for _ in range(_SUBSTEP_RUNS)
        ),
    }


if __name__ == "__main__":
    print(json.dumps(figures(*map(int, sys.argv[1:3])), indent=2))
