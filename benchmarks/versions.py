"""Compare the speed of two installations of suave-des, in turns and in one run.

    python benchmarks/versions.py BEFORE AFTER [--missions N] [--rounds N] [--processes N]

An installation is a virtual environment or a checkout, which runs with this Python. Each gets some
processes that stay, and caches of its own. In each round all run the same missions of each scenario
and manager, one directly after the other, so that other work on the machine slows all down. CPU
time counts, of each process the quickest round, and their mean: two processes of the same code may
differ by a tenth, throughout.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import mean

SCENARIOS = ("seams2023", "planta_exp1")
MANAGERS = ("metacontrol", "none", "random", "bt")
SEED = 1


def serve(missions: int) -> None:
    """For each line "scenario manager" of standard input, run missions and print their CPU time in
    s.
    """
    from suave_des import load_scenario
    from suave_des.simulation.simulator import Simulator

    simulators: dict[str, Simulator] = {}
    for line in sys.stdin:
        scenario, manager = line.split()
        if scenario not in simulators:
            simulators[scenario] = Simulator(load_scenario(scenario))
        began_s = time.process_time()
        for run in range(1, missions + 1):
            simulators[scenario].run(manager, run, SEED)
        print(time.process_time() - began_s, flush=True)


class Installation:
    """A process that runs missions with one installation.

    Args:
        path: of a virtual environment or a checkout.
        missions: to run at each request.
        caches: empty folder.

    Raises:
        SystemExit: it is neither.
    """

    def __init__(self, path: Path, missions: int, caches: Path) -> None:
        python, environment = path / "bin" / "python", dict(os.environ)
        if python.exists():
            environment.pop("PYTHONPATH", None)
        elif (path / "suave_des").is_dir():
            python, environment["PYTHONPATH"] = Path(sys.executable), str(path.resolve())
        else:
            raise SystemExit(f"versions.py: {path} is neither a virtual environment nor a checkout")
        environment["SUAVE_DES_CACHE_DIR"] = str(caches)
        words = [str(python.absolute()), str(Path(__file__).resolve()), "--serve", str(missions)]
        self._process = subprocess.Popen(
            words,
            env=environment,
            cwd=caches,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    def cpu_s(self, scenario: str, manager: str) -> float:
        """Run the missions of a scenario and manager, and return their CPU time.

        Raises:
            SystemExit: the installation cannot run them; it has printed why.
        """
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            print(scenario, manager, file=self._process.stdin, flush=True)
            return float(self._process.stdout.readline())
        except (BrokenPipeError, ValueError):
            raise SystemExit("versions.py: an installation has ended early") from None

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()


def compare(
    installations: Sequence[Installation],
    rounds: int,
    scenarios: Sequence[str],
    managers: Sequence[str],
) -> dict[tuple[str, str], list[float]]:
    """Return the least CPU time of each process, by scenario and manager; the first round is not
    counted.
    """
    cells = [(scenario, manager) for scenario in scenarios for manager in managers]
    least_s = {cell: [float("inf")] * len(installations) for cell in cells}
    for turn in range(rounds + 1):
        for cell in cells:
            order = list(enumerate(installations))
            for place, each in order if turn % 2 else order[::-1]:
                took_s = each.cpu_s(*cell)
                if turn:  # it has compiled, and filled the caches
                    least_s[cell][place] = min(least_s[cell][place], took_s)
    return least_s


def main() -> None:
    """Compare, and print a table of times and ratios."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("installations", nargs=2, type=Path, metavar="PATH")
    parser.add_argument(
        "--missions", type=int, default=100, help="missions of each kind in a round (default: 100)"
    )
    parser.add_argument("--rounds", type=int, default=5, help="rounds that count (default: 5)")
    parser.add_argument(
        "--processes", type=int, default=3, help="processes of each installation (default: 3)"
    )
    parser.add_argument("--scenarios", default=",".join(SCENARIOS))
    parser.add_argument("--managers", default=",".join(MANAGERS))
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        running: list[Installation] = []
        try:
            for number, path in enumerate(chosen.installations):
                caches = Path(name) / str(number)
                caches.mkdir()
                running.extend(
                    Installation(path, chosen.missions, caches) for _ in range(chosen.processes)
                )
            found = compare(
                running, chosen.rounds, chosen.scenarios.split(","), chosen.managers.split(",")
            )
        finally:
            for each in running:
                each.end()
    print("CPU time of a mission, ms")
    print(f"{'scenario':<12} {'manager':<12} {'before':>9} {'after':>9} {'after / before':>15}")
    for (scenario, manager), least_s in found.items():
        before_s, after_s = mean(least_s[: chosen.processes]), mean(least_s[chosen.processes :])
        times = f"{1e3 * before_s / chosen.missions:9.3f} {1e3 * after_s / chosen.missions:9.3f}"
        print(f"{scenario:<12} {manager:<12} {times} {after_s / before_s:15.3f}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(int(sys.argv[2]))
    else:
        main()
