"""A campaign: many missions of one scenario under several managers, and the files that tell of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.campaign.executors import WorkerError, make_executor
from suave_des.campaign.outcomes import COLUMNS, Failure, MissionRunner, Outcome, Row
from suave_des.campaign.output import check_output_folder, csv_text, json_text, make_output_folder, write_files
from suave_des.campaign.plan import RunSpec, check_plan, plan
from suave_des.campaign.provenance import provenance
from suave_des.campaign.suave_format import SUAVE_FILE, suave_text
from suave_des.campaign.summary import SUMMARY_COLUMNS, summary_rows
from suave_des.managing.registry import manager_class
from suave_des.scenario.bases import Files
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.scenario.models import Mission
from suave_des.simulation.result import MissionMetrics

if TYPE_CHECKING:
    import pandas

RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE = "runs.csv", "summary.csv", "manifest.json"
FILES = (RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, SUAVE_FILE)

_RUN, _MANAGER = COLUMNS.index("run"), COLUMNS.index("manager")


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is, in missions; failed ones are among those done."""

    done: int
    failed: int
    total: int


@dataclass(frozen=True)
class CampaignResult:
    """What a campaign gave.

    Attributes:
        loaded: the scenario.
        managers: in the order given.
        runs: planned for each manager.
        seed: the campaign's.
        rows: of runs.csv, in its order and with its columns (COLUMNS).
        failures: missions that have no row, in the same order.
        folder: where the files are; none if there are none.
    """

    loaded: LoadedScenario
    managers: tuple[str, ...]
    runs: int
    seed: int
    rows: tuple[Row, ...]
    failures: tuple[Failure, ...]
    folder: Path | None

    @property
    def planned(self) -> int:
        """Number of missions that were to be run."""
        return len(self.managers) * self.runs

    def frame(self) -> pandas.DataFrame:
        """The rows as a data frame with the columns of runs.csv; what is empty there is nan here."""
        import pandas

        # Without a value in any row, a column would not be known to hold numbers.
        kinds = {field.name: "float64" for field in fields(MissionMetrics) if "float" in str(field.type)}
        return pandas.DataFrame.from_records(self.rows, columns=list(COLUMNS)).astype(kinds)


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C during a campaign; finished missions are kept.

    Attributes:
        result: with the missions that were finished.
    """

    def __init__(self, result: CampaignResult) -> None:
        self.result = result
        super().__init__(f"interrupted; {_kept(result)}")


def run_campaign(
    scenario: str | Path,
    managers: Sequence[str],
    runs: int,
    seed: int,
    workers: int = 1,
    out: str | Path | None = None,
    *,
    ontologies: Sequence[str | Path] = (),
    modes_file: str | Path | None = None,
    reasoner: str | None = None,
    rules: Sequence[str | Path] = (),
    disabled_rules: Sequence[str] = (),
    suave_format: bool = False,
    overwrite: bool = False,
    command: Sequence[str] = (),
    on_progress: Callable[[Progress], None] | None = None,
) -> CampaignResult:
    """Run `runs` missions of a scenario under each manager.

    The result is the same for any number of workers. A mission whose manager raises has no row; the others are kept.

    Args:
        scenario: path of a scenario file, or name of a shipped one.
        managers: names, or module:Class.
        runs: missions for each manager.
        seed: of everything that is random.
        workers: processes; with 1 the missions run in this one. With more, a script that calls this must guard itself
            with `if __name__ == "__main__":`, because worker processes import it.
        out: folder for runs.csv, summary.csv and manifest.json; it is made if its parent exists. None: no files.
        ontologies: files to use in place of the scenario's.
        modes_file: file to use in place of the scenario's.
        reasoner: to use in place of the scenario's.
        rules: files of rules as text, besides the scenario's.
        disabled_rules: names of rules to switch off, besides the scenario's.
        suave_format: whether to write the exemplar's own results file besides.
        overwrite: whether results in the folder may be replaced.
        command: the command line, for the manifest.
        on_progress: called when missions are done.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        WorkerError: a worker process was killed; finished missions are kept.
        CampaignInterrupted: Ctrl-C; finished missions are kept.
    """
    folder = None if out is None else Path(out)
    if folder is not None:
        check_output_folder(folder, overwrite=overwrite)
    check_plan(managers, runs, workers)
    loaded = load_scenario(
        scenario,
        ontologies=ontologies,
        modes_file=modes_file,
        reasoner=reasoner,
        rules=rules,
        disabled_rules=disabled_rules,
    )
    inputs = check_knowledge(loaded, managers, given=bool(ontologies or rules or disabled_rules))
    if workers > 1:
        _compile(loaded)

    campaign = CampaignResult(loaded, tuple(managers), runs, seed, (), (), folder)
    made = folder is not None and not folder.exists()
    if folder is not None:
        make_output_folder(folder)
    try:
        finished, stopped = _run(campaign, workers, on_progress)
        if stopped is not None and not finished:
            raise stopped
    except BaseException:
        if made and folder is not None:
            with suppress(OSError):  # not ours to remove any more, if something else is in it
                folder.rmdir()
        raise
    result = replace(
        campaign,
        rows=tuple(outcome for outcome in finished if not isinstance(outcome, Failure)),
        failures=tuple(outcome for outcome in finished if isinstance(outcome, Failure)),
    )
    if folder is not None:
        write_files(folder, _files(result, inputs, command, suave_format=suave_format), stale=FILES)
    if isinstance(stopped, WorkerError):
        raise WorkerError(f"{stopped}; {_kept(result)}")
    if stopped is not None:
        raise CampaignInterrupted(result)
    return result


def check_knowledge(loaded: LoadedScenario, managers: Sequence[str], *, given: bool) -> dict[str, str]:
    """Open the knowledge base, if a manager uses it or the user gave ontologies, so that no mission finds it broken.

    Args:
        loaded: the scenario with its files.
        managers: names of the managers.
        given: whether the user gave ontologies.

    Returns:
        SHA-256 of each input file, with the ontologies that are imported if the knowledge base was opened.

    Raises:
        InputError: the knowledge base cannot be read, does not fit the mission or the modes file, or is inconsistent.
    """
    files = Files()
    if given or any(manager_class(name).needs_knowledge for name in managers):
        from suave_des.knowledge.state import KnowledgeState
        from suave_des.simulation.knowledge import open_knowledge

        knowledge = open_knowledge(loaded)
        knowledge.conclude(KnowledgeState())
        for path in knowledge.base.files:
            files.ontology(path)
    return {**loaded.inputs, **files.inputs}


def _run(
    campaign: CampaignResult, workers: int, on_progress: Callable[[Progress], None] | None
) -> tuple[list[Outcome], KeyboardInterrupt | WorkerError | None]:
    """Outcomes in the order of the plan, and what stopped the campaign before its end."""
    chunks: dict[int, list[Outcome]] = {}
    done = failed = 0
    stopped: KeyboardInterrupt | WorkerError | None = None
    missions = plan(campaign.loaded.scenario.name, campaign.managers, campaign.runs, campaign.seed)
    try:
        for number, outcomes in make_executor(workers).outcomes(campaign.loaded, missions, campaign.planned):
            chunks[number] = outcomes
            done += len(outcomes)
            failed += sum(isinstance(outcome, Failure) for outcome in outcomes)
            if on_progress is not None:
                on_progress(Progress(done, failed, campaign.planned))
    except (KeyboardInterrupt, WorkerError) as error:
        stopped = error
    return [outcome for number in sorted(chunks) for outcome in chunks[number]], stopped


def _compile(loaded: LoadedScenario) -> None:
    """Have inner loops compiled and stored once, before workers would each compile them: a mission of a second does."""
    short = loaded.scenario.model_copy(update={"mission": Mission(time_limit_s=1.0)})
    MissionRunner(replace(loaded, scenario=short)).run((RunSpec(short.name, "none", 1, 0),))


def _files(
    result: CampaignResult, inputs: Mapping[str, str], command: Sequence[str], *, suave_format: bool
) -> dict[str, str]:
    files = {
        RUNS_FILE: csv_text(COLUMNS, result.rows),
        SUMMARY_FILE: csv_text(SUMMARY_COLUMNS, summary_rows(result.managers, result.rows)),
        MANIFEST_FILE: json_text(
            {
                "scenario": result.loaded.scenario.name,
                "managers": result.managers,
                "runs": result.runs,
                "seed": result.seed,
                "missions": {
                    "planned": result.planned,
                    "done": len(result.rows),
                    "failed": len(result.failures),
                    "left_out": result.planned - len(result.rows) - len(result.failures),
                },
                "failures": [failure._asdict() for failure in result.failures],
                **provenance(result.loaded, inputs, command),
            }
        ),
    }
    if suave_format:
        scenario = result.loaded.scenario
        numbered = ((_number(result, row), row) for row in result.rows)
        files[SUAVE_FILE] = suave_text(scenario.revision.name, numbered, scenario.mission.time_limit_s)
    return files


def _number(result: CampaignResult, row: Row) -> int:
    """Number of a row's mission in the campaign, from 1, whether or not those before have a row."""
    run = row[_RUN]
    assert isinstance(run, int)
    return result.managers.index(str(row[_MANAGER])) * result.runs + run


def _kept(result: CampaignResult) -> str:
    kept = f"{len(result.rows)} of {result.planned} missions are done"
    return kept if result.folder is None else f"{kept}, and kept in {result.folder}"
