"""The whole measurement: what is run, in which order, and what becomes of it."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from suave_des.bench.children import Ended, run
from suave_des.bench.machine import machine
from suave_des.bench.ratio import MANAGER, SCENARIO, SEED

MISSIONS = 10_000
SMALL, LARGE = 1_000, 100_000
"""Missions for which memory is compared."""
_WORKERS = 2
_RATIO_MISSIONS = 100
_STOCK_S = 20.0
"""Mission time that the loop with stock owlready2 and Pellet is run for: a reasoning step each 2 s."""

Say = Callable[[str], None]


@dataclass(frozen=True)
class Bench:
    """What was measured.

    Attributes:
        machine: what it was measured on.
        missions: of a campaign.
        took_s: time that measuring took.
        campaigns: seconds (wall and CPU), missions a second and memory of each campaign, by its name.
        ratio: times of a mission and of its kernel calls; see ratio.figures.
        stock: of the loop with stock owlready2 and Pellet; see stock_loop.figures.
    """

    machine: Mapping[str, Any]
    missions: int
    took_s: float
    campaigns: Mapping[str, Mapping[str, float | None]]
    ratio: Mapping[str, float]
    stock: Mapping[str, float] = field(default_factory=dict)


def measure(missions: int = MISSIONS, *, large: bool = False, say: Say = lambda text: None) -> Bench:
    """Measure everything; the user's own caches are neither used nor changed.

    Args:
        missions: of each campaign that is timed.
        large: whether memory is measured with LARGE missions too.
        say: told what is being measured.

    Raises:
        MeasurementError: one of the programs failed.
        KeyboardInterrupt: Ctrl-C; nothing is left behind.
    """
    begun = time.perf_counter()
    found_machine = machine()
    small = missions > SMALL
    steps = 5 + small + large
    quick = min(1.0, missions / MISSIONS)  # a quicker run measures fewer of everything
    # Programs that were interrupted may still be writing into it as it is removed.
    with tempfile.TemporaryDirectory(prefix="suave-des-bench-", ignore_cleanup_errors=True) as name:
        lab = _Lab(Path(name), steps, say)
        campaigns = {"cold": lab.campaign("from a cold start", missions, _WORKERS)}
        ratio = lab.figures("missions and their vehicle kernel", "ratio", max(20, int(_RATIO_MISSIONS * quick)))
        campaigns["warm"] = lab.campaign("with filled memory and caches", missions, _WORKERS)
        campaigns["one_worker"] = lab.campaign("the same", missions, 1)
        if small:
            campaigns["small"] = lab.campaign("for their memory", SMALL, _WORKERS)
        if large:
            campaigns["large"] = lab.campaign("for their memory", LARGE, _WORKERS)
        stock = lab.figures("stock owlready2 and Pellet", "stock_loop", max(4.0, _STOCK_S * quick))
    took_s = time.perf_counter() - begun
    return Bench(found_machine, missions, took_s, campaigns, ratio, stock)


class _Lab:
    """A folder of its own, with caches that are empty at first."""

    def __init__(self, folder: Path, steps: int, say: Say) -> None:
        self._folder, self._steps, self._say = folder, steps, say
        self._step = 0
        self._environment = {}
        for variable in ("SUAVE_DES_CACHE_DIR", "NUMBA_CACHE_DIR"):
            (folder / variable).mkdir()
            self._environment[variable] = str(folder / variable)

    def campaign(self, what: str, missions: int, workers: int) -> dict[str, float | None]:
        """Run `suave-des campaign` from its start to finished files."""
        processes = f"{workers} workers" if workers > 1 else "1 worker"
        self._tell(f"{missions:,} missions, {processes}, {what}")
        options = {"--managers": MANAGER, "--runs": missions, "--seed": SEED, "--workers": workers, "--out": "out"}
        words = [str(word) for option in options.items() for word in option]
        ended = self._run("suave_des", "campaign", SCENARIO, *words, "--overwrite")
        return {
            "missions": missions,
            "workers": workers,
            "wall_s": ended.wall_s,
            "cpu_s": ended.cpu_s,
            "missions_a_second": missions / ended.wall_s,
            "parent_mb": ended.parent_mb,
            "worker_mb": ended.worker_mb,
        }

    def figures(self, what: str, module: str, argument: float) -> dict[str, float]:
        """Run one of this room's programs, which print figures."""
        self._tell(what)
        found: dict[str, float] = json.loads(self._run(f"suave_des.bench.{module}", str(argument)).out)
        return found

    def _run(self, *arguments: str) -> Ended:
        return run(arguments, self._folder, self._environment)

    def _tell(self, what: str) -> None:
        self._step += 1
        self._say(f"{self._step} of {self._steps}: {what}")
