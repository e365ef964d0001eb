"""Campaigns, for programs: many missions of one scenario under several managers, kept as they finish."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack

from suave_des.campaign.given import ManagerLike, manager_names, plain_sweep
from suave_des.campaign.progress import OnProgress, Progress
from suave_des.campaign.results import CampaignResult
from suave_des.campaign.runner import CampaignInterrupted, resume_campaign, run
from suave_des.campaign.spec import CampaignSpec
from suave_des.scenario.loader import LoadedScenario

__all__ = ["CampaignInterrupted", "CampaignOptions", "CampaignResult", "Progress", "resume_campaign", "run_campaign"]


class CampaignOptions(TypedDict, total=False):
    """Options of a campaign by name, as described at CampaignSpec; None or left out: as in the campaign file."""

    sweep: Mapping[str, Any] | None
    perturbations: Mapping[str, Any] | None
    runs_per_draw: int | None
    ensemble: str | Path | None
    until_ci: str | None
    time_out_s: float | None
    scheduler: str | None
    ontologies: Sequence[str | Path]
    modes_file: str | Path | None
    reasoner: str | None
    rules: Sequence[str | Path]
    disabled_rules: Sequence[str]
    values: Mapping[str, Any]
    manager_options: Mapping[str, Mapping[str, Any]]
    suave_format: bool
    parquet: bool
    record_knowledge: bool
    confirmed: bool
    overwrite: bool
    command: Sequence[str]


def run_campaign(
    scenario: str | Path | LoadedScenario,
    managers: ManagerLike | Iterable[ManagerLike] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    out: str | Path | None = None,
    *,
    on_progress: OnProgress | None = None,
    **options: Unpack[CampaignOptions],
) -> CampaignResult:
    """Run `runs` missions of a scenario under each manager, at each point of the sweep if there is one.

    Example:
        result = run_campaign("seams2023", ["none", "metacontrol"], runs=100, workers=2)
        print(result.frame().groupby("manager")["search_time_s"].mean())

    Args:
        scenario: path of a scenario file or of a campaign file, name of a shipped scenario, or a loaded one.
        managers: names, module:Class, or classes; one or several.
        runs: missions for each manager, at each point; with `until_ci` at most, and 10,000 if they are left out.
        seed: of everything that is random.
        workers: processes; with 1 the missions run in this one. With more, managers that the calling script defines
            itself (`__main__:Class`) need `if __name__ == "__main__":` around the call, as workers import the script.
        out: folder for runs.csv, summary.csv and manifest.json; it is made if its parent exists. None: no files.
        on_progress: called when missions are done.
        options: see CampaignSpec.

    Raises:
        InputError, WorkerError, StoreError, CampaignInterrupted: as runner.run.
    """
    given = {"managers": manager_names(managers), "runs": runs, "seed": seed, "workers": workers, "out": out}
    if options.get("sweep") is not None:
        options["sweep"] = plain_sweep(options["sweep"])
    loaded = scenario if isinstance(scenario, LoadedScenario) else None
    named = scenario.path if isinstance(scenario, LoadedScenario) else scenario
    return run(CampaignSpec.of(named, **given, **options), on_progress, loaded)
