"""suave-des validate: simulated missions against real ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from suave_des.cli.campaign import exit_telling_failures
from suave_des.cli.options import (
    DisabledRules,
    Modes,
    Ontologies,
    Overwrite,
    Quiet,
    Reasoner,
    RuleFiles,
    Seed,
    Workers,
    command_line,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas

    from suave_des.campaign.campaign import CampaignResult
    from suave_des.validation.runs import Runs
    from suave_des.validation.validation import Validation

TARGETS_NOT_MET = 1
"""Exit status with --strict."""
_SCENARIO, _DATA = "seams2023", "seams2023_runs.csv"


def validate(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="[SCENARIO]", help="A scenario file, or the name of a shipped one.", show_default=_SCENARIO
        ),
    ] = None,
    data: Annotated[
        str,
        typer.Option("--data", metavar="FILE", help="Real missions; left out, the 60 published with the SUAVE paper."),
    ] = _DATA,
    runs_file: Annotated[
        Path | None,
        typer.Option("--runs-file", metavar="FILE", help="Compare this campaign's runs.csv; nothing is simulated."),
    ] = None,
    managers: Annotated[
        str | None, typer.Option("--managers", metavar="NAME,...", help="Of those in the data; left out: all.")
    ] = None,
    targets: Annotated[
        Path | None,
        typer.Option(
            "--targets", metavar="FILE", help="Shares to compare; left out, NAME.targets.yaml beside NAME.csv."
        ),
    ] = None,
    runs: Annotated[int, typer.Option("--runs", help="Missions for each manager.")] = 2000,
    workers: Workers = 2,
    seed: Seed = 1,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for tables, validation.json and figures.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help=f"Exit with status {TARGETS_NOT_MET} unless every target is met.")
    ] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    ontology: Ontologies = None,
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    modes: Modes = None,
    reasoner: Reasoner = None,
) -> None:
    """Compare simulated missions with real ones: distributions, clusters, conclusions."""
    from suave_des.cli.console import output, progress
    from suave_des.cli.validation_tables import print_validation
    from suave_des.resources import find
    from suave_des.validation.runs import choose_managers, read_runs
    from suave_des.validation.shares import read_shares, shares_beside
    from suave_des.validation.validation import validate as compare

    published = read_runs(find(data, "scenarios/published"))
    wanted = None if managers is None else [name.strip() for name in managers.split(",") if name.strip()]
    chosen = choose_managers(published, wanted)
    targets_path = targets or shares_beside(published.path)
    shares = () if targets_path is None else read_shares(targets_path)

    campaign: CampaignResult | None = None
    if runs_file is not None:
        _check_unused(
            {
                "--ontology": ontology,
                "--rules": rules,
                "--disable-rule": disable_rule,
                "--modes": modes,
                "--reasoner": reasoner,
            }
        )
        simulated, sources = _recorded(runs_file, chosen, scenario, out, overwrite=overwrite)
    else:
        from suave_des.campaign.campaign import run_campaign

        _check_known(published, chosen)
        name = scenario or _SCENARIO
        with progress(name, quiet=quiet) as show:
            campaign = run_campaign(
                name,
                chosen,
                runs,
                seed,
                workers,
                out,
                ontologies=ontology or (),
                modes_file=modes,
                reasoner=reasoner,
                rules=rules or (),
                disabled_rules=disable_rule or (),
                overwrite=overwrite,
                command=command_line(),
                on_progress=show,
            )
        simulated, sources = campaign.frame(), {"scenario": campaign.loaded.scenario.name, "runs": runs}
        _exit_if_one_has_none(campaign)
    validation = compare(published.frame, simulated, chosen, shares=shares, seed=seed)
    console = output()
    print_validation(console, validation)
    if out is None:
        console.print("\nNo files were written; --out DIR keeps tables and figures.", soft_wrap=True)
    else:
        sources = {"data": _named(published), "targets": _shown(targets_path), "seed": seed, **sources}
        _write(out, validation, published.frame, simulated, sources)
        console.print(f"\nTables, figures and validation.json are in {out}", soft_wrap=True)
    if campaign is not None:
        exit_telling_failures(campaign)
    if strict and not validation.all_met:
        raise typer.Exit(TARGETS_NOT_MET)


def _check_unused(options: Mapping[str, object]) -> None:
    """See that nothing is given that only a simulation could use."""
    from suave_des.errors import InputError

    for option, value in options.items():
        if value:
            raise InputError(f"{option} has no use with --runs-file", remedy="leave one of them out")


def _recorded(
    path: Path, chosen: tuple[str, ...], scenario: str | None, out: Path | None, *, overwrite: bool
) -> tuple[pandas.DataFrame, dict[str, Any]]:
    """Missions of an earlier campaign, and what to say of where they come from."""
    from suave_des.campaign.output import check_output_folder, make_output_folder
    from suave_des.scenario.loader import load_scenario
    from suave_des.validation.runs import check_one_scenario, check_same_managers, read_runs

    recorded = read_runs(path)
    check_one_scenario(recorded, None if scenario is None else load_scenario(scenario).scenario.name)
    check_same_managers(recorded, chosen)
    if out is not None:
        check_output_folder(out, "campaign", overwrite=overwrite)
        make_output_folder(out)
    return recorded.frame, {"runs_file": _named(recorded)}


def _check_known(published: Runs, chosen: tuple[str, ...]) -> None:
    """See that every manager of the data can be run.

    Raises:
        InputError: one cannot, with the line that names it.
    """
    from suave_des.errors import InputError
    from suave_des.managing.registry import manager_class

    for name in chosen:
        try:
            manager_class(name)
        except InputError as error:
            remedy = f"{error.remedy}; or choose others with --managers" if error.remedy else None
            raise published.error(published.managers[name], error.problem, remedy or "") from None


def _exit_if_one_has_none(campaign: CampaignResult) -> None:
    """End here when a manager has no finished mission, so that nothing can be compared."""
    done = {str(manager) for manager in campaign.frame()["manager"]}
    if not set(campaign.managers) <= done:
        exit_telling_failures(campaign)


def _write(
    out: Path,
    validation: Validation,
    published: pandas.DataFrame,
    simulated: pandas.DataFrame,
    sources: dict[str, Any],
) -> None:
    from suave_des import __version__
    from suave_des.campaign.output import write_files
    from suave_des.validation import files
    from suave_des.validation.figures import detections_png, distributions_png

    provenance = {"version": __version__, "command": command_line(), **sources}
    contents: dict[str, str | bytes] = {**files.texts(validation, provenance)}
    contents[files.DISTRIBUTIONS_FIGURE] = distributions_png(validation, published, simulated)
    contents[files.DETECTIONS_FIGURE] = detections_png(validation, published, simulated)
    write_files(out, contents, stale=files.FILES)


def _named(runs: Runs) -> dict[str, str]:
    return {"file": _shown(runs.path) or "", "sha256": runs.sha256}


def _shown(path: Path | None) -> str | None:
    """A file as it goes into a result: shipped ones without where they are installed."""
    from suave_des.resources import shipped_folder

    if path is None:
        return None
    folder = shipped_folder("scenarios/published")
    return f"shipped/{path.name}" if path.is_relative_to(folder) else path.as_posix()
