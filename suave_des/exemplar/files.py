"""The exemplar's own configuration files: parameters of nodes, and System Modes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from suave_des.errors import InputError, did_you_mean
from suave_des.exemplar.keys import (
    NODES,
    RUNNER,
    is_every_node,
    node_of,
    nodes_with,
)
from suave_des.scenario.modes import modes_of
from suave_des.scenario.yamlfile import Layer, read_yaml

PARAMETERS = "ros__parameters"
EVENTS = "thruster_events"
_BATCHES = ("run_batch", "suave_cli")
"""The exemplar's programs that run what a file of their own describes."""


@dataclass(frozen=True)
class Parameter:
    """A parameter in one of the user's files.

    Attributes:
        entry: the node as it is written in the file.
        node: as in the table of keys; empty if it is none of them.
    """

    document: Layer
    entry: str
    name: str
    value: Any
    node: str

    def line(self, *below: str | int) -> int:
        """The line of its value, or of a part of that."""
        return self.document.place((self.entry, PARAMETERS, self.name, *below)).line

    @property
    def keys(self) -> str:
        """Node and parameter, for the user."""
        return f"{self.entry.removeprefix('/')}.{self.name}"

    @property
    def place(self) -> str:
        """File, line, node and parameter, for the user."""
        return f"{self.document.path}: line {self.line()}, {self.keys}"

    def error(self, problem: str, remedy: str) -> InputError:
        """An error about it."""
        place = f"line {self.line()}, {self.keys}"
        return InputError(problem, file=self.document.path, place=place, remedy=remedy)

    @property
    def source(self) -> str:
        """File and line, for a comment."""
        return f"{self.document.path.name}, line {self.line()}"

    @property
    def rank(self) -> tuple[bool, bool]:
        """The runner's count before those of a mission, a node's own before those of every node."""
        return self.node != RUNNER, is_every_node(self.entry)

    @property
    def in_file(self) -> Any:
        """The value as it is in the file."""
        return self.document.data[self.entry][PARAMETERS][self.name]

    @property
    def entry_lines(self) -> list[int]:
        """Lines of the entries of a list."""
        return [self.line(index) for index in _full(self.in_file)]


@dataclass
class GivenFiles:
    """What is in the files.

    Attributes:
        parameters: of known nodes, file by file.
        modes: the System Modes file, if there is one.
    """

    documents: Sequence[Layer]
    parameters: list[Parameter] = field(default_factory=list)
    modes: Layer | None = None

    def telling(self, launches: Iterable[str]) -> set[str]:
        """Return the names that may tell the revision: nodes, node.parameters and packages."""
        found = {each.entry.removeprefix("/") for each in self.parameters}
        found |= {f"{each.node}.{each.name}" for each in self.parameters}
        return found | {word for each in launches for word in each.split()[2:3]}


def given_files(files: Sequence[Path | Layer], notes: list[str]) -> GivenFiles:
    """Read the files; notes about what is not known in them."""
    documents = [each if isinstance(each, Layer) else read_yaml(each) for each in files]
    given = GivenFiles(documents)
    for document in documents:
        if not _has_modes(document):
            given.parameters += _parameters(document, notes)
            continue
        modes_of(document)
        if given.modes is not None and given.modes.data != document.data:
            raise InputError(
                "there are two System Modes files", file=document.path, remedy="give one of them"
            )
        given.modes = given.modes or document
    return given


def _has_modes(document: Layer) -> bool:
    """Whether a file is a System Modes file."""
    contents = [each.get(PARAMETERS) for each in document.data.values() if isinstance(each, dict)]
    types = [each.get("type") for each in contents if isinstance(each, dict)]
    return "system" in types or "node" in types


def _parameters(document: Layer, notes: list[str]) -> list[Parameter]:
    """Return the parameters of known nodes in a file; notes about the rest.

    Raises:
        InputError: it is no configuration of nodes, or has none that is known.
    """
    contents = {entry: _content(document, entry) for entry in document.data}
    is_runners = any(
        node_of(entry, ()) == RUNNER or (is_every_node(entry) and "experiments" in content)
        for entry, content in contents.items()
    )
    found = list[Parameter]()
    for entry, content in contents.items():
        of_entry = list(_of_entry(document, entry, content, is_runners=is_runners))
        found += of_entry

        notes += _unread(document, entry, content, {each.name for each in of_entry})
    if not found and not any(map(node_of, contents, contents.values())):
        first = next(iter(document.data), "")
        remedy = did_you_mean(first.removeprefix("/"), NODES, "its nodes")
        raise document.error("has nothing of SUAVE in it", (first,), remedy)
    return found


def _unread(
    document: Layer, entry: str, given: Mapping[str, object], read: Collection[str]
) -> Iterator[str]:
    """Yield notes about what no node gets of an entry with these parameters."""
    place = f"{document.path}: line {document.place((entry,)).line}, {entry.removeprefix('/')}"
    if beside := [other for other in document.data[entry] if other != PARAMETERS]:
        yield f"{place}: not imported: {', '.join(beside)}: ROS 2 reads {PARAMETERS} alone"
    names = ", ".join(name for name in given if name not in read)
    if is_every_node(entry):
        if names:
            yield f"{place}: not imported: {names}: no node of this file has it"
    elif not node_of(entry, given):
        remedy = did_you_mean(entry.removeprefix("/"), NODES)
        yield f"{place}: not imported: {names}: the node is not known ({remedy})"


def _content(document: Layer, entry: str) -> dict[str, object]:
    """Return the parameters of a file's entry; an InputError if it is no node's."""
    content = document.data[entry]
    given = content.get(PARAMETERS, "") if isinstance(content, dict) else ""
    if given is None or isinstance(given, dict):
        return given or {}
    words = f"{document.path.name} {' '.join(document.data)}"
    batches = [each for each in _BATCHES if each in words]
    if batches or "experiments" in document.data:
        programs = " or ".join(batches or _BATCHES)
        problem = f"describes several experiments, for the exemplar's {programs}"
        remedy = (
            "give the mission and runner files that they use, those of one experiment at a time"
        )
        raise document.error(problem, (entry,), remedy)
    remedy = f"a configuration of the exemplar has NODE: {{{PARAMETERS}: {{KEY: VALUE}}}}"
    raise document.error(f"{entry} has no mapping {PARAMETERS}", (entry,), remedy)


def _of_entry(
    document: Layer, entry: str, given: Mapping[str, object], *, is_runners: bool
) -> Iterator[Parameter]:
    """Yield the parameters of an entry, each for every node that gets it.

    What is given to every node of a mission's file is not given to the runner, which another file
    configures.
    """
    for name, in_file in given.items():
        value = _compact(in_file) if name == EVENTS else in_file
        if is_every_node(entry):
            nodes = [node for node in nodes_with(name) if is_runners or node != RUNNER]
        else:
            nodes = [node for node in (node_of(entry, given),) if node]
        for node in nodes:
            yield Parameter(document, entry, name, value, node)


def _compact(events: object) -> object:
    """Return thruster events without spaces, and without empty ones, as ROS 2 writes an empty
    list.
    """
    if not isinstance(events, list):
        return events
    full = [events[index] for index in _full(events)]
    return ["".join(each.split()) if isinstance(each, str) else each for each in full]


def _full(entries: object) -> list[int]:
    """Return the indices of a list's entries that are not empty texts."""
    if not isinstance(entries, list):
        return []
    return [
        index
        for index, each in enumerate(entries)
        if not isinstance(each, str) or each.strip() != ""
    ]
