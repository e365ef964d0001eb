"""The store of a running campaign's outcomes, so that no finished mission is lost: an SQLite database.

SQLite rather than Parquet, because transactions are atomic even after a kill, appending needs no new
file, damage is noticed, and it comes with Python. In addition, each outcome carries a checksum.
"""

from __future__ import annotations

import json
import os
import sqlite3
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any
from weakref import WeakSet

from filelock import FileLock, Timeout

from suave_des.campaign.missions import Finished, MissionFailure, MissionGroup, MissionKey
from suave_des.errors import InputError, SuaveDesError

STORE_FILE = "campaign.sqlite"
NEW_STORE_FILE = f".{STORE_FILE}.new"
"""Its name until it is complete."""
LOCK_FILE = ".campaign.lock"

_ENDINGS = ("", "-wal", "-shm", "-journal")
"""Of the database's files."""
_VERSION = 2
_COMMIT_PERIOD_S = 0.1
"""A kill loses at most the missions of this time, besides those under way."""
_ROW, _LASTING, _PASSING = 0, 1, 2
"""Kinds of outcome: a row of runs.csv, a failure, a failure that may not happen again."""
_TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL, crc INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE outcomes (
    point INTEGER, manager INTEGER, run INTEGER, kind INTEGER NOT NULL, content TEXT NOT NULL, crc INTEGER NOT NULL,
    PRIMARY KEY (point, manager, run)
) WITHOUT ROWID;
"""

_ALL = "SELECT * FROM outcomes ORDER BY point, manager, run"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock a folder for this process; the system releases the lock when the process ends, for whatever reason.

    Raises:
        InputError: another campaign holds it, or it cannot be locked.
    """
    path = folder / LOCK_FILE
    _check_no_links(folder)
    lock = FileLock(path, timeout=0, mode=0o666)
    try:
        try:
            lock.acquire()
            handle = os.open(path, os.O_WRONLY | os.O_TRUNC | os.O_NOFOLLOW)
            try:
                os.write(handle, str(os.getpid()).encode())
            finally:
                os.close(handle)
        except Timeout:
            process = path.read_text(errors="replace") if path.is_file() else ""
            problem = f"another campaign is running in the output folder (process {process or 'unknown'})"
            raise InputError(problem, file=folder, remedy="wait for it, or give another folder") from None
        except OSError as error:
            problem = f"the output folder cannot be locked: {error.strerror}"
            raise InputError(problem, file=folder, remedy="give a folder that is yours, on a local disk") from None
        yield
    finally:
        with suppress(Timeout, OSError):  # it is another campaign's, or gone; it may also have been half acquired
            lock.acquire()
            path.unlink(missing_ok=True)
        lock.release(force=True)


def _check_no_links(folder: Path) -> None:
    """Check that files to be written in place are not links: a folder from elsewhere could link to any file.

    Raises:
        InputError: it is.
    """
    for name in (LOCK_FILE, *(f"{STORE_FILE}{ending}" for ending in _ENDINGS)):
        if (folder / name).is_symlink():
            raise InputError("is a link, which is not followed", file=folder / name, remedy="remove it")


class StoreError(SuaveDesError):
    """Outcomes can no longer be kept; earlier ones are safe."""


class Store:
    """The outcomes of one campaign.

    Args:
        path: the database's file, made by make_store; None for a temporary one, which is gone when this is closed.

    Raises:
        InputError: it is damaged, or is another version's.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self._committed_s = time.monotonic()
        self._inode = 0
        self._cursors: WeakSet[sqlite3.Cursor] = WeakSet()
        with _user_errors(path):
            self._db = sqlite3.connect("" if path is None else path, isolation_level=None)
            try:
                self._open()
            except BaseException:
                self._db.close()
                raise
        if path is not None:
            self._inode = path.stat().st_ino

    def _open(self) -> None:
        self._db.execute("PRAGMA locking_mode = EXCLUSIVE")
        if self.path is None:
            self._db.executescript(_TABLES)
        else:
            self._check()
        self._db.execute("PRAGMA journal_mode = WAL")
        # With this a kill of the process loses nothing; loss of power perhaps the last transactions, whole ones.
        self._db.execute("PRAGMA synchronous = NORMAL")
        self._db.execute("BEGIN")

    def _check(self) -> None:
        (version,) = self._db.execute("PRAGMA user_version").fetchone()
        if version != _VERSION:
            raise InputError(
                f"is a campaign's store of version {version}, and this suave-des has version {_VERSION}",
                file=self.path,
                remedy="resume it with the suave-des version that began it, or start a new one with --overwrite",
            )
        (verdict,) = self._db.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise _damaged(self.path, verdict)

    # What it is about.

    def about(self, name: str, default: Any = None) -> Any:
        """Return what was noted under a name.

        Raises:
            InputError: nothing was and there is no default, or it is damaged.
        """
        with _user_errors(self.path):
            found = self._select("SELECT value, crc FROM about WHERE name = ?", name).fetchone()
        if found is None and default is not None:
            return default
        if found is None or _crc(name, found[0]) != found[1]:
            raise _damaged(self.path, f"its {name} is {'missing' if found is None else 'not what was written'}")
        return json.loads(found[0])

    def note(self, name: str, value: Any) -> None:
        """Note something about the campaign, at once and durably."""
        with _user_errors(self.path):
            self._db.execute("INSERT OR REPLACE INTO about VALUES (?, ?, ?)", _note(name, value))
        self.commit()

    # Outcomes.

    def append(self, finished: Iterable[Finished]) -> None:
        """Keep outcomes; they are safe after _COMMIT_PERIOD_S at the latest, if more are appended, or after commit().

        Raises:
            StoreError: the disk is full, or the output folder was removed.
        """
        with _user_errors(self.path):
            self._db.executemany("INSERT OR REPLACE INTO outcomes VALUES (?, ?, ?, ?, ?, ?)", map(_record, finished))
        if time.monotonic() - self._committed_s > _COMMIT_PERIOD_S:
            self.commit()

    def commit(self) -> None:
        """Make appended outcomes durable."""
        if self.path is not None:
            self._check_still_there(self.path)
        with _user_errors(self.path):
            if self._db.in_transaction:  # or an interruption came between these two
                self._db.execute("COMMIT")
            self._db.execute("BEGIN")
        self._committed_s = time.monotonic()

    def _check_still_there(self, path: Path) -> None:
        # The system lets a process write into a file that was removed, and throws it away afterwards.
        try:
            same = path.stat().st_ino == self._inode
        except OSError:
            same = False
        if not same:
            raise StoreError(f"{path} was removed while the campaign ran; its content is lost, so start a new campaign")

    def forget_passing_failures(self) -> None:
        """Remove failures that may not recur."""
        with _user_errors(self.path):
            self._db.execute("DELETE FROM outcomes WHERE kind = ?", (_PASSING,))

    def settled(self, group: MissionGroup) -> set[int]:
        """Return the runs of a group that have an outcome."""
        with _user_errors(self.path):
            found = self._select("SELECT run FROM outcomes WHERE point = ? AND manager = ?", *group)
            return {run for (run,) in found}

    def count(self) -> int:
        """Return the number of outcomes."""
        with _user_errors(self.path):
            (number,) = self._select("SELECT count(*) FROM outcomes").fetchone()
        return int(number)

    def outcomes(self) -> Iterator[Finished]:
        """Yield all outcomes in the order of their keys, read as they are requested.

        Raises:
            InputError: the store is damaged.
        """
        with _user_errors(self.path):
            for record in self._select(_ALL):
                yield _finished(record, self.path)

    def _select(self, query: str, *values: object) -> sqlite3.Cursor:
        cursor = self._db.execute(query, values)
        self._cursors.add(cursor)
        return cursor

    def close(self) -> None:
        """Leave one plain file behind. If the disk is full, a journal stays beside it, from which the rest is read."""
        try:
            for cursor in list(self._cursors):  # one that an interruption left unread would keep the file locked
                cursor.close()
            with suppress(sqlite3.Error):
                self._db.execute("COMMIT")
            with suppress(sqlite3.Error):
                self._db.execute("PRAGMA journal_mode = DELETE")
        finally:
            self._db.close()


def make_store(path: Path, about: Mapping[str, Any]) -> None:
    """Make the database of a new campaign, replacing an earlier one; atomic.

    Args:
        path: its file.
        about: what is noted about the campaign, by name.

    Raises:
        StoreError: it cannot be written.
    """
    new = path.with_name(NEW_STORE_FILE)
    new.unlink(missing_ok=True)
    try:
        with _user_errors(path), closing(sqlite3.connect(new, isolation_level=None)) as db:
            db.executescript(f"BEGIN; {_TABLES} PRAGMA user_version = {_VERSION};")
            db.executemany("INSERT INTO about VALUES (?, ?, ?)", (_note(name, about[name]) for name in about))
            db.execute("COMMIT")
        remove_store(path.parent)
        new.rename(path)
    except BaseException:
        new.unlink(missing_ok=True)
        raise


def stored_outcomes(path: Path) -> Iterator[Finished]:
    """Yield the outcomes in a store that is closed, in the order of their keys.

    Raises:
        InputError: the store is not there, or is damaged.
    """
    with _user_errors(path), closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as db:
        for record in db.execute(_ALL):
            yield _finished(record, path)


def remove_store(folder: Path) -> None:
    """Remove a campaign's store from a folder, if there is one."""
    for ending in _ENDINGS:
        (folder / f"{STORE_FILE}{ending}").unlink(missing_ok=True)


_DAMAGES = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)
"""Codes of errors that a damaged file leads to; with the last, a table is not as it was made."""


@contextmanager
def _user_errors(path: Path | None) -> Iterator[None]:
    """Turn errors of the database into errors for the user."""
    try:
        yield
    except sqlite3.OperationalError as error:
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT)  # none: what is read is no text
        if code & 0xFF in _DAMAGES:
            raise _damaged(path, error) from None
        raise StoreError(f"{path or 'temporary files'}: results cannot be kept: {error}") from None
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        raise _damaged(path, error) from None


def _damaged(path: Path | None, what: object) -> InputError:
    remedy = "restore it from a copy, or start a new campaign with --overwrite; result files beside it are complete"
    return InputError(f"is damaged: {what}", file=path, remedy=remedy)


def _note(name: str, value: Any) -> tuple[str, str, int]:
    text = json.dumps(value)
    return name, text, _crc(name, text)


def _record(finished: Finished) -> tuple[int, int, int, int, str, int]:
    key, outcome = finished
    kind = _ROW if not isinstance(outcome, MissionFailure) else _LASTING if outcome.lasting else _PASSING
    content = json.dumps(outcome)
    return (*key, kind, content, _crc(*key, kind, content))


def _finished(record: tuple[int, int, int, int, str, int], path: Path | None) -> Finished:
    *numbers, kind, content, crc = record
    try:
        key = MissionKey(*map(int, numbers))
    except (TypeError, ValueError):
        raise _damaged(path, "an outcome has no number of its mission") from None
    if _crc(*key, kind, content) != crc:
        raise _damaged(path, f"the outcome of run {key.run} is not what was written")
    cells = json.loads(content)
    return key, tuple(cells) if kind == _ROW else MissionFailure(*cells)


def _crc(*parts: object) -> int:
    return zlib.crc32(" ".join(map(str, parts)).encode(errors="replace"))
