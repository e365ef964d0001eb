"""Errors for the user: each names the place, the problem, and the remedy; and findings, which are
told, not raised.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path

MISTAKES_LOGGER = "suave_des.mistakes"
"""Name of the logger for mistakes in rules and ontologies that stop nothing."""
_PLACE_LIMIT = 200


class SuaveDesError(Exception):
    """Base of every error that the command line prints as one line, without a traceback.

    Example:
        try:
            run_campaign("mine.yaml", "mine:Manager", runs=100)
        except SuaveDesError as error:
            sys.exit(str(error))
    """


class InputError(SuaveDesError):
    """An invalid input from the user; the command line ends with exit status 2.

    Args:
        problem: what is wrong, with the offending value.
        file: that contains it, if there is one.
        place: where in the file: "line 12", a key path such as "signals.water_visibility.period_s",
            or both.
        remedy: how to correct it.

    Example:
        try:
            loaded = load_scenario("mine.yaml")
        except InputError as error:
            print(error.file, error.place, error.problem, error.remedy)
    """

    def __init__(
        self,
        problem: str,
        *,
        file: Path | str | None = None,
        place: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = None if file is None else str(file)
        self.place = place
        self.remedy = remedy
        where = ": ".join(shorter(part, _PLACE_LIMIT) for part in (self.file, place) if part)
        message = f"{where}: {problem}" if where else problem
        super().__init__(f"{message} ({remedy})" if remedy else message)

    def __reduce__(self) -> tuple[object, ...]:
        """Preserve all parts when pickled between processes."""
        parts = {"file": self.file, "place": self.place, "remedy": self.remedy}
        return partial(type(self), self.problem, **parts), ()


class KnowledgeError(InputError):
    """An ontology, a rule or a state of the knowledge base that cannot be reasoned with."""


class MissionError(SuaveDesError):
    """A mission that could not be finished: names the manager, the run and the mission time.

    Example:
        try:
            mission = run_mission("seams2023", "mine:Manager", run=1, seed=8)
        except MissionError as error:
            print(error.run, error.time_s, error.cause)
    """

    def __init__(self, manager: str, run: int, time_s: float, cause: str) -> None:
        self.manager = manager
        self.run = run
        self.time_s = time_s
        self.cause = cause
        # With all parts as arguments the error survives SimPy, which copies what a process raised
        # by calling its class with them, and the trip from a worker process to its parent.
        super().__init__(manager, run, time_s, cause)

    def __str__(self) -> str:
        """The one line that the user sees."""
        return f"manager {self.manager}, run {self.run}, mission time {self.time_s:.2f} s: {self.cause}"


class PassingError(SuaveDesError):
    """Base of errors that may not happen again, such as of a machine that is busy."""


def may_pass(error: BaseException | None) -> bool:
    """Return whether an error may not happen again, because of what caused it."""
    while error is not None:
        if isinstance(error, PassingError):
            return True
        error = error.__cause__
    return False


class MissionTimeOut(BaseException):
    """A mission took too long; not an Exception, so that a manager that catches those does not
    catch this.

    Attributes:
        time_s: mission time that was reached; None where that is not known.
    """

    time_s: float | None = None


KeyPath = tuple[str | int, ...]


def line_error(file: Path, line: int, problem: str, remedy: str | None = None) -> InputError:
    """Make the error for a line of a file."""
    return InputError(problem, file=file, place=f"line {line}", remedy=remedy)


@contextmanager
def located(
    before: str = "", file: Path | str | None = None, place: str | None = None
) -> Iterator[None]:
    """Give errors of the block a file or a place, in place of their own, and begin their problems
    with a text.
    """
    try:
        yield
    except InputError as error:
        raise InputError(
            f"{before}{error.problem}", file=file, place=place, remedy=error.remedy
        ) from None


_WRITTEN = {
    "None": "nothing",
    "True": "true",
    "False": "false",
    "inf": ".inf",
    "-inf": "-.inf",
    "nan": ".nan",
}


def shown(value: object, limit: int = 60) -> str:
    """Write a value as the user did, cut to a readable length and one line."""
    return shorter(_WRITTEN.get(repr(value), repr(value)), limit)


def shorter(text: str, limit: int) -> str:
    """Cut a text to a length."""
    return text if len(text) <= limit else text[: limit - 3] + "..."


def number_of(number: int, noun: str) -> str:
    """Write a number with its noun: "1 mission", "2 missions"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def with_article(noun: str) -> str:
    """Write a noun or the name of a class with its article: "an Objective", "a data property"."""
    return f"{'an' if noun[0] in 'aeioAEIO' else 'a'} {noun}"


def similar(word: object, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Find the known name that is most similar to a word, from `cutoff` on (1: the same); None if
    none is.
    """
    found = difflib.get_close_matches(str(word), sorted(known), n=1, cutoff=cutoff)
    return found[0] if found else None


def nearest(word: object, known: Iterable[str]) -> str | None:
    """Suggest the known name most similar to a word, as a question; None when none is similar."""
    near = similar(word, known)
    return f"did you mean {near}?" if near else None


def did_you_mean(word: object, known: Iterable[str], what: str = "known") -> str:
    """Return the remedy for a misspelt word: the nearest known one, and the list of all."""
    names = list(known)
    listing = f"{what}: {', '.join(names) or 'none'}"
    near = similar(word, names)
    return f"did you mean {near!r}? {listing}" if near else listing


def unknown(
    problem: str, word: object, known: Iterable[str], what: str = "known", place: str = ""
) -> InputError:
    """Make the error for a misspelt word; its remedy is that of did_you_mean."""
    return InputError(problem, place=place or None, remedy=did_you_mean(word, known, what))


# What checks of rules, ontologies and scenarios find.


class Level(StrEnum):
    """Severity: an ERROR does not work as written, a WARN probably does not, a NOTE is worth
    knowing.
    """

    ERROR = "ERROR"
    WARN = "WARN"
    NOTE = "NOTE"


_SEVERITY = {level: number for number, level in enumerate(Level)}
_NOUNS = {Level.ERROR: "error", Level.WARN: "warning", Level.NOTE: "note"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

    Attributes:
        rule: name of the rule, if it is about one.
        column: in the line, for rules as text.
    """

    level: Level
    message: str
    file: str | None = None
    line: int | None = None
    rule: str | None = None
    column: int | None = None
    remedy: str | None = None

    @classmethod
    def of(cls, error: InputError) -> Finding:
        """Make a finding of an error, with the parts of its place."""
        patterns = r"line (\d+)", r"column (\d+)", r"^rule (.*)"
        found = (re.search(pattern, error.place or "") for pattern in patterns)
        line, column, rule = (match[1] if match else None for match in found)
        line_number, column_number = (int(number) if number else None for number in (line, column))
        return cls(
            Level.ERROR, error.problem, error.file, line_number, rule, column_number, error.remedy
        )

    @property
    def where(self) -> str:
        """File, line, rule and column, as far as they are known."""
        parts = (("line", self.line), ("rule", self.rule), ("column", self.column))
        place = ", ".join(f"{word} {value}" for word, value in parts if value)
        return ": ".join(filter(None, (self.file, place)))

    def __str__(self) -> str:
        """As one line of text."""
        line = ": ".join(filter(None, (self.where, self.message)))
        return f"{self.level:<5}  {line}" + (f" ({self.remedy})" if self.remedy else "")


def ordered(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sort findings by severity, the worst first, then by place; drop duplicates, and shorten
    paths.
    """

    def key(one: Finding) -> tuple[object, ...]:
        return (
            _SEVERITY[one.level],
            one.file or "",
            one.line or 0,
            one.rule or "",
            one.column or 0,
            str(one),
        )

    shortened = (
        replace(one, file=relative_path(one.file) if one.file else None) for one in findings
    )
    return tuple(sorted(dict.fromkeys(shortened), key=key))


def has_level(findings: Iterable[Finding], least: Level) -> bool:
    """Whether one of the findings has at least that severity."""
    return any(_SEVERITY[one.level] <= _SEVERITY[least] for one in findings)


def summary(findings: Sequence[Finding]) -> str:
    """Count the findings of each level: "1 error, 0 warnings, 14 notes"."""
    counts = Counter(one.level for one in findings)
    return ", ".join(number_of(counts[level], noun) for level, noun in _NOUNS.items())


def relative_path(path: Path | str) -> str:
    """A path, relative to the current folder if it is in it."""
    whole = Path(path)
    if whole.is_absolute() and whole.is_relative_to(Path.cwd()):
        return str(whole.relative_to(Path.cwd()))
    return str(path)
