"""Print a hash of all that many missions give, to show that a change of the code changes none.

    python benchmarks/same_missions.py [--missions N] [--scenarios NAMES] > FILE

Each line has a scenario, a manager, whether the missions are recorded, and the hash: of the
metrics, or of them with events, trajectory and states of knowledge, to the last digit. Two checkouts
whose files are the same simulate the same; PYTHONPATH says which one runs. A manager that cannot
work with a scenario has the reason in place of the hash.
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Iterator

from suave_des import InputError, MissionError, load_scenario
from suave_des.metrics.result import MissionResult
from suave_des.registry import is_built_in, manager_names
from suave_des.resources import shipped_folder
from suave_des.simulation.simulator import Simulator

SEED = 1
MANAGERS = (*filter(is_built_in, manager_names()), "fixed:fd_spiral_medium")


def scenarios() -> Iterator[str]:
    """Name the shipped scenarios; the files beside them describe modes and a campaign."""
    for path in sorted(shipped_folder("scenarios").glob("*.yaml")):
        if not path.stem.endswith(("_modes", "_campaign")):
            yield path.stem


def everything(result: MissionResult) -> str:
    """Write all of a mission's result, with each float as its shortest exact text."""
    parts = result.metrics, result.further, result.drawn, result.remarks
    recorded = result.events, tuple(result.trajectory), result.knowledge
    return "\n".join(map(repr, (*parts, *recorded)))


def digest(simulator: Simulator, manager: str, missions: int, *, record: bool) -> str:
    """Hash the results of some missions; or say why there are none."""
    found = hashlib.sha256()
    try:
        for run in range(1, missions + 1):
            found.update(everything(simulator.run(manager, run, SEED, record=record)).encode())
    except (InputError, MissionError) as error:
        return f"none: {error}".splitlines()[0].replace(str(shipped_folder("scenarios")), "")
    return found.hexdigest()


def main() -> None:
    """Print the hashes."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--missions", type=int, default=200, help="of each kind (default: 200)")
    parser.add_argument("--scenarios", default=",".join(scenarios()), help="(default: all shipped)")
    parser.add_argument("--managers", default=",".join(MANAGERS), help="(default: all built-in)")
    chosen = parser.parse_args()
    for scenario in chosen.scenarios.split(","):
        simulator = Simulator(load_scenario(scenario))
        for manager in chosen.managers.split(","):
            for record in (False, True):
                found = digest(simulator, manager, chosen.missions, record=record)
                word = "recorded" if record else "bare"
                print(f"{scenario} {manager} {word} {found}", flush=True)


if __name__ == "__main__":
    main()
