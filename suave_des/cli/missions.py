"""suave-des run, train and serve: missions one by one, for oneself, for managers that learn, and for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import (
    Files,
    ManagerOptions,
    Overwrite,
    Scenario,
    Seed,
    command_line,
    grouped_options,
)

if TYPE_CHECKING:
    from suave_des.metrics.result import MissionMetrics


@grouped_options
def run(
    scenario: Scenario,
    manager: Annotated[
        str, typer.Option(metavar="NAME", help="Managing subsystem by name, or your own as module:Class.")
    ] = "metacontrol",
    seed: Seed = 1,
    run_number: Annotated[
        int, typer.Option("--run", metavar="K", help="Run of a campaign with this seed: the same mission again.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for mission.json, events.csv, trajectory.csv, knowledge.jsonl."),
    ] = None,
    overwrite: Overwrite = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Run one mission and print its timeline."""
    from suave_des.campaign.output import FAMILIES
    from suave_des.campaign.single import run_mission
    from suave_des.cli.console import errors, mission_status, output, print_timeline

    with mission_status(scenario, errors()) as show:
        result = run_mission(
            scenario,
            manager,
            run_number,
            seed,
            out,
            overwrite=overwrite,
            command=command_line(),
            on_time=show,
            **files.with_options(manager_option, [manager]),
        )
    for remark in result.remarks:
        errors().print(f"suave-des: manager {manager}: {remark}", soft_wrap=True, markup=False)
    console = output()
    print_timeline(console, result)
    if out is not None:
        *others, last = (name for name in FAMILIES["mission"] if (out / name).exists())
        console.print(f"\n{', '.join(others)} and {last} are in {out}", soft_wrap=True)


@grouped_options
def train(
    manager: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="The manager.")],
    missions: Annotated[int, typer.Option(help="Number of training missions: runs 1 to NUMBER, in order.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File for what the manager has learned.")],
    scenario: Annotated[str, typer.Option(metavar="SCENARIO", help="Scenario to train on.")] = "seams2023",
    seed: Annotated[int, typer.Option(help="Training seed; use another for the campaign that evaluates.")] = 0,
    start: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="Continue from the file of an earlier training.")
    ] = None,
    overwrite: Overwrite = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Train a manager: missions in one process, in order, and a file at the end.

    A campaign takes it with --manager-option learned=FILE; there nothing is learned any more.
    """
    from suave_des.campaign.single import blocks
    from suave_des.campaign.single import train as trained
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


@grouped_options
def serve(
    scenario: Scenario,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = ("127.0.0.1"),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 for any free one.")] = 3000,
    run_number: Annotated[int, typer.Option("--run", metavar="K", help="Run of the first mission.")] = 1,
    seed: Seed = 1,
    real_time_factor: Annotated[
        float, typer.Option(metavar="X", help="Mission seconds per wall-clock second; 0: advance only on request.")
    ] = 0.0,
    *,
    files: Files,
) -> None:
    """Serve a mission over HTTP, as UPISAS expects it of an exemplar."""
    from suave_des.interfaces.serve import Server, Session
    from suave_des.scenario.loader import load_scenario
    from suave_des.simulation.simulator import Simulator

    session = Session(Simulator(load_scenario(scenario, **files.replacements)), run_number, seed, real_time_factor)
    with Server(session, host, port) as server:
        print(f"http://{host}:{server.server_port}/monitor; Ctrl-C ends it", flush=True)
        server.serve_forever(poll_interval=0.1)
