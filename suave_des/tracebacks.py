"""Exceptions of users' code: what was raised, and where in their code."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from sysconfig import get_path
from traceback import FrameSummary, extract_tb

_OWN = Path(__file__).parent
_LIBRARY = re.compile(rf"{re.escape(get_path('stdlib'))}|.*/(site|dist)-packages/")
_MOST_SAID = 5_000  # characters of an exception's text


def cause_of(error: BaseException, function: str = "") -> str:
    """Say what was raised, in which function, and where in the user's code: "ValueError: no plan
    (mine.py, line 7)".

    The text is the same in each run: it has no memory addresses.
    `function` is the user-defined one that raised it.
    """
    of = f"function {function}: " if function else ""
    said = "its text cannot be made"
    with suppress(Exception):
        said = str(error)
    text = re.sub(r" at 0x[0-9a-f]+", "", f"{of}{type(error).__name__}: {said[:_MOST_SAID]}")
    frames = _users_frames(error)
    return f"{text} ({_line(frames[-1])})" if frames else text


def place_of(error: BaseException) -> str:
    """Say which hook of a user's class an exception came from, and from which line: "adapt
    (mine.py, line 7)".
    """
    frames = _users_frames(error)
    return f"{frames[0].name} ({_line(frames[-1])})" if frames else ""


def import_place_of(error: BaseException) -> FrameSummary | None:
    """Return what failed when a module was imported; None if it was not even found."""
    frames = extract_tb(error.__traceback__)[1:]
    own = _without_libraries([each for each in frames if "importlib" not in each.filename])
    return own[-1] if own else None


def _users_frames(error: BaseException) -> Sequence[FrameSummary]:
    """Return what ran outside the project when an exception was raised, outermost first; libraries
    if nothing else.
    """
    while error.__cause__ is not None and repr(error.__cause__) == repr(error):
        error = error.__cause__  # SimPy raises a copy of what a process has raised
    frames = extract_tb(error.__traceback__)
    return _without_libraries(
        [each for each in frames if not Path(each.filename).is_relative_to(_OWN)]
    )


def _without_libraries(frames: Sequence[FrameSummary]) -> Sequence[FrameSummary]:
    return [each for each in frames if not _LIBRARY.match(each.filename)] or frames


def _line(frame: FrameSummary) -> str:
    file = Path(frame.filename)
    if not file.is_file():
        return f"line {frame.lineno}"
    return f"{file.name}, line {frame.lineno}"
