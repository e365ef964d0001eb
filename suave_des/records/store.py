"""The output folder of a campaign: the store of its outcomes, so that no finished mission is lost,
and its files.

The store is an SQLite database rather than a Parquet file, because transactions are atomic even
after a kill, appending needs no new file, damage is noticed, a folder is locked for one campaign,
and it comes with Python. In addition, each outcome carries a checksum.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import time
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple
from weakref import WeakSet

from suave_des.errors import InputError, MissionError, SuaveDesError
from suave_des.files import (
    DERIVED,
    LISTED,
    FileContent,
    Listing,
    Noted,
    check_own,
    check_unchanged,
    json_text,
    json_value,
    listed_files,
    make_output_folder,
    own_files,
    read_json,
    remove_results,
    write_files,
)
from suave_des.interrupts import Stopped, is_stopping
from suave_des.records import contents
from suave_des.records.metrics import Row
from suave_des.records.mission_folder import CAMPAIGN_KNOWLEDGE_FILE

STORE_FILE = "campaign.sqlite"
RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE = "runs.csv", "summary.csv", "manifest.json"
ENSEMBLE_FILE = "ensemble.csv"
CAMPAIGN_FILES = (RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, ENSEMBLE_FILE, CAMPAIGN_KNOWLEDGE_FILE)
_WRITTEN = "written"
"""What is noted of the files beside it."""
SUAVE_FOLDER = "suave"
"""Folder of the exemplar's own files, for its scripts."""
_ENDINGS = ("", "-wal", "-shm", "-journal")
"""Of the database's files."""
_VERSION = 3
_COMMIT_PERIOD_S = 0.1
"""A kill loses at most the missions of this time, besides those under way."""
_ROW, _LASTING, _PASSING = 0, 1, 2
"""Kinds of outcome: a row of runs.csv, a failure, a failure that may not happen again."""
_TABLES = (
    "CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL, crc INTEGER NOT NULL) WITHOUT ROWID",
    "CREATE TABLE outcomes (point INTEGER, manager INTEGER, run INTEGER, kind INTEGER NOT NULL, content TEXT NOT NULL,"
    " crc INTEGER NOT NULL, PRIMARY KEY (point, manager, run)) WITHOUT ROWID",
    f"PRAGMA user_version = {_VERSION}",
)
_SCHEMA = {statement for statement in _TABLES if statement.startswith("CREATE")}
_ALL = "SELECT * FROM outcomes ORDER BY point, manager, run"
_LONGEST_BYTES = 500_000_000
"""Of a value in the database."""
_NAMES_ANOTHER = bytes.fromhex("d9d505f920a163d7")
"""The end of a journal that names a file which SQLite removes when it has used the journal."""


class MissionKey(NamedTuple):
    """The key of a mission in a campaign; missions and their rows are in the order of their keys.

    A sweep's points and a campaign's managers are counted from 0, runs from 1. Runs with the same
    number use common random numbers under all managers and at all points.
    """

    point: int
    manager: int
    run: int


class MissionFailure(NamedTuple):
    """A mission that has no row.

    Attributes:
        time_s: mission time at which it happened; None if that is not known.
        cause: the manager's exception, or another reason why the mission ended.
        lasting: whether the mission itself failed; a time-out or a worker that was killed may not
            happen again, so a resumed campaign runs such a mission once more.
    """

    manager: str
    run: int
    time_s: float | None
    cause: str
    lasting: bool = True
    point: int = 0

    def __str__(self) -> str:
        """Return all that is known, in one line."""
        if self.time_s is None:
            return f"manager {self.manager}, run {self.run}: {self.cause}"
        return str(MissionError(self.manager, self.run, self.time_s, self.cause))


MissionOutcome = tuple[MissionKey, Row | MissionFailure]


class StoreError(SuaveDesError):
    """Outcomes can no longer be kept; earlier ones are safe."""


class Store:
    """The outcomes of one campaign; no other process can use the file until it is closed.

    Args:
        path: the database's file, made if it is missing; None for a temporary one, which is gone
            when this is closed.
        replace: whether one that cannot be used is removed; what else is in it goes with `begin`.

    Raises:
        InputError: another campaign uses it, it is damaged, another version's, or no file of its
            own, such as a link.
        StoreError: it cannot be opened or made.
    """

    def __init__(self, path: Path | None, *, replace: bool = False) -> None:
        self.path = path
        self._committed_s = time.monotonic()
        self._is_open = False
        self._cursors: WeakSet[sqlite3.Cursor] = WeakSet()
        own = [] if path is None else _own(path)
        check_own(own)
        was_there = path is not None and path.exists()
        try:
            self._connect()
        except BaseException as error:
            is_damaged = isinstance(error, InputError) and error.file == str(path)
            is_replaced = replace and is_damaged
            if is_replaced or not was_there:
                for each in own:
                    each.unlink(missing_ok=True)
            if not is_replaced:
                raise
            self._connect()

    def _connect(self) -> None:
        with self.reading():
            self._db = _connected(self.path)
            try:
                self._check()
            except BaseException:
                self._db.close()
                raise
        self._is_open = True

    def _check(self) -> None:
        self._db.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._db.execute("PRAGMA journal_mode = WAL")
        # With this a kill of the process loses nothing; loss of power perhaps the last
        # transactions, whole ones.
        self._db.execute("PRAGMA synchronous = NORMAL")
        self._db.execute("BEGIN EXCLUSIVE")
        if self.is_new:
            return
        (version,) = self._db.execute("PRAGMA user_version").fetchone()
        if version != _VERSION:
            problem = f"is a campaign's store of version {version}, and this suave-des has version {_VERSION}"
            remedy = "resume it with the suave-des version that began it, or start a new one with --overwrite"
            raise InputError(problem, file=self.path, remedy=remedy)
        _check_schema(self._db, self.path)
        (verdict,) = self._db.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise _damaged(self.path, verdict)

    @property
    def is_new(self) -> bool:
        """Whether no campaign was begun in it; one that was killed at its very start leaves that,
        too.
        """
        return not _has_tables(self._db)

    def reading(self) -> AbstractContextManager[None]:
        """Turn whatever is unexpected while what is stored is used into one error about the store,
        as `store_read` does.
        """
        return store_read(self.path)

    def begin(self, about: Mapping[str, object]) -> None:
        """Begin a new campaign, in place of an earlier one, with what is noted about it, by name;
        atomic.

        Raises:
            StoreError: it cannot be written.
        """
        was_new = self.is_new
        with self.reading():
            try:
                for kind, name in self._db.execute(
                    "SELECT type, name FROM sqlite_master"
                ).fetchall():
                    if kind in ("table", "view"):
                        self._db.execute(f'DROP {kind} "{name}"')
                for statement in _TABLES:
                    self._db.execute(statement)
                self._db.executemany(
                    "INSERT INTO about VALUES (?, ?, ?)",
                    (_note(name, about[name]) for name in about),
                )
            except BaseException:
                self._db.execute("ROLLBACK")
                self._db.execute("BEGIN")
                raise
            self._db.execute("COMMIT")
            if not was_new:
                self._db.execute("VACUUM")
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._db.execute("BEGIN")

    # What it is about.

    def about(self, name: str, default: Any = None) -> Any:
        """Return what was noted under a name.

        Raises:
            InputError: nothing was and there is no default, or it is damaged.
        """
        with self.reading():
            return _about(self._db, self.path, name, default)

    def note(self, name: str, value: object) -> None:
        """Note something about the campaign, at once and durably."""
        with self.reading():
            self._db.execute("INSERT OR REPLACE INTO about VALUES (?, ?, ?)", _note(name, value))
        self.commit()

    def written(self) -> dict[str, list[str]]:
        """Return the SHA-256 of each result file that was written, by its name: of now, and of
        before.
        """
        if self.is_new:
            return {}
        with self.reading():
            return contents.WRITTEN.validate_python(self.about(_WRITTEN, default={}))

    # Outcomes.

    def append(self, outcomes: Iterable[MissionOutcome]) -> None:
        """Keep outcomes; they are safe after _COMMIT_PERIOD_S at the latest, if more are appended,
        or after commit().

        Raises:
            StoreError: the disk is full, or the output folder was removed.
        """
        with self.reading():
            self._db.executemany(
                "INSERT OR REPLACE INTO outcomes VALUES (?, ?, ?, ?, ?, ?)", map(_record, outcomes)
            )
        if time.monotonic() - self._committed_s > _COMMIT_PERIOD_S:
            self.commit()

    def commit(self) -> None:
        """Make appended outcomes durable."""
        # the system would let this write on, and throw it away
        if self.path is not None and not self.path.exists():
            problem = f"{self.path} was removed while the campaign ran; its content is lost, so start a new campaign"
            raise StoreError(problem)
        with self.reading():
            if self._db.in_transaction:  # or an interruption came between these two
                self._db.execute("COMMIT")
            self._db.execute("BEGIN")
        self._committed_s = time.monotonic()

    def forget_passing_failures(self) -> None:
        """Remove failures that may not recur."""
        with self.reading():
            self._db.execute("DELETE FROM outcomes WHERE kind = ?", (_PASSING,))

    def settled(self, point: int, manager: int) -> set[int]:
        """Return the runs of a manager at a point that have an outcome."""
        query = "SELECT run FROM outcomes WHERE point = ? AND manager = ?"
        with self.reading():
            return {run for (run,) in self._db.execute(query, (point, manager))}

    def count(self) -> int:
        """Return the number of outcomes."""
        with self.reading():
            return int(self._db.execute("SELECT count(*) FROM outcomes").fetchone()[0])

    def outcomes(self, problem_of: Callable[[MissionOutcome], str]) -> Iterator[MissionOutcome]:
        """Yield all outcomes in the order of their keys, read as they are requested; also of a
        store that is closed.

        Args:
            problem_of: says why an outcome cannot be one of this campaign; empty if it can.

        Raises:
            InputError: the store is damaged.
        """

        def checked(
            records: Iterable[tuple[int, int, int, int, str, int]],
        ) -> Iterator[MissionOutcome]:
            for record in records:
                outcome = _outcome(record, self.path)
                if problem := problem_of(outcome):
                    raise _damaged(self.path, problem)
                yield outcome

        with self.reading():
            if self._is_open:
                self._cursors.add(cursor := self._db.execute(_ALL))
                yield from checked(cursor)
                return
            assert self.path is not None
            with closing(_connected(self.path, "ro")) as db:
                yield from checked(db.execute(_ALL))

    def close(self, *, keep_empty: bool = True) -> None:
        """Leave one plain file behind, without outcomes only if `keep_empty`.

        If the disk is full, a journal stays beside it, from which the rest is read.
        """
        is_empty = False
        with suppress(SuaveDesError):
            is_empty = not keep_empty and (self.is_new or self.count() == 0)
        self._is_open = False
        # one that an interruption left unread would keep the file locked
        for cursor in list(self._cursors):
            cursor.close()
        with suppress(sqlite3.Error):
            self._db.execute("COMMIT")
        self._db.close()
        if self.path is not None and self.path.exists():
            with (
                suppress(sqlite3.Error),
                closing(_connected(self.path)) as db,
            ):
                db.execute("PRAGMA journal_mode = DELETE")
            if is_empty:
                self.path.unlink()


@contextmanager
def store_read(path: Path | None) -> Iterator[None]:
    """Turn whatever is unexpected while what is stored is used into one error about the store.

    Whoever interprets its content does so in this, as there is no end to what a file from
    elsewhere can hold. An error after a signal asked to stop is no damage: it may be that of a
    module whose import the signal broke off.
    """
    try:
        yield
    except (SuaveDesError, MemoryError):
        raise
    except sqlite3.OperationalError as error:
        # none: what is read is no text
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
        if code == sqlite3.SQLITE_BUSY and path is not None:
            problem = "another campaign is running in the output folder"
            remedy = "wait for it, or give another"
            raise InputError(problem, file=path.parent, remedy=remedy) from None
        if code not in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR):
            raise StoreError(
                f"{path or 'temporary files'}: results cannot be kept: {error}"
            ) from None
        raise _damaged(path, error) from None
    except Exception as error:
        if is_stopping():
            raise Stopped from error
        raise _damaged(path, error) from error


def has_campaign(folder: Path) -> bool:
    """Return whether a campaign was begun in a folder; damaged and busy ones count."""
    path = folder / STORE_FILE
    if not path.is_file():
        return False
    try:
        with closing(_connected(path, "ro")) as db:
            return _has_tables(db)
    except (SuaveDesError, sqlite3.Error, UnicodeDecodeError):  # SQLite quotes what is damaged
        return True


def _has_tables(db: sqlite3.Connection) -> bool:
    return db.execute("SELECT 1 FROM sqlite_master").fetchone() is not None


def read_written(folder: Path) -> Noted:
    """Return what is noted of the result files in a folder; nothing if its store is damaged, in use
    or not there.
    """
    path = folder / STORE_FILE
    with suppress(SuaveDesError), store_read(path):
        if path.is_file():
            return contents.WRITTEN.validate_python(read_note(path, _WRITTEN, {}))
    return {}


def read_note(path: Path, name: str, default: Any = None) -> Any:
    """Return what is noted under a name in a store, which may come from elsewhere, without changing
    it.

    Raises:
        InputError: the store is not a campaign's, or damaged.
        StoreError: it cannot be read now.
    """
    with store_read(path), closing(_connected(path, "immutable")) as db:
        _check_schema(db, path)
        return _about(db, path, name, default)


def check_store(path: Path) -> None:
    """Raise an InputError if a store, which may come from elsewhere, is not a campaign's."""
    with store_read(path), closing(_connected(path, "immutable")) as db:
        _check_schema(db, path)


def _about(db: sqlite3.Connection, path: Path | None, name: str, default: Any) -> Any:
    found = db.execute("SELECT value, crc FROM about WHERE name = ?", (name,)).fetchone()
    if found is None and default is not None:
        return default
    if found is None or _crc(name, found[0]) != found[1]:
        what = "missing" if found is None else "not what was written"
        raise _damaged(path, f"its {name} is {what}")
    return json_value(found[0])


def _own(path: Path) -> list[Path]:
    return [path.with_name(f"{path.name}{ending}") for ending in _ENDINGS]


def _connected(path: Path | None, mode: str = "rwc") -> sqlite3.Connection:
    """Open a database that may come from elsewhere; None: a temporary one.

    Args:
        mode: rwc, ro, or "immutable", with which nothing beside it is touched, nor are locks heeded;
            where there are journals, which have a part of what is kept, it is as ro.

    Raises:
        InputError: one of its files is a link, or would have SQLite remove some other file.
    """
    name = ""
    if path is not None:
        check_own(own := _own(path))
        end = _end(own[-1])
        if end == _NAMES_ANOTHER:
            raise _damaged(path, "its journal names another file, which would be removed")
        if mode != "rwc" and end and _end(path):  # a campaign was killed as it began or ended
            with closing(_connected(path)) as db:
                db.execute("SELECT 1 FROM sqlite_master").fetchone()
        journals = any(each.exists() for each in own[1:])
        query = "mode=ro&immutable=1" if mode == "immutable" and not journals else "mode=ro"
        query = "mode=rwc" if mode == "rwc" else query
        name = f"{path.absolute().as_uri()}?{query}"
    db = sqlite3.connect(name, timeout=0.0, isolation_level=None, uri=True)
    db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST_BYTES)
    db.execute("PRAGMA trusted_schema = OFF")
    return db


def _end(path: Path) -> bytes:
    """Return the last bytes of a file; none if it is empty, or not there."""
    with suppress(OSError), path.open("rb") as file:
        file.seek(-min(len(_NAMES_ANOTHER), file.seek(0, os.SEEK_END)), os.SEEK_END)
        return file.read()
    return b""


def _check_schema(db: sqlite3.Connection, path: Path | None) -> None:
    """Check that a database has the tables of a campaign's store, and nothing that acts by itself,
    such as a view.
    """
    found = db.execute("SELECT sql FROM sqlite_master").fetchall()
    if len(found) != len(_SCHEMA) or {sql for (sql,) in found} != _SCHEMA:
        raise _damaged(path, "it does not have the tables of a campaign's store")


def _damaged(path: Path | None, what: object) -> InputError:
    remedy = "restore it from a copy, or start a new campaign with --overwrite; result files beside it are complete"
    what = " ".join(str(what).split()) or type(what).__name__
    return InputError(f"is damaged: {what}", file=path, remedy=remedy)


def _note(name: str, value: object) -> tuple[str, str, int]:
    text = json.dumps(value)
    return name, text, _crc(name, text)


def _record(outcome: MissionOutcome) -> tuple[int, int, int, int, str, int]:
    key, found = outcome
    kind = _ROW
    if isinstance(found, MissionFailure):
        kind = _LASTING if found.lasting else _PASSING
    content = json.dumps(found)
    return (*key, kind, content, _crc(*key, kind, content))


def _outcome(record: tuple[int, int, int, int, str, int], path: Path | None) -> MissionOutcome:
    *numbers, kind, content, crc = record
    key = MissionKey(*map(int, numbers))
    if _crc(*key, kind, content) != crc:
        raise _damaged(path, f"the outcome of run {key.run} is not what was written")
    cells = json_value(content)
    if kind == _ROW:
        return key, contents.row_of(cells)
    return key, MissionFailure(*contents.FAILURE.validate_python(tuple(cells)))


def _crc(*parts: object) -> int:
    return zlib.crc32(" ".join(map(str, parts)).encode(errors="replace"))


# The files beside it.


def write_campaign(
    store: Store,
    about: Mapping[str, object],
    files: Mapping[str, FileContent],
    suave: Mapping[str, FileContent],
) -> None:
    """Write a campaign's manifest, which lists all others, and its files, of those in
    CAMPAIGN_FILES, into the folder of its store, replacing those of an earlier use.

    The exemplar's own files, `suave`, have a folder to themselves: scripts that take all files of a
    folder, or compare one file with the others, find what they expect.

    Raises:
        InputError: they cannot be written; nothing half-written stays. Or one would replace a file
            that was changed since, or is the user's.
    """
    assert store.path is not None
    folder = store.path.parent
    noted = store.written()
    check_replaceable(folder, noted)
    before = own_files(folder, MANIFEST_FILE, noted)
    names = [*files, *(f"{SUAVE_FOLDER}/{name}" for name in suave)]
    check_unchanged(folder, names, before)
    derived = {name: digest for name, digest in before.items() if name in DERIVED}
    inner = folder / SUAVE_FOLDER
    if suave:
        make_output_folder(inner)

    def manifest(hashes: Mapping[str, str]) -> str:
        # before any is renamed, or a kill would leave what is not known
        made = {**hashes, MANIFEST_FILE: _digest(about)}
        known = {name: {*noted.get(name, ()), new} for name, new in made.items()}
        store.note(_WRITTEN, {name: sorted(digests) for name, digests in known.items()})
        return json_text({**about, LISTED: {**derived, **hashes}})

    all_files: dict[str, FileContent | Listing] = {
        **files,
        **{f"{SUAVE_FOLDER}/{name}": content for name, content in suave.items()},
        MANIFEST_FILE: manifest,
    }
    write_files(folder, all_files, stale=before.keys() - derived.keys())
    _leave_empty(folder, before)


def check_replaceable(folder: Path, noted: Noted) -> None:
    """Check that the files of the campaign in a folder, which are to be written anew, are as they
    were written, as far as is noted and listed.

    Raises:
        InputError: one was changed since, or is the user's.
    """
    own = own_files(folder, MANIFEST_FILE, noted)
    with suppress(InputError):
        content = read_json(folder / MANIFEST_FILE)
        is_ours = isinstance(content, dict) and LISTED in content
        if MANIFEST_FILE in noted:
            is_ours = _digest(content) in noted[MANIFEST_FILE]
        if is_ours:
            own[MANIFEST_FILE] = ""
    known = {**listed_files(folder, MANIFEST_FILE), **noted}.keys() - {*DERIVED}
    check_unchanged(folder, [RUNS_FILE, SUMMARY_FILE, *sorted(known), MANIFEST_FILE], own)


def _digest(content: object) -> str:
    """Return the SHA-256, in hex, of what a manifest says, but for the files that it lists, as more
    are added when pages are made of them.
    """
    rest = content
    if isinstance(content, dict):
        rest = {key: value for key, value in content.items() if key != LISTED}
    return hashlib.sha256(json.dumps(rest).encode()).hexdigest()


def _leave_empty(folder: Path, removed: Collection[str]) -> None:
    """Remove the folder of the exemplar's files if only its files that were removed were in it."""
    if any(name.startswith(f"{SUAVE_FOLDER}/") for name in removed):
        with suppress(OSError):  # something is in it
            (folder / SUAVE_FOLDER).rmdir()


def tidy(store: Store, *, is_new: bool) -> None:
    """Remove unfinished files from the folder of a campaign's store, and the results of an earlier
    one, if this is a new one.

    Raises:
        InputError: the folder of the exemplar's files is a link, whose files would be replaced.
    """
    assert store.path is not None
    folder = store.path.parent
    if (folder / SUAVE_FOLDER).is_symlink():
        raise InputError(
            "is a link, which is not followed", file=folder / SUAVE_FOLDER, remedy="remove it"
        )
    noted: Noted = {}
    with suppress(InputError):  # it is damaged: what the manifest lists is known
        noted = store.written()
    own = own_files(folder, MANIFEST_FILE, noted) if is_new else {}
    if own:
        own[MANIFEST_FILE] = ""
    remove_results(folder, {*CAMPAIGN_FILES, *noted}, own)
    _leave_empty(folder, own)


def is_left_over(name: str) -> bool:
    """Return whether a file of a folder that has no campaign was left by one that was killed at its
    start.
    """
    return name.startswith(STORE_FILE)


def read_manifest(folder: Path) -> contents.Manifest:
    """Read a campaign's manifest.json; empty without one.

    Raises:
        InputError: it cannot be read, or is of another campaign than the missions that are kept
            beside it.
    """
    path = folder / MANIFEST_FILE
    store = folder / STORE_FILE
    if not path.exists():
        return contents.Manifest()
    remedy = f"restore it, or remove it: suave-des campaign --resume {folder} writes it anew"
    manifest = contents.read(contents.Manifest, path, remedy)
    kept = None
    if store.is_file():
        with suppress(SuaveDesError):  # damaged or in use: the files beside it are complete
            kept = read_note(store, "identity")
    if manifest.campaign_sha256 is not None and kept not in (None, manifest.campaign_sha256):
        remedy = (
            f"suave-des campaign --resume {folder} writes those of the campaign that is kept there"
        )
        raise InputError(
            f"{RUNS_FILE} and {STORE_FILE} are of different campaigns", file=folder, remedy=remedy
        )
    return manifest
