"""What a mission costs beside the bare events of which it is made, mission by mission in turn.

As a program it measures as many missions as its argument says, and prints figures as JSON.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import simpy
from simpy.events import Initialize

from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.bluerov2 import BLUEROV2
from suave_des.vehicle.vehicle import STEP_S, Autopilot, Pose, Vehicle

SCENARIO, MANAGER, SEED = "seams2023", "metacontrol", 1
_WARM_UP = 10
_TRACK_S = 300.0
_KERNEL_EVERY = 10
"""After so many missions the vehicle's kernel is timed once."""


@dataclass(frozen=True)
class Counts:
    """What a mission consists of.

    Attributes:
        events: that SimPy processed.
        processes: that were started.
        substeps: of the vehicle that were computed, those that a change of control made void included.
    """

    events: int
    processes: int
    substeps: int


class _CountingEnvironment(simpy.Environment):
    """An environment that counts; all of one program add to the same counts."""

    events = 0
    processes = 0

    def step(self) -> None:
        """Process an event."""
        _CountingEnvironment.events += 1
        super().step()

    def schedule(self, event: simpy.Event, *args: Any, **kwargs: Any) -> None:
        """Take an event; a process begins with one of a kind of its own."""
        _CountingEnvironment.processes += isinstance(event, Initialize)
        super().schedule(event, *args, **kwargs)


def count(mission: Callable[[], object]) -> Counts:
    """Events, processes and substeps of a mission.

    Raises:
        RuntimeError: nothing was counted, so missions are made of something else than this looks at.
    """
    _CountingEnvironment.events = _CountingEnvironment.processes = 0
    with patch.object(simpy, "Environment", _CountingEnvironment), _counting_substeps() as substeps:
        mission()
    counts = Counts(_CountingEnvironment.events, _CountingEnvironment.processes, substeps[0])
    if not (counts.events and counts.processes and counts.substeps):
        raise RuntimeError(f"a mission without events, processes or substeps: {counts}")
    return counts


@contextmanager
def _counting_substeps() -> Iterator[list[int]]:
    """Counts by how much the vehicles' last computed row advances."""
    counted = [0]
    name = "computed_row"

    def get(vehicle: Vehicle) -> int:
        return int(vehicle.__dict__[name])

    def put(vehicle: Vehicle, row: int) -> None:
        counted[0] += max(0, row - vehicle.__dict__.get(name, row))
        vehicle.__dict__[name] = row

    with patch.object(Vehicle, name, property(get, put), create=True):
        yield counted


def bare_program(events: int, processes: int) -> simpy.Environment:
    """Stand-in: a SimPy program that does nothing but its events, from its set-up to its end.

    Args:
        events: that SimPy is to process; each process begins with one and ends with one.
        processes: that are to be started.
    """
    env = simpy.Environment()
    waits, more = divmod(max(0, events - 2 * processes), processes)
    for number in range(processes):
        env.process(_waiting(env, waits + (number < more), 1.0 + number / processes))
    env.run()
    return env


def _waiting(env: simpy.Environment, times: int, delay_s: float) -> Generator[simpy.Event, None, None]:
    for _ in range(times):
        yield env.timeout(delay_s)


def kernel_ns_per_substep() -> float:
    """CPU time of one substep: a mission's length towards a far set-point, with a thruster lost on the way."""
    vehicle = Vehicle(
        BLUEROV2, Autopilot(0.5, 0.35, 0.35, 0.5), Pose(-17.0, 2.57, -18.5, 0.0, 0.0, 0.0), _TRACK_S + STEP_S
    )
    vehicle.command(0.0, 100.0, 50.0, -17.0)
    rows = round(_TRACK_S / STEP_S)
    begun = time.process_time_ns()
    vehicle.look_ahead(rows // 8)
    vehicle.set_thruster_health(_TRACK_S / 8, 1, 0.0)
    vehicle.look_ahead(rows)
    return (time.process_time_ns() - begun) / rows


def _timed_ns(program: Callable[[], object]) -> tuple[int, int]:
    """CPU time and time on the wall of a program."""
    cpu, wall = time.process_time_ns(), time.perf_counter_ns()
    program()
    return time.process_time_ns() - cpu, time.perf_counter_ns() - wall


def _means_us(times_ns: list[tuple[int, int]]) -> tuple[float, float]:
    cpu, wall = zip(*times_ns, strict=True)
    return statistics.fmean(cpu) / 1e3, statistics.fmean(wall) / 1e3


def figures(missions: int) -> Mapping[str, float]:
    """Times of missions, of bare programs and of the vehicle's kernel, one after the other in turn."""
    simulator = Simulator(load_scenario(SCENARIO))

    def mission(run: int) -> object:
        return simulator.run(MANAGER, run, SEED)

    for run in range(1, _WARM_UP + 1):
        mission(run)
        kernel_ns_per_substep()
    counts = {run: count(lambda run=run: mission(run)) for run in range(1, missions + 1)}  # type: ignore[misc]
    missions_ns, bare_ns, kernel_ns = [], [], []
    for run, counted in counts.items():
        missions_ns.append(_timed_ns(lambda run=run: mission(run)))  # type: ignore[misc]
        bare_ns.append(_timed_ns(lambda of=counted: bare_program(of.events, of.processes)))  # type: ignore[misc]
        if run % _KERNEL_EVERY == 1:
            kernel_ns.append(kernel_ns_per_substep())
    substep_ns = statistics.median(kernel_ns)
    mean_substeps = statistics.fmean(each.substeps for each in counts.values())
    mission_us, mission_wall_us = _means_us(missions_ns)
    bare_us, bare_wall_us = _means_us(bare_ns)
    apart_us = mission_us - mean_substeps * substep_ns / 1e3
    return {
        "missions": missions,
        "events_a_mission": statistics.fmean(each.events for each in counts.values()),
        "processes_a_mission": statistics.fmean(each.processes for each in counts.values()),
        "substeps_a_mission": mean_substeps,
        "kernel_ns_a_substep": substep_ns,
        "mission_wall_us": mission_wall_us,
        "bare_wall_us": bare_wall_us,
        "mission_cpu_us": mission_us,
        "mission_without_kernel_cpu_us": apart_us,
        "bare_cpu_us": bare_us,
        "mission_without_kernel_over_bare": apart_us / bare_us,
    }


if __name__ == "__main__":
    print(json.dumps(figures(int(sys.argv[1]))))
