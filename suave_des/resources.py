"""Where the shipped ontologies, scenarios and modes files are, in a checkout and installed; and the cache folder."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from suave_des.errors import InputError

_CACHE_VARIABLE = "SUAVE_DES_CACHE_DIR"
_PACKAGE = Path(__file__).resolve().parent
_KINDS = {
    "ontology": ".owl",
    "scenarios": ".yaml",
    "scenarios/revisions": ".yaml",
    "scenarios/vehicles": ".yaml",
    "scenarios/published": ".csv",
    "scenarios/calibration": ".yaml",
}


def shipped_folder(kind: str) -> Path:
    """Folder of shipped files of one kind, such as "ontology", "scenarios" or "scenarios/revisions"."""
    installed = _PACKAGE / "shipped" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind


def cache_folder() -> Path:
    """The user's folder for what can be made again: SUAVE_DES_CACHE_DIR, or where the system keeps such things."""
    chosen = os.environ.get(_CACHE_VARIABLE)
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        start = os.environ.get("LOCALAPPDATA")
        return (Path(start) if start else Path.home() / "AppData" / "Local") / "suave-des" / "Cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "suave-des"
    start = os.environ.get("XDG_CACHE_HOME")  # ignored unless absolute, as the XDG specification requires
    return (Path(start) if start and Path(start).is_absolute() else Path.home() / ".cache") / "suave-des"


def private_cache(kind: str) -> Path | None:
    """Make the part of the cache folder for one kind of content, if need be: a folder that only this user may enter.

    Machine code and classes are kept there, which are run without a further look. Where the cache folder cannot be
    used, as without a home folder, a temporary one takes its place, for this process and those that it starts; this is
    said once. None if there is none of either.
    """
    try:
        chosen = cache_folder()
        return _private(chosen / kind)
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder
        reason = getattr(error, "strerror", None) or str(error)
    try:
        folder = _temporary_folder()
        private = _private(folder / kind)
    except OSError:
        return None
    os.environ[_CACHE_VARIABLE] = str(folder)
    print(f"suave-des: the cache folder cannot be used ({reason}); {folder} is used instead", file=sys.stderr)
    return private


def _temporary_folder() -> Path:
    """A folder of this user's alone that the next process finds, too; a new one if somebody else has made that."""
    if not hasattr(os, "getuid"):
        return Path(tempfile.mkdtemp(prefix="suave-des-"))
    folder = Path(tempfile.gettempdir()) / f"suave-des-{os.getuid()}"
    try:
        return _private(folder)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="suave-des-"))


def _private(folder: Path) -> Path:
    """Make a folder that only this user may enter, or see that it is one.

    Raises:
        OSError: it cannot be made or written, is a link, or is somebody else's.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != getattr(os, "getuid", lambda: status.st_uid)():
        raise PermissionError(None, f"{folder} is not a folder of this user's")
    if stat.S_IMODE(status.st_mode) & 0o077:
        folder.chmod(0o700)
    if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
        raise PermissionError(None, f"{folder} cannot be written")
    return folder


def _is_a(kind: Callable[[Path], bool], path: Path) -> bool:
    try:
        return kind(path)
    except OSError:  # a name too long, a folder that may not be looked into
        return False


def find(name: str | Path, kind: str, *, beside: Path | None = None) -> Path:
    """Resolve a file that the user named: a path wins over the shipped file of that name.

    Args:
        name: a path, or the name of a shipped file with or without its ending.
        kind: as of shipped_folder.
        beside: folder of the file that names it, looked in instead of the current folder, so that a file means the
            same wherever the command is given.

    Raises:
        InputError: there is no such file, neither on disk nor shipped.
    """
    path = Path(name)
    candidates = [path if beside is None else beside / path]
    if len(path.parts) == 1:
        shipped = shipped_folder(kind) / path
        candidates += [shipped, shipped.with_name(path.name + _KINDS[kind])]
    for candidate in candidates:
        if _is_a(Path.is_file, candidate):
            return candidate
    if _is_a(Path.is_dir, candidates[0]):
        raise InputError("is a folder", file=path, remedy="name a file in it")
    if _is_a(Path.exists, candidates[0]):
        raise InputError("is not a regular file", file=path, remedy="name a file on disk")
    known = ", ".join(sorted(entry.name for entry in shipped_folder(kind).glob(f"*{_KINDS[kind]}")))
    raise InputError("no such file", file=path, remedy=f"give a path, or one of the shipped files: {known}")
