"""Read files that the user named."""

from __future__ import annotations

import stat
from pathlib import Path

from suave_des.errors import InputError


def read_bytes(path: Path, limit: int) -> bytes:
    """Read a file that the user named.

    Raises:
        InputError: missing, a folder, not a regular file, unreadable, or longer than `limit` bytes.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode) and not path.is_dir():  # a pipe would be waited for without end
            raise InputError("is not a regular file", file=path, remedy="name a file on disk")
        with path.open("rb") as stream:
            content = stream.read(limit + 1)
    except IsADirectoryError:
        raise InputError("is a folder", file=path, remedy="name a file in it") from None
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy="check the name") from None
    except OSError as error:
        remedy = "check the name and the rights"
        raise InputError(f"cannot be read: {error.strerror}", file=path, remedy=remedy) from None
    if len(content) > limit:
        raise InputError(f"is larger than {limit:,} bytes", file=path, remedy="split it or shorten it")
    return content


def decode(path: Path, content: bytes) -> str:
    """Decode the content of a file as text; a byte order mark is dropped.

    Raises:
        InputError: not UTF-8, with the line.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError("is not UTF-8 text", file=path, place=f"line {line}", remedy="save it as UTF-8") from None
