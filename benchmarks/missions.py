"""What missions and commands cost on this machine: python benchmarks/missions.py [--json FILE].

Measures a mission of each manager (median and slowest of many, after a first one that pays for start-up), the command
`reproduce --runs 20` from start to finish, and `--help`. Nothing here is a test: no figure makes it fail.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from suave_des import __version__
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

SCENARIO = "seams2023"
SEED = 1


def elapsed_s(work: Callable[[], object]) -> float:
    """Wall-clock time of a call."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def mission_figures(missions: int) -> dict[str, float]:
    """First, median and slowest mission of each manager in this process, in ms."""
    figures: dict[str, float] = {}
    simulator = Simulator(load_scenario(SCENARIO))
    for manager in ("none", "random", "metacontrol"):
        times_ms = [
            1000.0 * elapsed_s(lambda manager=manager, run=run: simulator.run(manager, run, SEED))  # type: ignore[misc]
            for run in range(missions + 1)
        ]
        figures[f"{manager} mission, first one, ms"] = times_ms[0]
        figures[f"{manager} mission, median, ms"] = statistics.median(times_ms[1:])
        figures[f"{manager} mission, slowest, ms"] = max(times_ms[1:])
    return figures


def command_s(*arguments: str) -> float:
    """Wall-clock time of a `suave-des` command."""
    command = [sys.executable, "-m", "suave_des", *arguments]
    return elapsed_s(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL))


def main() -> None:
    """Measure, print a table, and write JSON if asked."""
    parser = argparse.ArgumentParser(description="What missions and commands cost on this machine.")
    parser.add_argument("--missions", type=int, default=50, help="missions of each manager (default 50)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to a file")
    arguments = parser.parse_args()

    figures = mission_figures(arguments.missions)
    figures["suave-des --help, s"] = statistics.median(command_s("--help") for _ in range(5))
    figures["suave-des reproduce --runs 20, 2 workers, s"] = command_s("reproduce", "--runs", "20", "--workers", "2")

    machine = {
        "suave-des": __version__,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
    }
    print(", ".join(f"{name} {value}" for name, value in machine.items()))
    for name, value in figures.items():
        print(f"{name:<46}{value:10.2f}")
    if arguments.json is not None:
        rounded = {name: round(value, 3) for name, value in figures.items()}
        arguments.json.write_text(json.dumps({**machine, "figures": rounded}, indent=2) + "\n")


if __name__ == "__main__":
    main()
