"""Measures steps of the Gymnasium environment, and missions of managers that are programs.

    python benchmarks/interfaces.py [--windows N]

Each figure is the best of several short windows, so that what else the machine does counts as
little as possible; in CPU time of this process (and of the program), and in real time.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import gymnasium
import numpy as np
from numpy.typing import NDArray

from suave_des.interfaces import exec as programs
from suave_des.interfaces.gym import PipelineInspection
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

EXAMPLES = Path(__file__).resolve().parents[1] / "docs" / "examples" / "exec"
STEPS, MISSIONS = 4000, 50
"""Of a window."""


def best(windows: int, window: Callable[[], None]) -> tuple[float, float]:
    """The shortest CPU time and the shortest real time of a window, in s."""
    cpu_s, real_s = [], []
    for _ in range(windows):
        began = time.process_time(), time.perf_counter()
        window()
        cpu_s.append(time.process_time() - began[0])
        real_s.append(time.perf_counter() - began[1])
    return min(cpu_s), min(real_s)


def measure_steps(windows: int) -> None:
    """Measure steps of one environment, one step a period of adaptation (2 s), and resets with
    them.
    """
    simulator = Simulator(load_scenario("seams2023"))
    environment = PipelineInspection(simulator)
    chance = np.random.default_rng(1)
    for each_steps in (1, 5, STEPS):
        actions = _actions(environment, chance, each_steps)
        environment.reset(seed=1)

        def window(actions: list[NDArray[np.int64]] = actions) -> None:
            for action in actions:
                if environment.step(action)[2]:
                    environment.reset()

        window()
        cpu_s, real_s = best(windows, window)
        when = "never" if each_steps == STEPS else f"after {each_steps} steps"
        print(
            f"gym, another action {when:13}: {STEPS / cpu_s:8,.0f} steps/s of CPU time, {STEPS / real_s:8,.0f} of real"
        )
    environment.close()


def _actions(
    environment: gymnasium.Env, chance: np.random.Generator, each_steps: int
) -> list[NDArray[np.int64]]:
    assert isinstance(environment.action_space, gymnasium.spaces.MultiDiscrete)
    drawn = chance.integers(environment.action_space.nvec, size=(-(-STEPS // each_steps), 2))
    return [np.array(row) for row in np.repeat(drawn, each_steps, axis=0)[:STEPS]]


def commands(folder: Path) -> Iterator[tuple[str, str]]:
    """The examples whose language is on this machine, and their managers."""
    if shutil.which("gcc"):
        subprocess.run(["gcc", "-O2", "-o", folder / "manager", EXAMPLES / "manager.c"], check=True)
        yield "C", f"exec:{folder / 'manager'}"
    for language, program, file in (
        ("Perl", "perl", "manager.pl"),
        ("JavaScript", "node", "manager.js"),
    ):
        if shutil.which(program):
            yield language, f"exec:{program} {EXAMPLES / file}"


def measure_missions(windows: int) -> None:
    """Measure missions with programs, and the same missions with a manager in this process."""
    simulator = Simulator(load_scenario("seams2023"))
    with tempfile.TemporaryDirectory() as name:
        for what, manager in (("threshold", "threshold"), *commands(Path(name))):
            simulator.run(manager, 1, 1)

            def window(manager: str = manager) -> None:
                for run in range(1, MISSIONS + 1):
                    simulator.run(manager, run, 1)

            before_s = _children_s()
            cpu_s, real_s = best(windows, window)
            programs.end_programs()
            program_s = (
                _children_s() - before_s
            ) / windows  # a mean: it is known only when the program has ended
            own_ms, program_ms = cpu_s / MISSIONS * 1e3, program_s / MISSIONS * 1e3
            both = 2e3 / (own_ms + program_ms)
            print(
                f"{what:10}: a mission takes {own_ms:5.2f} ms of CPU time, and {program_ms:5.2f} in the program: two "
                f"cores {both:4.0f} missions/s; {MISSIONS / real_s:4.0f}/s of real time in one process"
            )


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure both."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--windows", type=int, default=8)
    windows: int = parser.parse_args().windows
    measure_steps(windows)
    measure_missions(windows)


if __name__ == "__main__":
    main()
