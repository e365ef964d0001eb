"""Labels in figures: words and units instead of names from files."""

from __future__ import annotations

import re

from suave_des.domain import (
    DEFAULT_MODE,
    FOLLOW_PIPELINE,
    GENERATE_RECHARGE_PATH,
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    UNGROUND_MODE,
)

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
    GENERATE_SEARCH_PATH: "search",
    FOLLOW_PIPELINE: "follow",
    MAINTAIN_MOTION: "thrusters",
    GENERATE_RECHARGE_PATH: "recharge",
}
_MODES = {
    "": "before the first mode",
    UNGROUND_MODE: "no function moves it",
    DEFAULT_MODE: "search, default altitude",
    "fd_spiral_low": "search, low",
    "fd_spiral_medium": "search, medium",
    "fd_spiral_high": "search, high",
    "fd_follow_pipeline": "follow the pipeline",
    "normal": "to the recharge station",
    "inactive": "no function moves it",
}
"""Modes of the functions that move the vehicle."""
_OTHER_MODES = {
    (MAINTAIN_MOTION, "fd_all_thrusters"): "in use",
    (MAINTAIN_MOTION, "fd_recover_thrusters"): "recovery",
    (MAINTAIN_MOTION, DEFAULT_MODE): "recovery, default",
    (FOLLOW_PIPELINE, DEFAULT_MODE): "off",
    (FOLLOW_PIPELINE, "fd_follow_pipeline"): "on",
    (GENERATE_RECHARGE_PATH, "normal"): "on",
}
_OFF = (UNGROUND_MODE, "inactive")

_BREAKS = re.compile(r"(?<=[:_./-])|(?<= )(?=[^\s=\d])|(?<=[^\W\d_A-ZÀ-Þ])(?=[A-ZÀ-Þ])")
"""Where a name may be broken: after a separator or space, but not in "(n = 20)", and before a capital within a word."""


def key_words(key: str) -> str:
    """Return what a key of a scenario is called in a figure, with its unit.

    Example:
        key_words("signals.water_visibility.period_s")  # "water visibility: period (s)"
    """
    parts = [part for part in key.split(".") if part not in ("signals", "calibration", "revision")]
    unit = next((ending for ending in _UNITS if parts and parts[-1].endswith(ending)), "")
    if unit:
        parts[-1] = parts[-1].removesuffix(unit)
    words = []
    for part in parts:
        name, _, index = part.partition("[")
        words.append(_FUNCTIONS.get(name, name).replace("_", " ") + (f" {int(index[:-1]) + 1}" if index else ""))
        if part.isdecimal():
            words[-1] = str(int(part) + 1)
    text = re.sub(r": (\d+)(?=:|$)", r" \1", ": ".join(words))
    text = text.replace("thruster events", "thruster event")
    return f"{text}\N{NO-BREAK SPACE}({_UNITS[unit]})" if unit else text


def value_words(value: object) -> str:
    """Return what a value that is a word, such as a mode or a file, is called in a figure."""
    text = str(value)
    return mode_words(text) if text else "none"


def mode_words(mode: str) -> str:
    """Return what the mode of the function that moves the vehicle is called."""
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


def is_off(function: str, mode: str) -> bool:
    """Whether a function does nothing in a mode."""
    return function_mode_words(function, mode) == "off"


def plain(name: str) -> str:
    """Return a name from a file as words, without what LaTeX or a terminal would take for commands."""
    text = name.removeprefix("fd_").strip("_").replace("_", " ") or name
    return printable(text)


def printable(name: str) -> str:
    """Return a name from a file without terminal control characters."""
    return name if name.isprintable() else repr(name)[1:-1]


def folded(name: str, width: int = 40) -> str:
    """Break a long name of a manager into lines, so that it leaves room for the figure or table beside it."""
    lines = [""]
    for piece in _BREAKS.split(name):
        if lines[-1] and len(lines[-1]) + len(piece) > width:
            lines.append("")
        lines[-1] += piece
    return "\n".join(lines)
