"""Where commands print: styled on a terminal, plain and wide enough for the tables elsewhere."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from suave_des.campaign.progress import OnProgress

_PLAIN_WIDTH = 120


def output() -> Console:
    """The console for results."""
    console = Console(highlight=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _PLAIN_WIDTH
    return console


def errors() -> Console:
    """The console for what went wrong and for progress."""
    return Console(stderr=True, highlight=False)


def progress(label: str, *, quiet: bool) -> AbstractContextManager[OnProgress | None]:
    """Shows the progress of a campaign on standard error, unless nothing is to be said."""
    from suave_des.campaign.display import shown

    return shown(label, errors(), quiet=quiet)
