"""suave-des compare: estimates of each manager, and differences of each pair."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import Results, comma_separated

if TYPE_CHECKING:
    from collections.abc import Iterable

_TEXT_WIDTH = 95


class Format(StrEnum):
    """How a comparison is printed."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"
    MARKDOWN = "markdown"
    LATEX = "latex"


def compare(
    results: Results,
    managers: Annotated[
        str | None,
        typer.Option("--managers", metavar="NAME,...", help="Only these, in this order.", show_default="all"),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            "--against", metavar="NAME", help="Compare all others with this one only.", show_default="each with each"
        ),
    ] = None,
    metrics: Annotated[
        str | None,
        typer.Option(
            "--metrics",
            metavar="COLUMN,...",
            help="Columns of runs.csv.",
            show_default="search time, distance, found, reaction time",
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option("--by", metavar="KEY,...", help="Compare the values of these swept parameters, too."),
    ] = None,
    half_width: Annotated[
        list[str] | None,
        typer.Option(
            "--half-width",
            metavar="METRIC:VALUE",
            help="Give the runs needed for an interval this narrow; repeat it for several.",
        ),
    ] = None,
    unpaired: Annotated[
        bool, typer.Option("--unpaired", help="Take runs as independent though they share random numbers.")
    ] = False,
    as_format: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TABLE,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write .csv, .json, .md or .tex instead of printing.")
    ] = None,
) -> None:
    """Compare managers by their results.

    Runs that share their random numbers are compared in pairs, which takes fewer missions.
    """
    from suave_des.cli.console import output
    from suave_des.report.compare import Choices, compare_folders
    from suave_des.report.compare_files import ENDINGS, WRITERS, plain_text

    if out is not None:
        _check_out(out, ENDINGS)
    choices = Choices(
        managers=comma_separated(managers),
        metrics=comma_separated(metrics),
        by=comma_separated(by),
        against=against,
        half_widths=tuple(half_width or ()),
        unpaired=unpaired,
    )
    comparison = compare_folders(results, choices)
    if out is not None:
        from suave_des.campaign.output import write_files

        write_files(out.parent, {out.name: WRITERS[ENDINGS[out.suffix.lower()]](comparison)})
        print(f"compared in {out}")
    elif as_format is Format.TABLE:
        print(plain_text(comparison, min(output().width, _TEXT_WIDTH)), end="")
    else:
        print(WRITERS[as_format.value](comparison), end="")


def _check_out(out: Path, endings: Iterable[str]) -> None:
    from suave_des.campaign.output import check_output_file
    from suave_des.errors import InputError

    if out.suffix.lower() not in endings:
        problem = f"expected a table, got {out.suffix or 'a file without an ending'}"
        raise InputError(problem, file=out, remedy=f"one of {', '.join(endings)}")
    check_output_file(out, overwrite=True)
