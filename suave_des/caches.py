"""The user's cache folder, for what can be made again, and files in it that are checked before use.

`inferences/` has what Pellet inferred, `ontologies/` what ontology files state, `numba/` machine
code, `findings/` what `kb check` found, `campaigns/` which campaigns with code of their own this
user has begun. Each may be deleted at any time.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

_CACHE_VARIABLE = "SUAVE_DES_CACHE_DIR"
#: Entries of this size in all are kept in one file: with exact values there is no end to new ones.
MAX_BYTES = 16 * 2**20
#: Files of a kind that are kept; the least recently used are removed.
MAX_FILES = 64


def private_cache(kind: str) -> Path | None:
    """Make the part of the cache folder for one kind of content, if need be: a folder that only
    this user may enter.

    Machine code and classes are kept there, which are run without a further look. The cache folder
    is that of SUAVE_DES_CACHE_DIR, or where the system keeps such things; where it cannot be used,
    as without a home folder, a temporary one takes its place, for this process and those that it
    starts; this is said once. None if there is neither.
    """
    try:
        chosen = os.environ.get(_CACHE_VARIABLE)
        return _private(
            (Path(chosen) if chosen else user_cache_path("suave-des", appauthor=False)) / kind
        )
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder
        reason = getattr(error, "strerror", None) or str(error)
    folder = Path(tempfile.gettempdir()) / f"suave-des-{os.getuid()}"
    try:
        private = _private(_private(folder) / kind)
    except OSError:
        return None
    os.environ[_CACHE_VARIABLE] = str(folder)
    print(
        f"suave-des: the cache folder cannot be used ({reason}); {folder} is used instead",
        file=sys.stderr,
    )
    return private


def _private(folder: Path) -> Path:
    """Make a folder that only this user may enter, if need be; an OSError if it is a link, or
    somebody else's.
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


@lru_cache
def hash_of_code(folder: Path) -> str:
    """SHA-256 of the programs and grammars in a folder, so that what other versions of them have
    made is not used.
    """
    paths = sorted((*folder.rglob("*.py"), *folder.rglob("*.lark")))
    return hashlib.sha256(b"".join(map(Path.read_bytes, paths))).hexdigest()


def keep_latest(folder: Path, pattern: str, most: int) -> None:
    """Remove the least recently used files of a pattern in a folder, so that `most` stay."""
    files = sorted(folder.glob(pattern), key=lambda path: path.stat().st_mtime)
    for path in files[:-most]:
        path.unlink(missing_ok=True)


class SharedEntries:
    """Values by key, in a file that several processes extend without locks.

    Each entry is a line of JSON with a checksum, appended with a single write: a line that two
    processes mangled, or that was cut short, is left out when it is read. Nothing in a file is ever
    executed.

    Args:
        folder: that has the file; None: nothing is kept. So it is where the folder cannot be
            written to.
        digest: identifies all that the entries depend on; it names the file, and is part of the
            checksums.
    """

    def __init__(self, folder: Path | None, digest: str) -> None:
        self._salt = digest.encode()
        self._path = None if folder is None else folder / f"{digest}.jsonl"

    def read(self) -> Iterator[tuple[str, Any]]:
        """Return all entries that are whole, the oldest first."""
        try:
            content = b"" if self._path is None else self._path.read_bytes()
            if content and self._path is not None:
                os.utime(self._path)
        except OSError:
            return
        for line in content.split(b"\n"):
            checksum, _, text = line.partition(b" ")
            if checksum == self._checksum(text):
                key, value = json.loads(text)
                yield key, value

    def add(self, key: str, value: object) -> None:
        """Append an entry, a value of JSON."""
        if self._path is None:
            return
        # as it is: the escapes of two halves of a surrogate pair would be read as one character
        written = json.dumps([key, value], separators=(",", ":"), ensure_ascii=False)
        with suppress(OSError, UnicodeEncodeError):  # without it the cache is slower, not wrong
            text = written.encode()
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
            try:
                size = os.fstat(handle).st_size
                if size + len(text) < MAX_BYTES:
                    # The line break before it ends a line that another process left unfinished.
                    os.write(handle, b"\n" + self._checksum(text) + b" " + text + b"\n")
            finally:
                os.close(handle)
            if size == 0:
                keep_latest(self._path.parent, "*.jsonl", MAX_FILES)

    def _checksum(self, text: bytes) -> bytes:
        return hashlib.sha256(self._salt + text).hexdigest()[:24].encode()
