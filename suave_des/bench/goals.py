"""What was measured beside the goals: one row for each, and the stand-in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from suave_des.bench.bench import MISSIONS, Bench

PARENT_MB, WORKER_MB, SAME_SHARE = 300.0, 400.0, 0.1
"""Goals for memory, and by which share it may differ between few and many missions to count as the same."""
MET = {True: "yes", False: "no", None: "-"}
"""Whether a goal is met, in words."""


@dataclass(frozen=True)
class Row:
    """One thing that was measured.

    Attributes:
        what: that was measured.
        goal: in words; empty: there is none.
        value: as measured, in `unit`; none: this system does not tell.
        met: whether the goal is met; none where it is for another number of missions, or there is none.
    """

    what: str
    goal: str
    value: float | None
    unit: str
    met: bool | None

    @property
    def measured(self) -> str:
        """The value with its unit."""
        if self.value is None:
            return "not told by this system"
        digits = 0 if abs(self.value) >= 100 else 1 if abs(self.value) >= 10 else 2
        return f"{self.value:,.{digits}f} {self.unit}".rstrip()


def goal_rows(bench: Bench) -> list[Row]:
    """What has a goal, in the order of the goals."""
    whole = bench.missions >= MISSIONS
    warm, cold, one = (bench.campaigns[name] for name in ("warm", "cold", "one_worker"))
    number = f"{bench.missions:,} missions"

    def row(what: str, goal: str, value: float | None, unit: str, is_met: Callable[[float], bool], told: bool) -> Row:
        return Row(what, goal, value, unit, is_met(value) if told and value is not None else None)

    rate, warm_s, cold_s = warm["missions_a_second"], warm["wall_s"], cold["wall_s"]
    gain = None if not warm["wall_s"] or one["wall_s"] is None else one["wall_s"] / warm["wall_s"]
    return [
        row(
            "metacontrol missions a second, 2 workers, CSV written", ">= 1,500", rate, "/s", lambda v: v >= 1500, whole
        ),
        row(
            "CPU of a mission / of its vehicle kernel",
            "<= 2.2 times",
            bench.ratio["mission_over_kernel"],
            "times",
            lambda v: v <= 2.2,
            True,
        ),
        row(
            "vehicle kernel, a 6-DOF substep",
            "<= 80 ns",
            bench.ratio["kernel_ns_a_substep"],
            "ns",
            lambda v: v <= 80,
            True,
        ),
        row("2 workers against 1", ">= 1.9 times", gain, "times", lambda v: v >= 1.9, whole),
        row(f"{number}, filled memory and caches", "<= 8 s", warm_s, "s", lambda v: v <= 8, whole),
        row(f"{number}, cold start", "<= 20 s", cold_s, "s", lambda v: v <= 20, whole),
        *_memory_rows(bench),
    ]


def _memory_rows(bench: Bench) -> Iterator[Row]:
    names = [name for name in ("small", "warm", "large") if name in bench.campaigns]
    for place, goal in (("parent", PARENT_MB), ("worker", WORKER_MB)):
        peaks = {name: bench.campaigns[name][f"{place}_mb"] for name in (*names, "cold")}
        for name, peak in peaks.items():
            which = "cold start" if name == "cold" else f"{bench.campaigns[name]['missions']:,.0f} missions"
            met = None if peak is None else peak <= goal
            yield Row(f"memory of a {place}, {which}", f"<= {goal:g} MB", peak, "MB", met)
        known = [peak for name, peak in peaks.items() if peak is not None and name != "cold"]
        if len(known) > 1:
            growth = max(known) / min(known) - 1.0
            told = growth <= SAME_SHARE if bench.missions >= MISSIONS else None
            yield Row(f"  the same for few and many: {place}", f"within {SAME_SHARE:.0%}", 100 * growth, "%", told)


@dataclass(frozen=True)
class Program:
    """A way to run a mission, with the time that one takes in one process, on the wall."""

    what: str
    mission_s: float
    times_a_mission: float
    note: str


def programs(bench: Bench) -> list[Program]:
    """A mission here, and as one would write it with stock libraries."""
    mission_s = bench.ratio["mission_wall_us"] / 1e6
    measured, whole = bench.stock["inferences_measured"], bench.stock["inferences_a_mission"]
    rows = (
        ("suave-des, metacontrol", mission_s, "all of it: vehicle, functions, monitors, reasoning"),
        (
            "SimPy with stock owlready2 and Pellet",
            bench.stock["mission_s"],
            f"extrapolated from {measured:.0f} of {whole:.0f} reasoning steps; the vehicle is a point",
        ),
    )
    return [Program(what, seconds, seconds / mission_s, note) for what, seconds, note in rows]
