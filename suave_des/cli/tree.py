"""The command tree: draw the behaviour tree of a manager."""

from __future__ import annotations

from typing import Annotated

import typer

from suave_des.errors import InputError


def tree(
    manager: Annotated[str, typer.Argument(metavar="MANAGER", help="bt, bt_extended, or module:Class with a tree.")],
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="Scenario whose settings the tree has.")] = (
        "release15"
    ),
) -> None:
    """Draw the behaviour tree of a manager."""
    from suave_des.scenario.loader import load_scenario
    from suave_des.simulation.simulator import Simulator

    drawn = getattr(Simulator(load_scenario(scenario)).start(manager, 1, 1).manager, "drawing", None)
    if drawn is None:
        raise InputError(
            f"manager {manager!r} has no tree", remedy="bt and bt_extended have, and those that have drawing()"
        )
    print(drawn())
