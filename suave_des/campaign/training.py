"""Training of managers: missions in one process, in the order of their runs, and a file at the end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Unpack

from suave_des.arguments import plain_arguments
from suave_des.campaign.inputs import check_inputs
from suave_des.campaign.spec import RUNS_LIMIT, SEED_LIMIT, check_range
from suave_des.errors import InputError
from suave_des.files import check_output_file, write_files
from suave_des.learned import Learned
from suave_des.metrics.result import MissionMetrics
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.simulation.simulator import Simulator

TRAINING_SEED = 0
"""Not that of campaigns, so that a campaign has missions that training has not seen."""


@plain_arguments
def train(
    scenario: str | Path,
    manager: str,
    missions: int,
    out: str | Path,
    *,
    seed: int = TRAINING_SEED,
    overwrite: bool = False,
    on_mission: Callable[[MissionMetrics], None] = lambda metrics: None,
    **replacements: Unpack[Replacements],
) -> Learned:
    """Train a manager, and write the training result.

    Example:
        train("seams2023", "learner:Learner", 500, "policy.json")

    Args:
        scenario: path of a scenario file, or name of a shipped one.
        manager: name, or module:Class; it keeps what it learns in the dict that its hook `recall` is given.
        missions: how many: runs 1 to that.
        out: file to write.
        seed: of everything that is random.
        overwrite: whether the file may exist.
        on_mission: called with the metrics of each mission.
        replacements: as of load_scenario.

    Raises:
        InputError: something given cannot be used, or nothing was learned; nothing is written then.
        MissionError: the manager raised; nothing is written then.
    """
    check_output_file(Path(out), overwrite=overwrite)
    check_range("missions", missions, 1, RUNS_LIMIT)
    check_range("seed", seed, 0, SEED_LIMIT)
    loaded = load_scenario(scenario, **replacements)
    inputs = check_inputs([loaded], [manager], {})
    learned: dict[str, Any] = {}
    simulator = Simulator(loaded, training={manager: learned})
    for run in range(1, missions + 1):
        on_mission(simulator.run(manager, run, seed).metrics)
    if not learned:
        remedy = "keep what it learns in the dict that the hook recall is given"
        raise InputError(f"manager {manager} has learned nothing", remedy=remedy)
    read = dict(sorted({**loaded.inputs, **inputs}.items()))
    result = Learned(manager, loaded.scenario.name, seed, missions, read, learned)
    write_files(Path(out).parent, {Path(out).name: result.text()})
    return result
