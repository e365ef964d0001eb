"""suave-des run, train and serve: missions one by one, to look at, to train managers, and for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.console import errors, output, print_table, print_timeline
from suave_des.cli.options import (
    Fields,
    Files,
    Given,
    ManagerOptions,
    Overwrite,
    Scenario,
    Seed,
    command_line,
    complete_managers,
)
from suave_des.files import FAMILIES
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.tables import Table

if TYPE_CHECKING:
    from suave_des.metrics.result import MissionMetrics


def run(
    scenario: Scenario,
    *,
    options: Annotated[
        Given,
        Fields(
            ("seed", "out", "overwrite"),
            {"out": "Folder for mission.json, events.csv, trajectory.csv, knowledge.jsonl."},
        ),
    ],
    manager: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="A manager's name, or module:Class.",
            autocompletion=complete_managers,
        ),
    ] = "metacontrol",
    run_number: Annotated[
        int,
        typer.Option("--run", metavar="K", help="Run number."),
    ] = 1,
    manager_option: ManagerOptions = None,
    files: Files,
) -> None:
    """Run one mission and print its timeline."""
    from suave_des.api import run_mission

    replaced = files.with_options(manager_option, [manager])
    result = run_mission(scenario, manager, run_number, command=command_line(), **options, **replaced)
    for remark in result.remarks:
        errors().print(f"suave-des: manager {manager}: {remark}")
    console = output()
    print_timeline(console, result)
    if (out := options.get("out")) is not None:
        *others, last = (name for name in FAMILIES["mission"] if (out / name).exists())
        console.print(f"\n{', '.join(others)} and {last} are in {out}")


def train(
    manager: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="The manager.")],
    missions: Annotated[int, typer.Option(help="Number of training missions.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File for the training result.")],
    scenario: Annotated[str, typer.Option(metavar="SCENARIO", help="Scenario to train on.")] = DEFAULT_SCENARIO,
    seed: Annotated[int, typer.Option(help="Training seed.")] = 0,
    start: Annotated[Path | None, typer.Option("--from", metavar="FILE", help="Continue an earlier training.")] = None,
    overwrite: Overwrite = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Train a manager on missions that run in order, in one process.

    A campaign uses the resulting file with --manager-option learned=FILE, and does not change it.
    """
    from suave_des.campaign.training import blocks
    from suave_des.campaign.training import train as trained

    times_s: list[float] = []
    distances_m: list[float] = []

    def note(metrics: MissionMetrics) -> None:
        times_s.append(metrics.search_time_s)
        distances_m.append(metrics.distance_inspected_m)

    options = files.with_options(manager_option, [manager])
    trained(scenario, manager, missions, out, seed=seed, start=start, overwrite=overwrite, on_mission=note, **options)
    means = zip(blocks(times_s), blocks(distances_m), strict=True)
    rows = [(f"{first} to {last}", f"{time_s:.2f}", f"{m:.2f}") for (first, last, time_s), (_, _, m) in means]
    headings = ("missions", "search time, s", "distance, m")
    console = output()
    print_table(console, Table(headings, rows, f"{manager} on {scenario}, means"))
    console.print(f"the training result is in {out}")


def serve(
    scenario: Scenario,
    host: Annotated[str, typer.Option(help="Address.")] = ("127.0.0.1"),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 3000,
    run_number: Annotated[int, typer.Option("--run", metavar="K", help="Run of the first mission.")] = 1,
    seed: Seed = 1,
    real_time_factor: Annotated[
        float, typer.Option(metavar="X", help="Mission seconds per second; 0: advance only on request.")
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
