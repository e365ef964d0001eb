"""The user's folder for what can be made again: cached inferences, machine code, Java's archive."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

_CACHE_VARIABLE = "SUAVE_DES_CACHE_DIR"


def cache_folder() -> Path:
    """The user's folder for what can be made again: SUAVE_DES_CACHE_DIR, or where the system keeps such things."""
    chosen = os.environ.get(_CACHE_VARIABLE)
    if chosen:
        return Path(chosen)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "suave-des"
    start = os.environ.get("XDG_CACHE_HOME")  # ignored unless absolute, as the XDG specification requires
    return (Path(start) if start and Path(start).is_absolute() else Path.home() / ".cache") / "suave-des"


def private_cache(kind: str) -> Path | None:
    """Make the part of the cache folder for one kind of content, if need be: a folder that only this user may enter.

    Machine code and classes are kept there, which are run without a further look. Where the cache folder cannot be
    used, as without a home folder, a temporary one takes its place, for this process and those that it starts; this is
    said once. None if there is neither.
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
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
        raise PermissionError(None, f"{folder} is not a folder of this user's")
    if stat.S_IMODE(status.st_mode) & 0o077:
        folder.chmod(0o700)
    if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
        raise PermissionError(None, f"{folder} cannot be written")
    return folder
