"""suave-des import-config: the exemplar's own configuration files, as a scenario and a campaign of ours."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from suave_des.cli.options import Overwrite


def import_config(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...", help="Mission, campaign and System Modes files of the exemplar, in any order."
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Scenario file to write.")],
    campaign: Annotated[
        Path | None,
        typer.Option("--campaign", metavar="FILE", help="Campaign file to write, from a campaign configuration."),
    ] = None,
    base: Annotated[
        str | None,
        typer.Option(
            "--base",
            metavar="SCENARIO",
            help="Scenario to build on; left out, the shipped one of the revision that the files look like.",
        ),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Import the exemplar's configuration files.

    What has no counterpart is told, a line each. Both revisions' files are read, with or without leading slashes.
    """
    from suave_des.campaign.output import write_files
    from suave_des.errors import InputError
    from suave_des.managing.registry import manager_names
    from suave_des.scenario.exemplar import import_config as imported_from

    targets = [out] if campaign is None else [out, campaign]
    if campaign is not None and campaign.resolve() == out.resolve():
        raise InputError("scenario and campaign cannot be one file", file=out, remedy="give --campaign another name")
    for target in targets:
        _check_target(target, files, overwrite=overwrite)
    imported = imported_from(files, out, base=base, campaign=campaign, managers=manager_names())
    written: dict[Path, dict[str, str | bytes | Iterable[str]]] = {}
    for target, text in zip(targets, filter(None, (imported.scenario, imported.campaign)), strict=True):
        written.setdefault(target.parent, {})[target.name] = text
    for folder, contents in written.items():
        write_files(folder, contents)
    for note in imported.notes:
        print(note)
    print(f"{out} is written, over the base {imported.base}: {imported.why}")
    if campaign is not None:
        print(f"{campaign} is written")


def _check_target(target: Path, files: list[Path], *, overwrite: bool) -> None:
    """See that a file can be written, without changing anything.

    Raises:
        InputError: its folder is not there, it is one of the files to import, or it is there already.
    """
    from suave_des.errors import InputError

    if not target.name or target.is_dir():
        raise InputError("is a folder", file=target, remedy="name a file in it")
    if not target.parent.is_dir():
        raise InputError(f"there is no folder {target.parent} to write it in", file=target, remedy="make it first")
    if target.resolve() in [file.resolve() for file in files]:
        raise InputError("is one of the files to import", file=target, remedy="give the output another name")
    if target.exists() and not overwrite:
        raise InputError("is there already", file=target, remedy="give another name, or --overwrite to replace it")
