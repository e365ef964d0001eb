"""Measure what a mission costs as a multiple of its flight's CPU time: a figure that holds on any
machine.

The vehicle is flown by compiled calls, with the ticks of the functions; all else in a mission
(events, monitors, reasoning) is overhead. The calls that missions make are recorded with their
arguments. Then each mission and its recorded calls alone are timed in turn, so that a slower
machine slows both down. The replay of the calls must give the mission's own track: a call that was
not recorded is an error, not a better ratio. Of each mission the quickest of several rounds counts:
other work on the machine slows a mission down more than the flight.

    python benchmarks/kernel.py [MISSIONS [ROUNDS]]

prints the figures as JSON, in some ten seconds.
"""

from __future__ import annotations

import gc
import json
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

from suave_des.compiling import Array, Records
from suave_des.managed import flight
from suave_des.managed.flight import fly
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.kernel import advance

SCENARIO, MANAGER, SEED = "seams2023", "metacontrol", 1
MISSIONS, ROUNDS = 100, 8
_SUBSTEP_RUNS = 50


class FlightCall(NamedTuple):
    """A call of `fly`, with the records as they were before it."""

    flights: Records
    vehicles: Records
    tables: tuple[Array, Array, Array]
    until_s: float


class Replay:
    """The flights of one mission, which can be made again.

    Args:
        calls: in their order.
        track: of the mission after its end, shape (rows, columns).

    Raises:
        RuntimeError: the calls alone do not give the mission's track, so some were not recorded.
    """

    def __init__(self, calls: list[FlightCall], track: Array) -> None:
        self.calls, self.shape = calls, track.shape
        scratch = np.full_like(track, np.nan)
        scratch[0] = track[0]
        last = 0
        for call in calls:
            vehicles = call.vehicles.copy()
            if vehicles["row"][0] != last:
                raise RuntimeError("the vehicle was flown by a call that was not recorded")
            fly(call.flights.copy(), vehicles, scratch, *call.tables, call.until_s)
            last = vehicles["row"][0]
        if not np.array_equal(scratch[: last + 1], track[: last + 1]):
            raise RuntimeError("the recorded calls do not give the mission's track")

    def cpu_ns(self, track: Array) -> int:
        """Make the calls again on a track that may be overwritten, and return their CPU time."""
        calls = [(each.flights.copy(), each.vehicles.copy(), each) for each in self.calls]
        begun_ns = time.process_time_ns()
        for flights, vehicles, call in calls:
            fly(flights, vehicles, track, *call.tables, call.until_s)
        return time.process_time_ns() - begun_ns

    def ns_per_substep(self, track: Array) -> float:
        """Advance over a whole track from the state before the first flight; return the CPU time of
        a row.
        """
        vehicles, last = self.calls[0].vehicles.copy(), len(track) - 1
        begun_ns = time.process_time_ns()
        advance(vehicles, track, last)
        return (time.process_time_ns() - begun_ns) / last


def record(mission: Callable[[], object]) -> Replay:
    """Run a mission and record its flights.

    Raises:
        RuntimeError: some were not recorded.
    """
    calls: list[FlightCall] = []
    tracks: list[Array] = []

    def recorded(flights: Records, vehicles: Records, track: Array, *others: Any) -> int:
        calls.append(FlightCall(flights.copy(), vehicles.copy(), others[:3], others[3]))
        tracks[:] = [track]
        return fly(flights, vehicles, track, *others)

    with patch.object(flight, "compiled_flight", lambda *arrays: recorded):
        mission()
    return Replay(calls, tracks[-1])


def figures(missions: int = MISSIONS, rounds: int = ROUNDS) -> Mapping[str, float]:
    """Time missions and their flights in turn.

    Returns:
        CPU and wall time of a mission and CPU time of its flights in us, means over the
        missions; the ratio of the CPU times; how many flights a mission makes, and the CPU
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
        "flight_cpu_us": kernel_us,
        "mission_over_flight": mission_us / kernel_us,
        "flights_a_mission": statistics.fmean(len(replay.calls) for replay in replays),
        "kernel_ns_a_substep": statistics.median(
            replays[0].ns_per_substep(track) for _ in range(_SUBSTEP_RUNS)
        ),
    }


if __name__ == "__main__":
    print(json.dumps(figures(*map(int, sys.argv[1:3])), indent=2))
