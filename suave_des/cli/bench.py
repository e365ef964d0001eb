"""suave-des bench: how fast missions are on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import command_line

if TYPE_CHECKING:
    from suave_des.bench.bench import Bench


def bench(
    missions: Annotated[
        int, typer.Option(min=20, max=1_000_000, help="Missions of each campaign; the goals are for 10000.")
    ] = 10_000,
    large: Annotated[bool, typer.Option("--large", help="Measure memory with 100,000 missions, too.")] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures to a file.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace that file if it exists already.")] = False,
) -> None:
    """Measure how fast missions are on this machine.

    Takes some two minutes, best with nothing else running. Compares the figures with the goals of the project, and a
    mission with the same inferences by stock libraries. Your own memory of inferences and caches are not used.
    """
    from dataclasses import asdict

    from suave_des.bench.bench import goal_rows, measure, programs
    from suave_des.campaign.output import check_output_file, json_text, write_files
    from suave_des.cli.console import errors, output

    if json_file is not None:
        check_output_file(json_file, overwrite=overwrite)
    progress = errors()
    found = measure(missions, large=large, report=lambda text: progress.print(f"measuring, {text}", markup=False))
    if json_file is not None:
        compared = {
            "rows": [asdict(row) for row in goal_rows(found)],
            "programs": [asdict(each) for each in programs(found)],
        }
        content = {"format": 2, "command": command_line(), **asdict(found), **compared}
        write_files(json_file.parent, {json_file.name: json_text(content)})
    _print(found)
    if json_file is not None:
        output().print(f"\nThe figures are in {json_file}", soft_wrap=True)


def _print(found: Bench) -> None:
    from suave_des.bench.bench import MET, MISSIONS, goal_rows, in_words, is_busy, programs
    from suave_des.cli.console import output, plain_table, print_table

    console = output()
    console.print(f"{in_words(found.machine)}\n", soft_wrap=True, markup=False)
    goals = plain_table(("what", "goal", "measured", "met"), right=("measured",), no_wrap=True)
    for row in goal_rows(found):
        goals.add_row(row.what, row.goal, row.measured, MET[row.met])
    print_table(console, "Speed and memory", goals)
    others = plain_table(("program", "a mission", "times", "what it does"), right=("a mission", "times"))
    for each in programs(found):
        mission = f"{each.mission_s:,.0f} s" if each.mission_s >= 1.0 else f"{each.mission_s * 1000:.2f} ms"
        times = f"{each.times_a_mission:,.0f}" if each.times_a_mission >= 100 else f"{each.times_a_mission:.2f}"
        others.add_row(each.what, mission, times, each.note)
    console.print()
    print_table(console, "A mission in one process, here and with stock libraries", others)
    if is_busy(found.machine):
        console.print("\nOther programs kept the machine busy at the start: without them, times are shorter.")
    if found.missions < MISSIONS:
        console.print(f"\n-: the goal is for {MISSIONS:,} missions", soft_wrap=True)
    console.print(f"\nmeasured in {found.took_s:.0f} s", soft_wrap=True)
