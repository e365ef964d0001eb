"""One campaign at a time in an output folder."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from suave_des.errors import InputError

LOCK_FILE = ".campaign.lock"


class FolderLock:
    """Holds a folder for this process; the system lets go of it when the process ends, however that comes.

    Args:
        folder: the output folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._path = folder / LOCK_FILE
        self._descriptors: list[int] = []

    def take(self) -> None:
        """Take it; whoever calls this sees to it before that release is called, as this may be interrupted anywhere.

        Raises:
            InputError: another campaign holds it, or it cannot be locked.
        """
        while True:
            try:
                self._descriptors.append(os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666))
            except OSError as error:
                problem = f"the output folder cannot be written: {error.strerror}"
                raise InputError(problem, file=self._folder, remedy="give a folder that is yours") from None
            descriptor = self._descriptors[-1]
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                process = os.pread(descriptor, 20, 0).decode(errors="replace")
                problem = f"another campaign is running in the output folder (process {process or 'unknown'})"
                raise InputError(problem, file=self._folder, remedy="wait for it, or give another folder") from None
            except OSError as error:
                problem = f"the output folder cannot be locked: {error.strerror}"
                raise InputError(problem, file=self._folder, remedy="give a folder on a local disk") from None
            if os.fstat(descriptor).st_nlink:
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, str(os.getpid()).encode(), 0)
                return
            # Its holder ended and removed the file in between.

    def release(self) -> None:
        """Let go of it, and remove its file unless somebody else holds it by now."""
        while self._descriptors:
            os.close(self._descriptors.pop())
        try:
            descriptor = os.open(self._path, os.O_RDWR)
        except OSError:  # it is gone, or was never made
            return
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._path.unlink(missing_ok=True)
        except OSError:  # another campaign's by now
            return
        finally:
            os.close(descriptor)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder for a while; see FolderLock."""
    lock = FolderLock(folder)
    try:
        lock.take()
        yield
    finally:
        lock.release()
