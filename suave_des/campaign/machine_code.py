"""Whether the inner loops have been compiled on this machine before: then nobody has to do it ahead of the workers.

A note in the user's cache folder says so. Should it be wrong, because numba's own store was emptied meanwhile, each
worker compiles for itself: that takes longer, and nothing else.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

import suave_des
from suave_des.resources import cache_folder

COMPILED_MODULES = (
    "managed/detection.py",
    "managed/search.py",
    "monitor/measuring.py",
    "vehicle/kernel.py",
    "world/pipeline.py",
)
_KEPT = 16
"""Notes that are kept; others are of other versions."""


def is_stored() -> bool:
    """Whether the machine code is stored, as far as is known."""
    note = _note()
    with suppress(OSError):  # a folder that may not be entered
        return note is not None and note.exists()
    return False


def note_stored() -> None:
    """Take note that it is stored now."""
    note = _note()
    if note is None or is_stored():
        return
    with suppress(OSError):  # without a note the next campaign loads it once more than it has to
        note.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        note.touch()
        for old in sorted(note.parent.iterdir(), key=lambda path: path.stat().st_mtime)[:-_KEPT]:
            old.unlink(missing_ok=True)


def _note() -> Path | None:
    """The note's place, named after what decides the machine code; none if there is no place for it."""
    package = Path(suave_des.__file__).parent
    decides: list[object] = [sys.version, platform.machine(), platform.processor(), os.environ.get("NUMBA_CACHE_DIR")]
    try:
        decides += [version(name) for name in ("numba", "llvmlite")]
        for name in COMPILED_MODULES:
            status = (package / name).stat()
            decides += [str(package / name), status.st_mtime_ns, status.st_size]
        return cache_folder() / "compiled" / hashlib.sha256(repr(decides).encode()).hexdigest()[:32]
    except (OSError, RuntimeError):
        return None
