"""suave-des run, train, serve and bench: missions one by one, and how fast they are.

To look at, to train managers that learn, and for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.console import errors, mission_status, output, plain_table, print_table, print_timeline
from suave_des.cli.options import Files, ManagerOptions, Overwrite, Scenario, Seed, command_line, grouped_options
from suave_des.files import FAMILIES, check_output_file, json_text, write_files
from suave_des.resources import DEFAULT_SCENARIO

if TYPE_CHECKING:
    from suave_des.bench.bench import Bench
    from suave_des.metrics.result import MissionMetrics


@grouped_options
def run(
    scenario: Scenario,
    manager: Annotated[
        str, typer.Option(metavar="NAME", help="Managing subsystem by name, or your own as module:Class.")
    ] = "metacontrol",
    seed: Seed = 1,
    run_number: Annotated[
        int,
        typer.Option("--run", metavar="K", help="Run number; with the seed, it identifies a mission of a campaign."),
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
    from suave_des.campaign.single import run_mission

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
        errors().print(f"suave-des: manager {manager}: {remark}")
    console = output()
    print_timeline(console, result)
    if out is not None:
        *others, last = (name for name in FAMILIES["mission"] if (out / name).exists())
        console.print(f"\n{', '.join(others)} and {last} are in {out}")


@grouped_options
def train(
    manager: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="The manager.")],
    missions: Annotated[int, typer.Option(help="Number of training missions; they are runs 1 to NUMBER.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File for the training result.")],
    scenario: Annotated[str, typer.Option(metavar="SCENARIO", help="Scenario to train on.")] = DEFAULT_SCENARIO,
    seed: Annotated[int, typer.Option(help="Training seed; use a different one for the evaluation.")] = 0,
    start: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="Continue from the file of an earlier training.")
    ] = None,
    overwrite: Overwrite = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Train a manager on missions that run in order, in one process.

    A campaign uses the resulting file with --manager-option learned=FILE, and does not change it.
    """
    from suave_des.campaign.single import blocks
    from suave_des.campaign.single import train as trained

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
    console.print(f"the training result is in {out}")


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


def bench(
    missions: Annotated[
        int, typer.Option(min=20, max=1_000_000, help="Missions of each campaign; the goals are for 10000.")
    ] = 10_000,
    large: Annotated[bool, typer.Option("--large", help="Measure memory with 100,000 missions, too.")] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the measurements to a file.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace that file if it exists already.")] = False,
) -> None:
    """Measure how fast missions are on this machine.

    Takes about two minutes, best with nothing else running. Compares the figures with the project's goals, and a
    mission with the same inferences by stock libraries. Your own caches are not used.
    """
    from dataclasses import asdict

    from suave_des.bench.bench import goal_rows, measure, programs

    if json_file is not None:
        check_output_file(json_file, overwrite=overwrite)
    progress = errors()
    found = measure(missions, large=large, report=lambda text: progress.print(f"measuring, {text}"))
    if json_file is not None:
        compared = {
            "rows": [asdict(row) for row in goal_rows(found)],
            "programs": [asdict(each) for each in programs(found)],
        }
        content = {"format": 2, "command": command_line(), **asdict(found), **compared}
        write_files(json_file.parent, {json_file.name: json_text(content)})
    _print_bench(found)
    if json_file is not None:
        output().print(f"\nThe figures are in {json_file}")


def _print_bench(found: Bench) -> None:
    from suave_des.bench.bench import MET, MISSIONS, goal_rows, in_words, is_busy, programs

    console = output()
    console.print(f"{in_words(found.machine)}\n")
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
        console.print("\nOther programs kept the machine busy at the start; without them, times are shorter.")
    if found.missions < MISSIONS:
        console.print(f"\n-: the goal is for {MISSIONS:,} missions")
    console.print(f"\nmeasured in {found.took_s:.0f} s")
