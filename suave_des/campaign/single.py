"""Single missions: with their whole record, and for training."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Unpack

from suave_des.arguments import plain_arguments
from suave_des.campaign.inputs import check_inputs, provenance
from suave_des.campaign.spec import RUNS_LIMIT, check_range, check_seed
from suave_des.errors import InputError
from suave_des.files import check_output_file, check_output_folder, make_output_folder, write_files
from suave_des.learned import Learned, read_file
from suave_des.metrics.result import MissionMetrics, MissionResult
from suave_des.records.knowledge import KNOWLEDGE_FILE
from suave_des.records.mission_folder import mission_files
from suave_des.registry import ManagerLike, name_of
from suave_des.scenario.loader import LoadedScenario, Replacements, load_scenario
from suave_des.simulation.simulator import Simulator


def run_recorded(
    scenario: str | Path | LoadedScenario,
    manager: ManagerLike = "metacontrol",
    run: int = 1,
    seed: int = 1,
    out: str | Path | None = None,
    *,
    overwrite: bool = False,
    command: Sequence[str] = (),
    on_time: Callable[[float, float], None] | None = None,
    **replacements: Unpack[Replacements],
) -> tuple[LoadedScenario, MissionResult]:
    """Run one mission, as suave_des.run_mission does, whose arguments it has; return its scenario, too.

    Args:
        scenario, manager, run, seed, out, replacements: see suave_des.run_mission.
        overwrite, command: see CampaignSpec.
        on_time: called once per second of mission time with that time and the time limit, in s.

    Raises:
        InputError, MissionError: as suave_des.run_mission.
    """
    folder = None if out is None else Path(out)
    if folder is not None:
        check_output_folder(folder, "mission", overwrite=overwrite)
    check_range("run", run, 1, RUNS_LIMIT)
    check_seed(seed)
    name = name_of(manager)
    loaded = load_scenario(scenario, **replacements)
    given = any(replacements.get(each) for each in ("ontologies", "rules", "disabled_rules"))
    inputs = check_inputs([loaded], [name], given=given)
    result = Simulator(loaded).run(name, run, seed, record=True, on_time=on_time)
    if folder is not None:
        make_output_folder(folder)
        files = mission_files(result, loaded.scenario, provenance(loaded, inputs, command))
        write_files(folder, files, stale=(KNOWLEDGE_FILE,))
    return loaded, result


# Training: missions in one process, in the order of their runs, and a file at the end.

TRAINING_SEED = 0
"""Not that of campaigns, so that a campaign has missions that training has not seen."""


@plain_arguments(lambda: Replacements.__annotations__)
def train(
    scenario: str | Path,
    manager: str,
    missions: int,
    out: str | Path,
    *,
    seed: int = TRAINING_SEED,
    start: str | Path | None = None,
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
        start: file of an earlier training to continue from; None: start from nothing.
        overwrite: whether the file may exist.
        on_mission: called with the metrics of each mission.
        replacements: as of load_scenario.

    Raises:
        InputError: something given cannot be used, or nothing was learned; nothing is written then.
        MissionError: the manager raised; nothing is written then.
    """
    check_output_file(Path(out), overwrite=overwrite)
    check_range("missions", missions, 1, RUNS_LIMIT)
    check_seed(seed)
    loaded = load_scenario(scenario, **replacements)
    inputs = check_inputs([loaded], [manager], given=False)
    before = None if start is None else read_file(Path(start))
    learned: dict[str, Any] = {} if before is None else dict(before.learned)
    simulator = Simulator(loaded, training={manager: learned})
    for run in range(1, missions + 1):
        on_mission(simulator.run(manager, run, seed).metrics)
    if not learned:
        remedy = "keep what it learns in the dict that the hook recall is given"
        raise InputError(f"manager {manager} has learned nothing", remedy=remedy)
    read = dict(sorted({**loaded.inputs, **inputs}.items()))
    earlier = () if before is None else before.trainings
    result = Learned(manager, loaded.scenario.name, seed, missions, read, learned, earlier)
    write_files(Path(out).parent, {Path(out).name: result.text()})
    return result


def blocks(values: Sequence[float], count: int = 10) -> list[tuple[int, int, float]]:
    """Return the means of at most `count` blocks of missions: first and last mission, and mean."""
    size = max(1, -(-len(values) // count))
    parts = [values[first : first + size] for first in range(0, len(values), size)]
    return [(n * size + 1, n * size + len(part), sum(part) / len(part)) for n, part in enumerate(parts)]
