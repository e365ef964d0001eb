"""Files that the user named: read within limits; checked before the work, and written whole or not
at all.
"""

from __future__ import annotations

import csv
import errno
import hashlib
import io
import json
import math
import os
import re
import stat
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from glob import escape
from itertools import accumulate, islice
from pathlib import Path
from typing import Any, TypeVar

from suave_des.errors import InputError, line_error

NO_SPACE = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of the system's errors about a disk that is full."""
LIMIT_BYTES = 1_000_000_000
"""Of a file that has no smaller limit."""
_PIECE_ROWS = 1000
_DEEPEST = 200
"""Of JSON: how deep it may be nested."""
_JSON_TEXT = re.compile(r'"(?:[^"\\]|\\.)*"', re.DOTALL)
_PART = ".part"

Json = dict[str, Any]
"""An object of JSON or YAML as it was read: what its values are is checked where they are used."""
PAGES = ("replay.html", "report.html")
"""Files that are made beside the results of any family."""
VALIDATION_FILES = (
    *("validation.csv", "validation_pairs.csv", "validation_shares.csv"),
    *("validation_targets.csv", "validation.json"),
)
DERIVED = (
    *("paper_table.md", "paper_table.csv"),
    *VALIDATION_FILES,
    *("distributions.png", "detections.png"),
    *PAGES,
)
"""Files that reproduce, validate, report and replay make of a campaign's, beside them."""
FAMILIES: Mapping[str, tuple[str, ...]] = {
    "mission": ("mission.json", "events.csv", "trajectory.csv", "knowledge.jsonl"),
    "campaign": (
        "campaign.sqlite",
        "runs.csv",
        "summary.csv",
        "manifest.json",
        "ensemble.csv",
        "validation_conditions.csv",
        "suave_results.csv",
        *DERIVED,
        "knowledge_states.jsonl",
    ),
}
"""Names of result files by kind; a folder has those of one family, so that nothing in it is
misread.
"""

LISTINGS = {"mission": "mission.json", "campaign": "manifest.json"}
"""Names of the files that list the others, by kind."""

DECIMALS = 6
"""Digits after the point in result files."""
LISTED = "files_sha256"
"""Key of a listing of files that the project has written, with their SHA-256, in hex."""
FileContent = str | bytes | Iterable[str]
Listing = Callable[[Mapping[str, str]], str]
Noted = Mapping[str, Collection[str]]
"""SHA-256 of each file that was written, by its name: of now, and of before."""
_Rounded = TypeVar("_Rounded", float, "float | None", "str | int | float | bool | None", object)


@contextmanager
def opened(path: Path) -> Iterator[io.BufferedReader]:
    """Open a file that the user named; what is no file, such as a pipe, is not waited for.

    Raises:
        InputError: missing, a folder, not a regular file, or unreadable.
    """
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as stream:  # noqa: PTH123
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                raise InputError("is not a regular file", file=path, remedy="name a file on disk")
            yield stream
    except IsADirectoryError:
        raise InputError("is a folder", file=path, remedy="name a file in it") from None
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy="check the name") from None
    except OSError as error:
        remedy = "check the name and the rights"
        raise InputError(f"cannot be read: {error.strerror}", file=path, remedy=remedy) from None


def read_bytes(path: Path, limit: int = LIMIT_BYTES) -> bytes:
    """Read a file that the user named; raises as `opened`, and if it is longer than `limit`
    bytes.
    """
    with opened(path) as stream:
        content = stream.read(limit + 1)
    if len(content) > limit:
        raise InputError(
            f"is larger than {limit:,} bytes", file=path, remedy="split it or shorten it"
        )
    return content


def sha256_of(path: Path, limit: int = LIMIT_BYTES) -> str:
    """Return the SHA-256 of a file, in hex; raises as read_bytes does."""
    return hashlib.sha256(read_bytes(path, limit)).hexdigest()


def _own_sha256_of(path: Path) -> str:
    """Return the SHA-256, in hex, of a result file of any length; raises as `opened`."""
    with opened(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def real(path: Path) -> Path:
    """Return a path without links; Path.resolve would raise a RuntimeError for a circle of them."""
    return Path(os.path.realpath(path))


def check_own(paths: Iterable[Path]) -> None:
    """Check that files that are to be changed in place are that: a link or a pipe may lead to
    anything.

    Raises:
        InputError: one of those that are there is a link, has a second name, or is no file.
    """
    for path in paths:
        try:
            found = path.lstat()
        except OSError:
            continue
        _check(
            path,
            (stat.S_ISLNK(found.st_mode), "is a link, which is not followed", "remove it"),
            (not stat.S_ISREG(found.st_mode), "is not a regular file", "remove it"),
            (
                found.st_nlink > 1,
                "is a hard link: another file would change with it",
                "remove it, or copy the folder",
            ),
        )


def read_json(path: Path) -> Any:
    """Read a JSON file that the user named; raises as `opened`, and as parse_json does."""
    return parse_json(decode(path, read_bytes(path)), path)


def parse_json(text: str, path: Path) -> Any:
    """Return what a JSON text stands for, which is from a file.

    Raises:
        InputError: it is not JSON, or has a number that is not finite.
    """
    try:
        return json_value(text, _finite)
    except ValueError as error:
        raise InputError(
            f"is not JSON: {error}", file=path, remedy="restore it, or make it anew"
        ) from None


def json_value(text: str | bytes, real: Callable[[str], float] = float) -> Any:
    """Parse JSON from elsewhere as `json.loads` does.

    Python's parser goes as deep as the stack allows, and Python 3.14 ends there where Java has
    marked the end of the stack as its own.

    Args:
        real: converts numbers with a point or an exponent, NaN and Infinity.

    Raises:
        ValueError: it is not JSON, or nested more than 200 deep.
    """
    decoded = text if isinstance(text, str) else text.decode("utf-8-sig")
    if decoded.count("[") + decoded.count("{") > _DEEPEST:
        brackets = re.findall(r"[\[\]{}]", _JSON_TEXT.sub("", decoded))
        depths = accumulate(1 if each in "[{" else -1 for each in brackets)
        if max(depths, default=0) > _DEEPEST:
            raise ValueError(f"nested more than {_DEEPEST} deep")
    return _decoder(real).decode(decoded)


@cache  # json.loads makes one at each call, which takes as long as a short text
def _decoder(real: Callable[[str], float]) -> json.JSONDecoder:
    return json.JSONDecoder(parse_float=real, parse_constant=real)


def _finite(text: str) -> float:
    if not math.isfinite(number := float(text)):
        raise ValueError(f"{text} is not a finite number")
    return number


def decode(path: Path, content: bytes) -> str:
    """Decode the content of a file as text, without byte order mark; an InputError has the line
    that is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise line_error(path, line, "is not UTF-8 text", "save it as UTF-8") from None


def read_csv(
    path: Path, limit: int, remedy: str
) -> tuple[list[str], Iterator[tuple[int, list[str]]], str]:
    """Read a CSV file of at most `limit` bytes that the user named; `remedy` is for a line that is
    not CSV.

    Returns:
        Its header, its rows, each with its line, read as they are requested and without empty ones,
        and its SHA-256.

    Raises:
        InputError: as of read_bytes and decode; or with the line, when its turn comes, that it is
            not CSV.
    """
    content = read_bytes(path, limit)
    reader = csv.reader(io.StringIO(decode(path, content), newline=""), strict=True)

    def rows() -> Iterator[tuple[int, list[str]]]:
        try:
            for row in reader:
                yield reader.line_num, row
        except csv.Error as error:
            raise line_error(path, reader.line_num, f"is not valid CSV: {error}", remedy) from None

    numbered = rows()
    _, header = next(numbered, (1, []))
    filled = ((line, row) for line, row in numbered if any(map(str.strip, row)))
    return [name.strip() for name in header], filled, hashlib.sha256(content).hexdigest()


def as_number(text: str) -> float:
    """Return the number that a text is; nan if it is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def rounded(value: _Rounded) -> _Rounded:
    """Round a number as in result files; what is no float stays."""
    # + 0.0: no minus before a zero
    return round(value, DECIMALS) + 0.0 if isinstance(value, float) else value


def csv_text(columns: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    r"""Return a CSV file with a header: RFC 4180, except that lines end with \n. Numbers are
    rounded.
    """
    return "".join(csv_pieces(columns, (map(rounded, row) for row in rows)))


def csv_pieces(columns: Sequence[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    """Yield a CSV file as csv_text returns it, piece by piece, so that few of its rows are in
    memory: numbers with all their digits in their shortest form, True or False, empty for None.
    """
    rest = iter(rows)
    part: list[Iterable[object]] = [columns]
    while part:
        buffer = io.StringIO()
        csv.writer(buffer, lineterminator="\n").writerows(part)
        yield buffer.getvalue()
        part = list(islice(rest, _PIECE_ROWS))


def json_text(content: Mapping[str, object]) -> str:
    """Return a JSON file that people can read, too."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def check_ending(file: Path, endings: Iterable[str], what: str) -> None:
    """Raise an InputError unless a file has one of some endings; `what` it is to be: "a table"."""
    if file.suffix.lower() not in endings:
        problem = f"expected {what}, got {file.suffix or 'a file without an ending'}"
        raise InputError(problem, file=file, remedy=f"one of {', '.join(endings)}")


def check_output_folder(
    folder: Path,
    family: str,
    *,
    overwrite: bool,
    left_over: Callable[[str], bool] = lambda name: False,
    noted: Mapping[str, Collection[str]] = {},
) -> None:
    """Check that results can go into a folder, without changing anything.

    Args:
        family: the kind of results, a key of FAMILIES.
        overwrite: whether the folder need not be empty.
        left_over: returns whether a file of that name does not count.
        noted: what was written, if more is known of that than is listed.

    Raises:
        InputError: it is not empty and `overwrite` is false, has results of another family, is a
            file, or cannot be written.
    """
    with _user_errors(folder):
        is_folder = folder.is_dir()
        entries = [entry.name for entry in folder.iterdir()] if is_folder else []
        is_there = os.path.lexists(folder)
        place = folder if is_there else folder.parent
        has_place = place.is_dir()
    _check_family(folder, family, entries)
    if overwrite and is_there:
        _check_replaced(folder, family, entries, noted)
    counting = sorted(name for name in entries if not left_over(name))
    _check(
        folder,
        (
            counting and not overwrite,
            f"the output folder is not empty: it has {', '.join(counting[:1])}",
            "give another folder, or --overwrite to replace the results in it",
        ),
        (
            is_there and not is_folder,
            "the output folder is not a folder",
            "give another path",
        ),
        (
            not has_place,
            f"there is no folder {folder.parent} to make it in",
            "make that folder first",
        ),
        (
            not os.access(place, os.W_OK | os.X_OK),
            "the output folder cannot be written",
            "give a folder that is yours",
        ),
    )


def _check_family(folder: Path, family: str, entries: Collection[str]) -> None:
    """Check that no results of another family are in a folder."""
    for other, names in FAMILIES.items():
        known = sorted(set(entries).intersection(names).difference(PAGES))
        if other != family and known:
            problem = f"the output folder has a {other}'s results in it ({known[0]}), which this command does not replace"
            remedy = "give another folder, or remove them first"
            raise InputError(problem, file=folder, remedy=remedy)


def _check_replaced(folder: Path, family: str, entries: Collection[str], noted: Noted) -> None:
    """Check that all that would be replaced in a folder is the project's, and unchanged."""
    listing = LISTINGS[family]
    about = read_json(folder / listing) if listing in entries else {LISTED: {}}
    problem = f"has {listing}, which suave-des did not write"
    if isinstance(about, dict) and LISTED in about:
        known = (*own_files(folder, listing, noted), *DERIVED, listing, "campaign.sqlite")
        others = [name for name in FAMILIES[family] if name in entries and name not in known]
        if not others:
            return
        problem = f"has {others[0]}, which is not as suave-des wrote it"
    raise InputError(problem, file=folder, remedy="move it, or give another folder")


def check_output_file(file: Path, *, overwrite: bool) -> None:
    """Check that a file can be written, without changing anything.

    Raises:
        InputError: it is a folder, its folder does not exist or cannot be written, or it exists and
            `overwrite` is false.
    """
    _check(
        file,
        (not file.name or os.path.isdir(file), "is a folder", "name a file in it"),  # noqa: PTH112
        (_is_circle(file), "is a link in a circle", "remove it"),
    )
    final = file if _is_written_into(file) else real(file)
    _check(
        file,
        (
            not final.parent.is_dir(),
            f"there is no folder {final.parent} to write it in",
            "make it first",
        ),
        (
            final != file and not os.access(final.parent, os.W_OK | os.X_OK),
            "its folder cannot be written",
            "give one that is yours",
        ),
        (
            os.path.exists(file) and not overwrite,  # noqa: PTH110
            "exists already",
            "give another name, or --overwrite to replace it",
        ),
    )


def _check(path: Path, *cases: tuple[object, str, str]) -> None:
    """Raise an error for the first case, of condition, problem and remedy, whose condition
    holds.
    """
    for is_wrong, problem, remedy in cases:
        if is_wrong:
            raise InputError(problem, file=path, remedy=remedy)


def make_output_folder(folder: Path) -> None:
    """Make the folder if it is not there yet; an InputError if it cannot be made."""
    with _user_errors(folder):
        folder.mkdir(exist_ok=True)


def listed_files(folder: Path, listing: str) -> dict[str, object]:
    """Return what a folder's listing, a JSON file that may come from elsewhere, has under
    `files_sha256`: the SHA-256 of files by their names.
    """
    try:
        return dict(read_json(folder / listing)[LISTED])
    except (InputError, KeyError, TypeError, ValueError):
        return {}


def own_files(
    folder: Path, listing: str, noted: Mapping[str, Collection[str]] = {}
) -> dict[str, str]:
    """Return the SHA-256 of the files in a folder that are as the project has written them, by
    their names: those that are listed, or noted elsewhere, unchanged.
    """
    listed = listed_files(folder, listing)
    own = {}
    for name in {**listed, **noted}:
        with suppress(InputError, ValueError):  # it is not there, or has no name of a file
            if _is_in(folder, name):
                digest = _own_sha256_of(folder / name)
                if digest in (listed.get(name), *noted.get(name, ())):
                    own[name] = digest
    return own


def _is_in(folder: Path, name: str) -> bool:
    """Return whether a name, which may come from elsewhere, is that of a file in a folder, or in
    one that is in it: not of one that a path or a link leads to.
    """
    path = folder / name
    return (
        ".." not in path.parts[len(folder.parts) :]
        and real(folder) in real(path.parent / "x").parents
    )


def check_unchanged(folder: Path, names: Iterable[str], own: Collection[str]) -> None:
    """Check that those of the files in a folder that are there are `own`: as the project has
    written them.

    Raises:
        InputError: one was changed since, or is the user's.
    """
    for name in names:
        if name not in own and os.path.lexists(folder / name):  # a link that leads nowhere, too
            remedy = "move it away, and it is made anew"
            raise InputError("is not as suave-des wrote it", file=folder / name, remedy=remedy)


def remove_results(folder: Path, names: Collection[str], own: Collection[str] = ()) -> None:
    """Remove the unfinished files of these names that a process left when it was killed, and the
    project's own files.

    Raises:
        InputError: one cannot be removed.
    """
    with _user_errors(folder):
        for final in (folder / name for name in names if _is_in(folder, name)):
            for part in final.parent.glob(f".{escape(final.name)}.*{_PART}"):
                part.unlink(missing_ok=True)
        for name in own:
            (folder / name).unlink(missing_ok=True)


def _utf8(text: str) -> bytes:
    """Encode text as UTF-8; a path's bytes that are no UTF-8 are written as escapes, which JSON
    reads back.
    """
    return text.encode(errors="backslashreplace")


def write_files(
    folder: Path, files: Mapping[str, FileContent | Listing], *, stale: Collection[str] = ()
) -> None:
    """Write files under temporary names, and rename them when all are complete.

    Args:
        files: content by name, in an existing folder; text is written as UTF-8, pieces of it one
            after the other. A listing is made from the SHA-256 of all others by their names, and is
            renamed first: what a kill leaves is then a part of what it lists, and nothing else.
        stale: names of files of an earlier use of the folder, removed when the new ones are
            complete, and before these are renamed.

    Raises:
        InputError: the disk is full, the folder cannot be written, or a file of that name is no
            regular one; nothing half-written stays.
    """
    finals = {name: folder / name for name in sorted(files, key=lambda name: callable(files[name]))}
    parts = {
        name: final.with_name(f".{final.name}.{os.getpid()}{_PART}")
        for name, final in finals.items()
    }
    hashes = dict[str, str]()
    try:
        with _user_errors(folder):
            for name, final in finals.items():
                if final.exists() and not final.is_file():
                    raise InputError("is not a regular file", file=final, remedy="remove it")
                content = files[name]
                written = content(hashes) if callable(content) else content
                hashes[name] = _write(parts[name], written)
            for name in stale:
                (folder / name).unlink(missing_ok=True)
            for name, final in reversed(finals.items()):
                parts[name].replace(final)
    finally:
        for part in parts.values():
            with suppress(OSError):  # what could not be written has been told of
                part.unlink(missing_ok=True)


def _write(path: Path, content: FileContent) -> str:
    """Write a new file, and return its SHA-256, in hex."""
    total = hashlib.sha256()
    path.unlink(missing_ok=True)
    with path.open("xb") as file:  # x: a link of that name is not followed
        for piece in [content] if isinstance(content, str | bytes) else content:
            encoded = piece if isinstance(piece, bytes) else _utf8(piece)
            total.update(encoded)
            file.write(encoded)
    return total.hexdigest()


def write_file(file: Path, content: str | bytes) -> None:
    """Write a file that the user named: links are followed, and what is no regular file, such as a
    pipe or standard output, is written into; a regular file is replaced when all is written.

    Raises:
        InputError: it cannot be written.
    """
    _check(file, (_is_circle(file), "is a link in a circle", "remove it"))
    with _user_errors(file.parent):
        if _is_written_into(file):
            with file.open("ab") as stream:
                stream.write(content if isinstance(content, bytes) else _utf8(content))
            return
        final = real(file)
    write_files(final.parent, {final.name: content})


def check_folder(folder: Path) -> None:
    """Raise an InputError if there is no folder of a name."""
    remedy = "give the folder that suave-des run or campaign wrote with --out"
    _check(
        folder,
        (_is_circle(folder), "is a link in a circle", remedy),
        (not folder.is_dir(), "no such folder", remedy),
    )


def _is_circle(file: Path) -> bool:
    try:
        file.stat()
    except OSError as error:
        return error.errno == errno.ELOOP
    return False


def _is_written_into(file: Path) -> bool:
    is_there = os.path.exists(file)  # noqa: PTH110 - Path.exists raises for a circle of links
    return is_there and (not file.is_file() or Path("/dev") in file.absolute().parents)


def listing_in(folder: Path) -> str:
    """Return the name of the file that lists a folder's results: a campaign's, if it has none."""
    with _user_errors(folder):
        has_mission = (folder / LISTINGS["mission"]).is_file()
    return LISTINGS["mission" if has_mission else "campaign"]


def check_beside(folder: Path, names: Iterable[str]) -> None:
    """Check that files can be made beside a folder's results, as check_unchanged does; of a folder
    that lists nothing, nothing is known.
    """
    listing = listing_in(folder)
    if (folder / listing).is_file():
        check_unchanged(folder, names, own_files(folder, listing))


def write_beside(folder: Path, files: Mapping[str, str]) -> None:
    """Write files that were made from a folder's results, and note them in its listing, if it has
    one, so that they go when the results are replaced; raises as write_files does.
    """
    listing = listing_in(folder)
    about = read_json(folder / listing) if (folder / listing).is_file() else None
    if not isinstance(about, dict) or not isinstance(about.get(LISTED), dict):
        write_files(folder, files)
        return

    def noted(hashes: Mapping[str, str]) -> str:
        return json_text({**about, LISTED: {**about[LISTED], **hashes}})

    own = own_files(folder, listing).keys() & files.keys()
    write_files(folder, {**files, listing: noted}, stale=own)


@contextmanager
def _user_errors(folder: Path) -> Iterator[None]:
    """Turn errors of the system into errors for the user."""
    try:
        yield
    except OSError as error:
        problem = f"the output folder cannot be written: {error.strerror}"
        remedy = "give a folder that is yours"
        if error.errno in NO_SPACE:
            remedy = "make room there, or give a folder on another disk"
        raise InputError(problem, file=folder, remedy=remedy) from None
