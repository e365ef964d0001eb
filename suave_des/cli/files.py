"""suave-des import-config, export-config, scenarios, schema, tree: files that describe missions,
and what follows.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from suave_des.cli.console import output, plain, print_table
from suave_des.cli.options import Overwrite, any_scenario, argument, option
from suave_des.errors import InputError
from suave_des.files import check_output_file, make_output_folder, real, write_files
from suave_des.resources import shipped_folder
from suave_des.tables import Table


def scenarios() -> None:
    """List the shipped scenarios, other inputs and managers."""
    from suave_des.registry import manager_names
    from suave_des.scenario.loader import load_scenario

    folder = shipped_folder("scenarios")
    campaigns = sorted(folder.glob("*_campaign.yaml"))
    modes = sorted(folder.glob("*_modes.yaml"))
    rows = []
    for path in sorted({*folder.glob("*.yaml")} - {*campaigns, *modes}):
        scenario = load_scenario(path).scenario
        rows.append((path.stem, scenario.revision.name, scenario.description))
    console = output()
    print_table(console, Table(("name", "revision", "what it is"), rows, "Scenarios", align="lll"))
    ontologies = sorted(shipped_folder("ontology").glob("*.owl"))
    console.print()
    others = {"Campaign files": campaigns, "Modes files": modes, "Ontologies": ontologies}
    for kind, paths in others.items():
        console.print(f"{kind}: {', '.join(path.name for path in paths)}")
    console.print(f"They are in {folder.parent}: copy what you want to change.")
    console.print(f"Managers: {', '.join(manager_names())}")


def schema() -> None:
    """Print the JSON Schema of scenario files, with which editors complete and check them."""
    import json

    from suave_des.scenario.schema import scenario_schema

    print(json.dumps(scenario_schema(), indent=2))


def import_config(
    files: Annotated[list[Path], argument("The exemplar's files, in any order.", "FILE...")],
    out: Annotated[Path, option("Scenario file to write.", "FILE")],
    campaign: Annotated[Path | None, option("Campaign file to write.", "FILE")] = None,
    revision: Annotated[
        str | None, option("Revision of the files, if they fit several.", "NAME")
    ] = None,
    runner_seed: Annotated[
        int | None,
        option("Write the values that the exemplar's runner draws from this seed.", "SEED"),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Import the exemplar's configuration files.

    Keys without a counterpart are reported. Files may be of any revision, with or without leading
    slashes.
    """
    from suave_des.exemplar.configurations import import_config as imported_from
    from suave_des.registry import manager_names

    targets = list(filter(None, (out, campaign)))
    named = list(map(real, (*files, *targets)))
    for target in targets:
        if named.count(real(target)) > 1:
            remedy = "give the output a different name"
            raise InputError("is one of the other files, too", file=target, remedy=remedy)
        check_output_file(target, overwrite=overwrite)
    given = {"revision": revision, "campaign": campaign, "runner_seed": runner_seed}
    # tables from what is published of a manager are not the one that a configuration names
    tables = {path.stem for path in shipped_folder("scenarios/managers").glob("*.csv")}
    managers = [name for name in manager_names() if name not in tables]
    imported = imported_from(files, out, managers=managers, **given)  # type: ignore[arg-type]
    texts = filter(None, (imported.scenario, imported.campaign))
    for target, text in zip(targets, texts, strict=True):
        write_files(target.parent, {target.name: text})
    for note in imported.notes:
        print(plain(note))
    print(f"{out} is written, based on {imported.base}: {imported.why}")
    if campaign is not None:
        print(f"{campaign} is written")


def export_config(
    scenario: Annotated[str, any_scenario(False)],
    out: Annotated[
        Path,
        option("Folder for mission_config.yaml and runner_config.yml.", "DIR"),
    ],
    revision: Annotated[
        str | None,
        option("Revision that is to read them.", "NAME", show_default="the scenario's"),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Write a scenario as the exemplar's configuration files.

    import-config gives the same scenario again. What the exemplar cannot express is reported.
    """
    from suave_des.campaign.spec import CampaignSettings, read_campaign_file
    from suave_des.exemplar.export import export_config as exported
    from suave_des.scenario.loader import load_scenario

    file = read_campaign_file(scenario)
    loaded = load_scenario(scenario if file is None else file.scenario)
    settings = CampaignSettings(campaign=1, scenario="") if file is None else file.settings
    given = {"managers", "runs", "seed"} | (
        set() if file is None else file.settings.model_fields_set
    )
    texts, lost = exported(loaded, settings.model_dump(mode="json", include=given), revision)
    for name in texts:
        check_output_file(out / name if out.is_dir() else out, overwrite=overwrite)
    make_output_folder(out)
    write_files(out, texts)
    for line in lost:
        print(plain(f"not exported: {line}"))
    print(f"written: {', '.join(str(out / name) for name in texts)}")


def tree(
    manager: Annotated[str, argument("bt, bt_extended, or module:Class with a tree.", "MANAGER")],
    scenario: Annotated[str, argument("Scenario with the tree's settings.", "SCENARIO")] = (
        "release15"
    ),
) -> None:
    """Draw the behaviour tree of a manager."""
    from suave_des.simulation.mission import Mission

    drawn = getattr(Mission(scenario, manager).manager, "drawing", None)
    if drawn is None:
        remedy = "bt and bt_extended have one, and managers with a method drawing()"
        raise InputError(f"manager {manager!r} has no tree", remedy=remedy)
    print(drawn())
