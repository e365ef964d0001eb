"""Measure how fast missions are on this machine, and compare the figures with the project's goals."""

from __future__ import annotations

import json
import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from suave_des import __version__
from suave_des.bench import ratio as ratio_program
from suave_des.bench.programs import run
from suave_des.bench.ratio import MANAGER, SCENARIO, SEED

MISSIONS = 10_000
SMALL, LARGE = 1_000, 100_000
"""Missions for which memory is compared."""
_WORKERS = 2
_INFERENCES = 10
_PARENT_MB, _WORKER_MB, _SAME_SHARE = 300.0, 400.0, 0.1
"""Goals for memory, and by which share it may differ between few and many missions to count as the same."""
_LIBRARIES = ("simpy", "numpy", "numba", "owlready2", "pydantic")
_BUSY = 0.25
"""Load for each core from which on a machine counts as busy."""

MET = {True: "yes", False: "no", None: "-"}
"""Whether a goal is met, in words."""
_GOALS: Mapping[str, tuple[str, str, float, bool]] = {
    "metacontrol missions a second, 2 workers, CSV written": (">=", "/s", 1_500, True),
    "CPU time of a mission / of its vehicle kernel": ("<=", "times", 2.2, False),
    "vehicle kernel, a 6-DOF substep": ("<=", "ns", 80, False),
    "2 workers / 1 worker": (">=", "times", 1.9, True),
    "{}, filled memory and caches": ("<=", "s", 8, True),
    "{}, cold start": ("<=", "s", 20, True),
}
"""Goals by what is measured: limit, unit, and whether it holds for MISSIONS missions only."""


@dataclass(frozen=True)
class CampaignTime:
    """A campaign that was measured, from the command's start to finished files.

    Attributes:
        missions: of the campaign.
        workers: processes that ran them.
        wall_s: time from start to end.
        cpu_s: CPU time of all processes.
        missions_a_second: by wall time.
        parent_mb: greatest resident memory of the first process; none where the system does not report it.
        worker_mb: the same of the worker that had most; none also where there was no worker.
    """

    missions: int
    workers: int
    wall_s: float
    cpu_s: float
    missions_a_second: float
    parent_mb: float | None
    worker_mb: float | None


@dataclass(frozen=True)
class Bench:
    """All that was measured.

    Attributes:
        machine: what it was measured on.
        missions: of a campaign.
        took_s: time that measuring took.
        campaigns: by name.
        ratio: times of a mission and of its kernel calls; see ratio.figures.
        stock: times of inferences with stock owlready2 and Pellet; see stock_reasoner.figures.
    """

    machine: Mapping[str, Any]
    missions: int
    took_s: float
    campaigns: Mapping[str, CampaignTime]
    ratio: Mapping[str, float]
    stock: Mapping[str, float]


@dataclass(frozen=True)
class GoalRow:
    """A figure and its goal.

    Attributes:
        what: was measured.
        goal: in words.
        value: as measured, in `unit`; none: this system does not report it.
        unit: of the value.
        met: whether the goal is met; none where it is for another number of missions, or there is no value.
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
            return "not reported by this system"
        digits = 0 if abs(self.value) >= 100 else 1 if abs(self.value) >= 10 else 2
        return f"{self.value:,.{digits}f} {self.unit}"


@dataclass(frozen=True)
class Program:
    """A way to run a mission, with the wall time that one takes in one process."""

    what: str
    mission_s: float
    times_a_mission: float
    note: str


def measure(
    missions: int = MISSIONS, *, large: bool = False, report: Callable[[str], None] = lambda text: None
) -> Bench:
    """Measure everything; the user's own caches are neither used nor changed.

    Args:
        missions: of each campaign that is timed.
        large: whether memory is measured with LARGE missions too.
        report: called with what is being measured.

    Raises:
        MeasurementError: one of the programs failed.
        KeyboardInterrupt: Ctrl-C; nothing is left behind.
    """
    begun = time.perf_counter()
    found_machine = machine()
    campaigns: dict[str, CampaignTime] = {}
    figures: dict[str, dict[str, float]] = {}
    quick = min(1.0, missions / MISSIONS)  # a quicker run measures fewer of everything
    plan: list[tuple[str, str, int, int]] = [
        ("cold", "from a cold start", missions, _WORKERS),
        ("ratio", "missions and their vehicle kernel", max(20, int(ratio_program.MISSIONS * quick)), 0),
        ("warm", "with filled memory and caches", missions, _WORKERS),
        ("one_worker", "the same", missions, 1),
        *([("small", "for their memory", SMALL, _WORKERS)] if missions > SMALL else ()),
        *([("large", "for their memory", LARGE, _WORKERS)] if large else ()),
        ("stock_reasoner", "stock owlready2 and Pellet", max(2, int(_INFERENCES * quick)), 0),
    ]
    # Programs that were interrupted may still be writing into it as it is removed.
    with tempfile.TemporaryDirectory(prefix="suave-des-bench-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        environment = {each: str(folder / each) for each in ("SUAVE_DES_CACHE_DIR", "NUMBA_CACHE_DIR")}
        for cache in environment.values():
            Path(cache).mkdir()
        for step, (key, what, number, workers) in enumerate(plan, 1):
            processes = f"{number:,} missions, {workers} {'workers' if workers > 1 else 'worker'}, " if workers else ""
            report(f"{step} of {len(plan)}: {processes}{what}")
            if workers:
                campaigns[key] = _campaign(folder, environment, number, workers)
            else:
                figures[key] = json.loads(run((f"suave_des.bench.{key}", str(number)), folder, environment).out)
    took_s = time.perf_counter() - begun
    return Bench(found_machine, missions, took_s, campaigns, figures["ratio"], figures["stock_reasoner"])


def _campaign(folder: Path, environment: Mapping[str, str], missions: int, workers: int) -> CampaignTime:
    options = {"--managers": MANAGER, "--runs": missions, "--seed": SEED, "--workers": workers, "--out": "out"}
    words = [str(word) for option in options.items() for word in option]
    ended = run(("suave_des", "campaign", SCENARIO, *words, "--overwrite"), folder, environment)
    rate = missions / ended.wall_s
    return CampaignTime(missions, workers, ended.wall_s, ended.cpu_s, rate, ended.parent_mb, ended.worker_mb)


def goal_rows(bench: Bench) -> list[GoalRow]:
    """Compare the figures with their goals, in the order of the goals."""
    warm, cold, one = (bench.campaigns[name] for name in ("warm", "cold", "one_worker"))
    values = (
        warm.missions_a_second,
        bench.ratio["mission_over_kernel"],
        bench.ratio["kernel_ns_a_substep"],
        one.wall_s / warm.wall_s,
        warm.wall_s,
        cold.wall_s,
    )
    rows = []
    for (what, (sense, unit, limit, for_all)), value in zip(_GOALS.items(), values, strict=True):
        met = None if for_all and bench.missions < MISSIONS else value >= limit if sense == ">=" else value <= limit
        rows.append(GoalRow(what.format(f"{bench.missions:,} missions"), f"{sense} {limit:,} {unit}", value, unit, met))
    return [*rows, *_memory_rows(bench)]


def _memory_rows(bench: Bench) -> Iterator[GoalRow]:
    for process, goal in (("parent", _PARENT_MB), ("worker", _WORKER_MB)):
        names = [name for name in ("small", "warm", "large", "cold") if name in bench.campaigns]
        peaks_mb: dict[str, float | None] = {name: getattr(bench.campaigns[name], f"{process}_mb") for name in names}
        for name, peak_mb in peaks_mb.items():
            which = "cold start" if name == "cold" else f"{bench.campaigns[name].missions:,} missions"
            met = None if peak_mb is None else peak_mb <= goal
            yield GoalRow(f"memory of a {process}, {which}", f"<= {goal:g} MB", peak_mb, "MB", met)
        known = [peak_mb for name, peak_mb in peaks_mb.items() if peak_mb is not None and name != "cold"]
        if len(known) > 1:
            growth = max(known) / min(known) - 1.0
            met = growth <= _SAME_SHARE if bench.missions >= MISSIONS else None
            what = f"  the same for few and many: {process}"
            yield GoalRow(what, f"within {_SAME_SHARE:.0%}", 100 * growth, "%", met)


def programs(bench: Bench) -> list[Program]:
    """Compare a mission here with one as one would write it with stock libraries."""
    mission_s, stock = bench.ratio["mission_wall_us"] / 1e6, bench.stock
    note = f"extrapolated from {stock['inferences_measured']:.0f} of {stock['inferences_a_mission']:.0f} inferences"
    return [
        Program("suave-des, metacontrol", mission_s, 1.0, "all of it: vehicle, functions, monitors, reasoning"),
        Program("stock owlready2 and Pellet", stock["mission_s"], stock["mission_s"] / mission_s, note),
    ]


def machine() -> dict[str, Any]:
    """Describe what decides how fast missions are."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return {
        "processor": _processor(),
        "cores": cores,
        "load": [round(load, 2) for load in os.getloadavg()],
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "suave-des": __version__,
        **{name: version(name) for name in _LIBRARIES},
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(errors="replace").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(filter(None, names), platform.processor() or platform.machine())


def in_words(found: Mapping[str, Any]) -> str:
    """Describe a machine in one line."""
    libraries = ", ".join(f"{name} {found[name]}" for name in ("suave-des", *_LIBRARIES))
    cores, load = found["cores"], found["load"][0]
    return f"{found['processor']}, {cores} cores, load {load:.2f} at the start; {found['python']}, {libraries}"


def is_busy(found: Mapping[str, Any]) -> bool:
    """Whether other programs used so much of the machine at the start that the figures are too slow."""
    return bool(found["load"][0] > _BUSY * found["cores"])
