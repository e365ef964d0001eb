"""suave-des figure: pictures of missions and campaigns."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import comma_separated

if TYPE_CHECKING:
    from suave_des.report.mission_record import MissionRecord


class Kind(StrEnum):
    """What is drawn; as in report.figures, which is not imported for --help."""

    AUTO = "auto"
    MAP = "map"
    TIMELINE = "timeline"
    DISTRIBUTIONS = "distributions"
    RAINCLOUD = "raincloud"
    DETECTIONS = "detections"
    CONVERGENCE = "convergence"
    REACTIONS = "reactions"
    SWEEP = "sweep"
    PATHS = "paths"


def figure(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="Output folders of run, campaign or reproduce, or CSV files.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Picture to write: .png, .pdf or .svg.")],
    kind: Annotated[
        Kind,
        typer.Option(
            "--kind",
            help="Of a mission: map, timeline; of several: paths; of a campaign: distributions, raincloud, detections,"
            " convergence, reactions; of a sweep: sweep.",
        ),
    ] = Kind.AUTO,
    parameters: Annotated[
        str | None,
        typer.Option("--parameters", metavar="KEY,...", help="Of a sweep: draw these.", show_default="all"),
    ] = None,
) -> None:
    """Draw a mission's map or a campaign's results.

    Left to itself it draws what is in DIR: the map of a mission, the paths of several, a campaign's distributions, or
    the means of a sweep.
    """
    from suave_des.report.figures import draw_results

    draw_results(folders, out, kind.value, comma_separated(parameters), _with_rules if kind is Kind.TIMELINE else None)
    print(f"drawn in {out}")


def _with_rules(folder: Path, record: MissionRecord) -> MissionRecord:
    from dataclasses import replace

    from suave_des.pages.adaptation_rules import adaptation_rules

    return replace(record, rules=adaptation_rules(folder, record))
