"""suave-des bench: how fast missions are on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import command_line

if TYPE_CHECKING:
    from suave_des.bench.bench import Bench

_LEAST = 20


def bench(
    missions: Annotated[
        int,
        typer.Option(
            "--missions", min=_LEAST, max=1_000_000, help="Missions of each campaign; the goals are for 10000."
        ),
    ] = 10_000,
    large: Annotated[bool, typer.Option("--large", help="Measure memory with 100,000 missions, too.")] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures to a file.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace that file if it is there already.")] = False,
) -> None:
    """Measure how fast missions are on this machine.

    Takes some two minutes, best with nothing else running. Beside the figures stand the goals of the project, and a
    program as one would write it with stock libraries. Your own memory of inferences and caches are not used.
    """
    from suave_des.bench.bench import measure
    from suave_des.campaign.output import write_files
    from suave_des.cli.console import errors, output

    if json_file is not None:
        _check_target(json_file, overwrite=overwrite)
    progress = errors()
    measured = measure(missions, large=large, say=lambda text: progress.print(f"measuring, {text}", markup=False))
    if json_file is not None:
        write_files(json_file.parent, {json_file.name: _json(measured)})
    _print(measured)
    if json_file is not None:
        output().print(f"\nThe figures are in {json_file}", soft_wrap=True)


def _print(measured: Bench) -> None:
    from suave_des.bench.bench import MISSIONS
    from suave_des.bench.goals import MET, goal_rows, programs
    from suave_des.bench.machine import in_words, is_busy
    from suave_des.cli.console import output, plain_table, print_table

    console = output()
    console.print(f"{in_words(measured.machine)}\n", soft_wrap=True, markup=False)
    goals = plain_table()
    for heading in ("what", "goal", "measured", "met"):
        goals.add_column(heading, justify="right" if heading == "measured" else "left", no_wrap=True)
    for row in goal_rows(measured):
        goals.add_row(row.what, row.goal, row.measured, MET[row.met])
    print_table(console, "Speed and memory", goals)

    others = plain_table()
    for heading in ("program", "a mission", "times", "what it does"):
        others.add_column(heading, justify="right" if heading in ("a mission", "times") else "left")
    for each in programs(measured):
        others.add_row(each.what, _time(each.mission_s), _times(each.times_a_mission), each.note)
    console.print()
    print_table(console, "A mission in one process, here and with stock libraries", others)
    if is_busy(measured.machine):
        console.print(
            "\nThe machine was busy with other things before this began: what took time would take less alone."
        )
    if measured.missions < MISSIONS:
        console.print(f"\n-: the goal is for {MISSIONS:,} missions", soft_wrap=True)
    console.print(f"\nmeasured in {measured.took_s:.0f} s", soft_wrap=True)


def _time(seconds: float) -> str:
    return f"{seconds:,.0f} s" if seconds >= 1.0 else f"{seconds * 1000:.2f} ms"


def _times(factor: float) -> str:
    return f"{factor:,.0f}" if factor >= 100 else f"{factor:.2f}"


def _json(measured: Bench) -> str:
    from dataclasses import asdict

    from suave_des.bench.goals import goal_rows, programs
    from suave_des.campaign.output import json_text

    rows = {
        "format": 2,
        "command": command_line(),
        **asdict(measured),
        "rows": [asdict(row) for row in goal_rows(measured)],
        "programs": [asdict(each) for each in programs(measured)],
    }
    return json_text(rows)


def _check_target(target: Path, *, overwrite: bool) -> None:
    """See that the figures can be written, before the minutes that they take.

    Raises:
        InputError: they cannot.
    """
    import os

    from suave_des.errors import InputError

    if not target.name or target.is_dir():
        raise InputError("is a folder", file=target, remedy="name a file in it")
    if not target.parent.is_dir():
        raise InputError(f"there is no folder {target.parent} to write it in", file=target, remedy="make it first")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise InputError("its folder cannot be written", file=target, remedy="give a folder that is yours")
    if target.exists() and not overwrite:
        raise InputError("is there already", file=target, remedy="give another name, or --overwrite to replace it")
