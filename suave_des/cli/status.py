"""A line on the terminal that says how far a mission is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console


@contextmanager
def mission_status(scenario: str, console: Console) -> Iterator[Callable[[float, float], None] | None]:
    """Show the mission time reached until the mission ends; elsewhere than on a terminal there is nothing to call.

    Args:
        scenario: its name, as given.
        console: where to show it.
    """
    if not console.is_terminal:
        yield None
        return
    with console.status(f"{scenario}: starting") as status:

        def show(t_s: float, limit_s: float) -> None:
            status.update(f"{scenario}: mission time {t_s:.0f} of {limit_s:.0f} s")

        yield show
