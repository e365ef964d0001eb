"""The look and the words of all figures: small type, colours that colour-blind readers tell apart,
words and units.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from typing import Any

import matplotlib.style
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from suave_des import domain
from suave_des.tables import broken_name, printable

WIDTH_IN = 7.0
"""Text width of a two-column paper."""

# Okabe and Ito's palette, safe for colour-blind readers.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#8A8A8A"
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION)
"""For what has no colour of its own, in this order."""
_KNOWN_MANAGERS = ("none", "random", "metacontrol", "bt")
"""They have the same look in every figure: that of their place here."""
Look = dict[str, Any]
"""Keywords of matplotlib, each with a type of its own."""
_DASHES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.5)),
    (0, (1, 1)),
    (0, (6, 1.5, 1, 1.5)),
    (0, (3, 1, 1, 1, 1, 1)),
)
_MARKERS = "osD^v<>PX"

MODE_COLOURS = {
    "fd_spiral_low": "#7FB8DA",
    "fd_spiral_medium": "#2F7FBC",
    "fd_spiral_high": "#0B3C73",
    "fd_follow_pipeline": ORANGE,
    "__DEFAULT__": PURPLE,
    "normal": GREEN,
}
"""The shipped modes: the higher the search, the darker the blue. A user's mode gets one of
OTHER_MODES.
"""
MODE_WIDTHS = {
    "fd_spiral_low": 0.8,
    "fd_spiral_medium": 1.4,
    "fd_spiral_high": 2.0,
    "fd_follow_pipeline": 1.2,
}
"""Widths of lines, in points: the higher the search, the wider, so that they differ in print
without colours, too.
"""
OTHER_MODES = ("#6A3D9A", "#8C510A", "#B8860B")


def looks(names: Sequence[str]) -> list[int]:
    """Return for each name the number of its look, which `line` and `marker` take.

    Managers of the exemplar keep theirs whoever is shown, and no other has one of these. Of a
    manager with several sources, whose names follow it in parentheses, the first has it; each of
    the others has a look of its own.
    """
    places = {name: place for place, name in enumerate(_KNOWN_MANAGERS)}
    found: list[int] = []
    for name in names:
        place = places.pop(name.partition(" (")[0], len(_KNOWN_MANAGERS))
        found.append(next(number for number in count(place) if number not in found))
    return found


def line(number: int) -> Look:
    """Return the look of the curve of a manager, by its number from 0: no two of thirty are alike,
    nor six in grey.
    """
    return {"color": CYCLE[number % len(CYCLE)], "linestyle": _DASHES[number % len(_DASHES)]}


def marker(number: int) -> str:
    """Return the marker of a manager, by its number from 0."""
    return _MARKERS[number % len(_MARKERS)]


def text(name: str) -> str:
    """Return a name as matplotlib is to show it: without formulas in it, and not hidden for a
    leading underscore.
    """
    return (f" {name}" if name.startswith("_") else name).replace("$", r"\$")


class Picture(Figure):
    """A figure that a notebook shows without further settings, by default as wide as a page."""

    def __init__(self, height_in: float, width_in: float = WIDTH_IN) -> None:
        super().__init__(figsize=(width_in, height_in), layout="constrained")

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        with publication():
            self.savefig(picture, format="png", dpi=160)
        return picture.getvalue()


def handle(**look: Any) -> Line2D:
    """Return what stands for a line or a marker in a legend."""
    return Line2D([], [], **look)


@contextmanager
def publication() -> Iterator[None]:
    """Draw figures in the one style; matplotlib's own settings are restored afterwards."""
    with matplotlib.style.context("suave_des.figures"):
        yield


# Words instead of names from files

_UNITS = {
    "_m_per_s": "m/s",
    "_per_s": "1/s",
    "_rad": "rad",
    "_deg": "degrees",
    "_kg": "kg",
    "_m3": "m³",
    "_s": "s",
    "_m": "m",
    "_n": "N",
}
"""Units by the ending of a key; the longer endings first."""
_FUNCTIONS = {
    domain.GENERATE_SEARCH_PATH: "search",
    domain.FOLLOW_PIPELINE: "follow",
    domain.MAINTAIN_MOTION: "thrusters",
    domain.GENERATE_RECHARGE_PATH: "recharge",
}
_MODES = {
    "": "before the first mode",
    domain.UNGROUND_MODE: "no active function",
    domain.DEFAULT_MODE: "search, default altitude",
    "fd_follow_pipeline": "follow the pipeline",
    "normal": "to the recharge station",
    "inactive": "no active function",
}
"""Modes of the functions that move the vehicle."""
_OTHER_MODES = {
    (domain.MAINTAIN_MOTION, "fd_all_thrusters"): "in use",
    (domain.MAINTAIN_MOTION, "fd_recover_thrusters"): "recovery",
    (domain.MAINTAIN_MOTION, domain.DEFAULT_MODE): "recovery, default",
    (domain.FOLLOW_PIPELINE, domain.DEFAULT_MODE): "off",
    (domain.FOLLOW_PIPELINE, "fd_follow_pipeline"): "on",
    (domain.GENERATE_RECHARGE_PATH, "normal"): "on",
}
_OFF = (domain.UNGROUND_MODE, "inactive")


_LEFT_OUT = ("signals", "calibration", "revision", "managers", "functions")


def key_words(key: str) -> str:
    """Return what a key of a scenario is called in a figure, with its unit.

    Example:
        key_words("signals.water_visibility.period_s")  # "water visibility: period (s)"
    """
    key = key.rpartition(":")[2]  # of module:Class only the class
    parts = [part for part in key.split(".") if part not in _LEFT_OUT]
    unit = next((ending for ending in _UNITS if parts and parts[-1].endswith(ending)), "")
    if unit:
        parts[-1] = parts[-1].removesuffix(unit)
    text = re.sub(r": (\d+)(?=:|$)", r" \1", ": ".join(map(_part_words, parts)))
    text = text.replace("thruster events", "thruster event")
    return f"{text}\N{NO-BREAK SPACE}({_UNITS[unit]})" if unit else text


def _part_words(part: str) -> str:
    """Return what a part of a key is called; numbers in it, which are from 0, are from 1 then."""
    if part.isdecimal():
        return str(int(part) + 1)
    name, _, index = part.partition("[")
    words = _FUNCTIONS.get(name, name).replace("_", " ")
    return f"{words} {int(index[:-1]) + 1}" if index else words


def value_words(value: object) -> str:
    """Return what a value, such as a number, a mode or a file, is called in a figure."""
    if isinstance(value, int | float):
        return f"{value:g}"
    return mode_words(str(value)) if str(value) else "none"


def mode_words(mode: str) -> str:
    """Return what the mode of the function that moves the vehicle is called."""
    if mode.startswith("fd_spiral_"):
        return f"search, {plain(mode.removeprefix('fd_spiral_'))}"
    return _MODES.get(mode, plain(mode))


def function_words(function: str) -> str:
    """Return what a function is called."""
    return _FUNCTIONS.get(function, plain(function.removeprefix("f_")))


def function_mode_words(function: str, mode: str) -> str:
    """Return what a mode is called beside the name of its function."""
    if mode in _OFF:
        return "off"
    text = _OTHER_MODES.get((function, mode)) or mode_words(mode)
    return text.removeprefix(f"{function_words(function)}, ")


def component_words(component: str) -> str:
    """Return what a component is called."""
    return plain(component.removeprefix("c_"))


def plain(name: str) -> str:
    """Return a name from a file as words, without what LaTeX or a terminal would take for
    commands.
    """
    return printable(name.removeprefix("fd_").strip("_").replace("_", " ") or name)


def folded(name: str, width: int = 40) -> str:
    """Break a long name of a manager into lines, so that it leaves room for the figure beside
    it.
    """
    return broken_name(name, width, "")
