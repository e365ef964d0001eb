"""suave-des serve and train: missions for other programs, and managers that learn."""

from __future__ import annotations

from typing import Annotated

import typer

from suave_des.cli.options import Files, Scenario, Seed, grouped_options


@grouped_options
def serve(
    scenario: Scenario,
    host: Annotated[str, typer.Option("--host", help="Address to listen at; the default is this machine alone.")] = (
        "127.0.0.1"
    ),
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Port to listen at; 0 for any.")] = 3000,
    run_number: Annotated[int, typer.Option("--run", metavar="K", help="Run of the first mission.")] = 1,
    seed: Seed = 1,
    real_time_factor: Annotated[
        float,
        typer.Option(
            "--real-time-factor",
            metavar="X",
            help="Mission time per second; 0: it passes only when a client says so.",
        ),
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
