"""Single missions: outside campaigns, repeated from a campaign, and for training."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import chdir, closing, contextmanager
from dataclasses import astuple, dataclass, fields
from operator import attrgetter
from pathlib import Path
from typing import Any, Unpack

from suave_des.campaign.inputs import check_inputs, check_trusted, provenance, read_inputs
from suave_des.campaign.knowledge_records import KNOWLEDGE_FILE, knowledge_text
from suave_des.campaign.missions import COLUMNS, further_of, row_of
from suave_des.campaign.spec import RUNS_LIMIT, CampaignSpec, check_range, check_seed, read_campaign_file
from suave_des.campaign.store import STORE_FILE, Store
from suave_des.campaign.variation import Variation
from suave_des.errors import InputError, did_you_mean
from suave_des.files import check_output_file, check_output_folder, csv_text, json_text, make_output_folder, write_files
from suave_des.managing.learned import Learned, read_file
from suave_des.metrics.result import Event, MissionMetrics, MissionResult, TrajectoryPoint
from suave_des.registry import ManagerLike, name_of
from suave_des.scenario.loader import LoadedScenario, Replacements, load_scenario
from suave_des.simulation.simulator import Simulator

MISSION_FILE, EVENTS_FILE, TRAJECTORY_FILE = "mission.json", "events.csv", "trajectory.csv"

EVENT_COLUMNS = tuple(field.name for field in fields(Event))
TRAJECTORY_COLUMNS = tuple(field.name for field in fields(TrajectoryPoint) if field.name != "further")
"""Columns that every trajectory.csv has."""


def run_mission(
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
) -> MissionResult:
    """Run one mission and keep its events and trajectory; it equals this run of a campaign with this seed.

    Example:
        mission = run_mission("seams2023", "metacontrol", run=1, seed=8)
        print(mission.metrics.search_time_s, len(mission.events))

    Args:
        scenario: path of a scenario file, name of a shipped one, or a loaded one.
        manager: name of the managing subsystem, module:Class, or its class.
        run: number of the run, from 1.
        seed: of everything that is random.
        out: folder for mission.json, events.csv, trajectory.csv and, of a manager that reasons,
            knowledge.jsonl; it is made if its parent exists. None: no files.
        overwrite, command: see CampaignSpec.
        on_time: called once per second of mission time with that time and the time limit, in s.
        replacements: ontologies, modes_file, reasoner, rules, disabled_rules, values, manager_options, as of
            load_scenario.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        MissionError: the manager raised; nothing is written then.
    """
    folder = None if out is None else Path(out)
    if folder is not None:
        check_output_folder(folder, "mission", overwrite=overwrite)
    check_range("run", run, 1, RUNS_LIMIT)
    check_seed(seed)
    name = name_of(manager)
    loaded = load_scenario(scenario, **replacements)
    given = any(replacements.get(each) for each in ("ontologies", "rules", "disabled_rules"))
    inputs = check_inputs(loaded, [name], given=given)
    result = Simulator(loaded).run(name, run, seed, record=True, on_time=on_time)
    if folder is not None:
        make_output_folder(folder)
        write_files(folder, _files(loaded, result, inputs, command), stale=(KNOWLEDGE_FILE,))
    return result


def _files(
    loaded: LoadedScenario, result: MissionResult, inputs: Mapping[str, str], command: Sequence[str]
) -> dict[str, str]:
    mission = {
        "metrics": dict(zip((*COLUMNS, *result.further), (*row_of(result.metrics), *further_of(result)), strict=True)),
        "drawn": dict(sorted(result.drawn.items())),
        "scenario": loaded.scenario.model_dump(mode="json"),
        **provenance(loaded, inputs, command),
    }
    files = {
        MISSION_FILE: json_text(mission),
        EVENTS_FILE: csv_text(EVENT_COLUMNS, map(astuple, result.events)),
        TRAJECTORY_FILE: _trajectory_text(result.trajectory),
    }
    if result.knowledge:
        files[KNOWLEDGE_FILE] = knowledge_text(result.knowledge)
    return files


def _trajectory_text(points: Sequence[TrajectoryPoint]) -> str:
    cells, further = attrgetter(*TRAJECTORY_COLUMNS), tuple(points[0].further)
    rows = ((*cells(point), *(point.further[name] for name in further)) for point in points)
    return csv_text((*TRAJECTORY_COLUMNS, *further), rows)


# Training: missions in one process, in the order of their runs, and a file at the end.

TRAINING_SEED = 0
"""Not that of campaigns, so that a campaign has missions that training has not seen."""


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
        manager: name, or module:Class; it keeps what it learns in `system.learned`.
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
    inputs = check_inputs(loaded, [manager], given=False)
    learned: dict[str, Any] = {} if start is None else dict(read_file(Path(start)).learned)
    simulator = Simulator(loaded, training={manager: learned})
    for run in range(1, missions + 1):
        on_mission(simulator.run(manager, run, seed).metrics)
    if not learned:
        raise InputError(f"manager {manager} has learned nothing", remedy="store training results in system.learned")
    result = Learned(manager, loaded.scenario.name, seed, missions, dict(sorted(inputs.items())), learned)
    write_files(Path(out).parent, {Path(out).name: result.text()})
    return result


def blocks(values: Sequence[float], count: int = 10) -> list[tuple[int, int, float]]:
    """Return the means of at most `count` blocks of missions: first and last mission, and mean."""
    size = max(1, -(-len(values) // count))
    parts = [values[first : first + size] for first in range(0, len(values), size)]
    return [(n * size + 1, n * size + len(part), sum(part) / len(part)) for n, part in enumerate(parts)]


@dataclass(frozen=True)
class OpenedCampaign:
    """A campaign whose missions can be run again.

    Attributes:
        spec: its specification.
        loaded: its scenario.
        variation: what differs between its missions besides manager and run.
    """

    spec: CampaignSpec
    loaded: LoadedScenario
    variation: Variation

    def simulator(self, point: int = 0, run: int | None = None) -> Simulator:
        """Make what runs the missions of a point of the sweep, 0 without one; with an ensemble, those of a run.

        Raises:
            InputError: there is no such point.
        """
        if not 0 <= point < self.variation.sweep.points:
            remedy = f"its sweep has the points 0 to {self.variation.sweep.points - 1}"
            raise InputError(f"the campaign has no point {point}", remedy=remedy)
        loaded = self.variation.scenario(self.loaded, point, None if run is None else self.variation.member(run))
        return Simulator(loaded, dict.fromkeys(self.variation.drawn, self.spec.runs_per_draw))

    def run(self, manager: str, run: int, point: int = 0, *, simulator: Simulator | None = None) -> MissionResult:
        """Run a mission of the campaign again, with its record.

        Raises:
            InputError: the campaign has no such manager, run or point.
            MissionError: the manager raised.
        """
        if manager not in self.spec.managers:
            remedy = did_you_mean(manager, self.spec.managers, "its managers")
            raise InputError(f"the campaign has no manager {manager!r}", remedy=remedy)
        if not 1 <= run <= self.spec.runs:
            raise InputError(f"the campaign has no run {run}", remedy=f"it has runs 1 to {self.spec.runs}")
        if simulator is None or self.variation.ensemble is not None:
            simulator = self.simulator(point, run)
        return simulator.run(manager, run, self.spec.seed, record=True)


@contextmanager
def opened_campaign(folder: Path, named: Collection[str] = ()) -> Iterator[OpenedCampaign]:
    """Open a campaign, to run missions of it again; what it names is looked up where it was started.

    Args:
        folder: the campaign's.
        named: managers that the user has named: their code may run, see `check_trusted`.

    Raises:
        InputError: there is no campaign in the folder, its inputs no longer exist, or it names managers
            that are neither installed nor named.
    """
    path = (folder / STORE_FILE).absolute()
    if not path.is_file():
        remedy = "give the --out folder of suave-des run or campaign"
        raise InputError("has no campaign whose missions can be run again", file=folder, remedy=remedy)
    with closing(Store(path)) as store:
        spec = CampaignSpec.of_stored(store.about("request"))
    started_in = Path(spec.folder)
    with chdir(started_in if started_in.is_dir() else Path.cwd()):
        file = read_campaign_file(spec.scenario)
        spec = spec.with_file(file)
        check_trusted(spec.managers, named, folder, confirmed=False)
        spec.check()
        loaded, variation, _ = read_inputs(spec, file)
        yield OpenedCampaign(spec, loaded, variation)
