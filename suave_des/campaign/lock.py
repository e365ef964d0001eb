"""One campaign at a time in an output folder."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from suave_des.errors import InputError

LOCK_FILE = ".campaign.lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder for this process; the system lets go of it when the process ends, however that comes.

    Raises:
        InputError: another campaign holds it, or it cannot be locked.
    """
    path = folder / LOCK_FILE
    descriptor = _hold(folder, path)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(descriptor)


def _hold(folder: Path, path: Path) -> int:
    while True:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            problem = f"the output folder cannot be written: {error.strerror}"
            raise InputError(problem, file=folder, remedy="give a folder that is yours") from None
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            process = os.pread(descriptor, 20, 0).decode(errors="replace")
            os.close(descriptor)
            problem = f"another campaign is running in the output folder (process {process or 'unknown'})"
            raise InputError(problem, file=folder, remedy="wait for it, or give another folder") from None
        except OSError as error:
            os.close(descriptor)
            problem = f"the output folder cannot be locked: {error.strerror}"
            raise InputError(problem, file=folder, remedy="give a folder on a local disk") from None
        if os.fstat(descriptor).st_nlink:
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, str(os.getpid()).encode(), 0)
            return descriptor
        os.close(descriptor)  # its holder ended and removed it in between
