"""suave-des train: managers that learn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import Files, ManagerOptions, Overwrite, grouped_options

if TYPE_CHECKING:
    from suave_des.metrics.result import MissionMetrics


@grouped_options
def train(
    manager: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="The manager.")],
    missions: Annotated[int, typer.Option("--missions", help="How many missions: runs 1 to that, in order.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="File for what is learned.")],
    scenario: Annotated[str, typer.Option("--scenario", metavar="SCENARIO", help="To be trained on.")] = "seams2023",
    seed: Annotated[int, typer.Option("--seed", help="Seed; not that of the campaign that judges it.")] = 0,
    start: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="File of an earlier training, to go on from.")
    ] = None,
    overwrite: Overwrite = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Train a manager: missions in one process, in order, and a file at the end.

    A campaign takes it with --manager-option learned=FILE; there nothing is learned any more.
    """
    from suave_des.campaign.training import blocks
    from suave_des.campaign.training import train as trained
    from suave_des.cli.console import output, plain_table, print_table

    times_s: list[float] = []
    distances_m: list[float] = []

    def note(metrics: MissionMetrics) -> None:
        times_s.append(metrics.search_time_s)
        distances_m.append(metrics.distance_inspected_m)

    options = files.with_options(manager_option, [manager])
    trained(scenario, manager, missions, out, seed=seed, start=start, overwrite=overwrite, on_mission=note, **options)
    table = plain_table(("missions", "search time, s", "distance, m"), right=("search time, s", "distance, m"))
    for (first, last, time_s), (_, _, distance_m) in zip(blocks(times_s), blocks(distances_m), strict=True):
        table.add_row(f"{first} to {last}", f"{time_s:.2f}", f"{distance_m:.2f}")
    console = output()
    print_table(console, f"{manager} on {scenario}, means", table)
    console.print(f"what it has learned is in {out}", soft_wrap=True)
