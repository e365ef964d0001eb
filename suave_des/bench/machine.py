"""The machine that something was measured on, and what runs on it."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from suave_des import __version__

_LIBRARIES = ("simpy", "numpy", "numba", "owlready2", "pydantic")
_BUSY = 0.25
"""Load for each core from which on a machine counts as busy."""


def machine() -> dict[str, Any]:
    """What decides how fast missions are."""
    return {
        "processor": _processor(),
        "cores": _cores(),
        "load": [round(load, 2) for load in os.getloadavg()],
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "suave-des": __version__,
        **{name: version(name) for name in _LIBRARIES},
    }


def in_words(found: Mapping[str, Any]) -> str:
    """The same in one line."""
    libraries = ", ".join(f"{name} {found[name]}" for name in ("suave-des", *_LIBRARIES))
    cores, load = found["cores"], found["load"][0]
    return f"{found['processor']}, {cores} cores, load {load:.2f} at the start; {found['python']}, {libraries}"


def is_busy(found: Mapping[str, Any]) -> bool:
    """Whether others had so much of the machine before it began that what was measured is too slow."""
    return bool(found["load"][0] > _BUSY * found["cores"])


def _cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()
