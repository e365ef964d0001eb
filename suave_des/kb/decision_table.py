"""Decision tables: on the left of each row measured values, reports of components and designs in
use, on the right designs; as `kb policy --csv` writes them.

A file may begin with lines of YAML, each after a `#`: the settings. Form: docs/guides/managers.md.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property, lru_cache
from itertools import chain, product, takewhile
from math import isfinite, prod
from pathlib import Path
from typing import Literal, NamedTuple

from suave_des.domain import THRUSTER_NAMES
from suave_des.errors import InputError, did_you_mean, line_error, located, shown
from suave_des.files import decode, read_bytes
from suave_des.kb.reports import Reports
from suave_des.kb.scale import Scale, TestedRegion, parse_region
from suave_des.kb.situations import INCONSISTENT, Outcome, Situation
from suave_des.kb.space import PolicySpace, present
from suave_des.kb.states import LASTING
from suave_des.knowledge.reasoner import Regions
from suave_des.knowledge.state import (
    NO_GROUNDING,
    NONE_LEFT,
    STAYS,
    Decision,
    Inference,
    KnowledgeState,
    Plan,
    Reasoning,
    exact,
    grounding_name,
    objective_name,
)
from suave_des.monitor.diagnostics import HULL
from suave_des.resources import find, shipped_folder
from suave_des.scenario.models import DelayDistribution, Period, Strict
from suave_des.scenario.yamlfile import Layer, parse_yaml, validated

_NOW, _THEN, _COMPONENTS, _AGAIN = "_now", "_then", "components", "again"
_ANY = "any"
_NO_RESULT = ("states", "statuses", "marks", "problem")
"""Columns of a policy that decide nothing."""
_LIMIT_BYTES = 100_000_000
_MOST_CELLS = 2_000_000
_MEASURED: TestedRegion = ((">", Decimal("-Infinity")),)
SHIPPED = "scenarios/managers"
"""Kind of file of the shipped tables."""


class TableSettings(Strict):
    """The settings at the beginning of a table."""

    trigger: Literal["period", "event"] = "period"
    """When it decides: in periods, or when a task, component or measured value changes."""
    period_s: Period | None = None
    """Time between decisions; by default managers.metacontrol.reasoning_period_s."""
    latency_s: DelayDistribution = 0.0
    """Time from a decision to its requests; by default latencies.inference_s."""
    order: tuple[str, ...] = ()
    """Functions in the order of their requests; the others follow by name."""
    functions_at_a_time: int | None = None
    """How many functions a decision changes; the others wait for the next one."""
    interchangeable: tuple[tuple[str, ...], ...] = (THRUSTER_NAMES,)
    """Groups of components of which only the number with each status counts."""
    forgets_recovered: bool = True
    """Whether a component that has recovered counts as one that never failed after the decision."""
    as_metacontrol: bool = True
    """Whether tasks and reports reach it as they reach metacontrol in the scenario's revision, and
    its period begins like metacontrol's; else it has them at once, and any phase.
    """


class _Rule(NamedTuple):
    """What a row says of one function: `others` are the designs of other functions that it asks
    for.
    """

    others: Mapping[str, str]
    then: str
    line: int


#: What components report, and the design in use, "" where there is no objective; None: any.
_Asked = tuple[Reports | None, str | None]


#: What is decided at some places of measured values: by what is asked, rules that differ in other
# functions' designs.
_Cell = dict[_Asked, list[_Rule]]
#: By function and places.
_Cells = dict[str, dict[tuple[int, ...], _Cell]]


class _Row(NamedTuple):
    line: int
    regions: tuple[tuple[TestedRegion, ...], ...]
    """Of each attribute; empty: whatever it is."""
    reports: Reports | None
    now: Mapping[str, str]
    then: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class DecisionTable:
    """A decision table, with which metacontrol's loop can work in place of a reasoner.

    Attributes:
        attributes: quality attributes with the places of their values.
        counts_reports: whether a decision can depend on what components report.
        components: the statuses of those in rows, each with a line; the first of a group for all.
        designs: that are in a row, with its line, by function.
    """

    path: Path
    settings: TableSettings
    attributes: Mapping[str, Scale]
    counts_reports: bool
    components: Mapping[str, Mapping[str, int]]
    designs: Mapping[str, Mapping[str, int]]
    _cells: _Cells

    def reports(self, components: Iterable[tuple[str, str]]) -> Reports:
        """What components report, with the first of each group in the place of any other."""
        return _representatives(self.settings.interchangeable, components)

    def related(self, function: str) -> tuple[str, ...]:
        """Functions on whose designs a function's decisions depend: itself, and maybe others."""
        cells = self._cells.get(function, {}).values()
        rules = chain.from_iterable(cell.values() for cell in cells)
        others = set[str]().union(*(rule.others for rule in chain.from_iterable(rules)))
        return function, *sorted(others - {function})

    def rule(self, function: str, state: KnowledgeState) -> tuple[str, int]:
        """What happens to a function's design in a state, with the line that says so.

        Raises:
            InputError: no row says so.
        """
        if function not in self._cells:
            remedy = f"add a column {function}{_THEN}"
            raise InputError(f"no row decides {function}", file=self.path, remedy=remedy)
        measured = dict(state.measurements)
        places = [scale.place(measured.get(name)) for name, scale in self.attributes.items()]
        found = self._found(function, state, places)
        if found is None:
            raise self._undecided(function, state, places)
        return found.then, found.line

    def _undecided(self, function: str, state: KnowledgeState, places: Sequence[int]) -> InputError:
        """Make the error for a state in which no row decides a function."""
        values = zip(self.attributes.items(), places, strict=True)
        words = [f"{name} {scale.text(place)}" for (name, scale), place in values]
        reports = "; ".join(f"{name}={status}" for name, status in self.reports(state.components))
        words += [f"components {reports or 'without a report'}"] if self.counts_reports else []
        nows = (
            f"{name} now {present(state, name) or '(not needed)'}"
            for name in self.related(function)
        )
        beside = sorted(self._beside(function, state, places))
        return InputError(
            f"no row decides {function} where {', '.join([*nows, *words])}",
            file=self.path,
            place=f"beside line {' and '.join(map(str, beside[:2]))}" if beside else None,
            remedy="add one, or let another cover this; kb policy --max-failed 6 writes all rows,"
            " if they are not too many",
        )

    def _found(self, function: str, state: KnowledgeState, places: Sequence[int]) -> _Rule | None:
        cell = self._cells[function].get(tuple(places), {})
        reports = self.reports(state.components)
        wider = product((reports, None), (present(state, function), None))
        found = [cell[asked] for asked in wider if asked in cell]
        for rule in chain.from_iterable(found):
            if all(present(state, name) == design for name, design in rule.others.items()):
                return rule
        return next((rules[0] for rules in found if self._are_alike(function, rules)), None)

    def _are_alike(self, function: str, rules: Sequence[_Rule]) -> bool:
        """Return whether rules decide alike for every design of the other functions that they ask
        for.

        kb policy lists no state before a task, nor those with several functions besides the lasting
        ones: there, too, what they decide alike holds.
        """
        if len({rule.then for rule in rules}) > 1:
            return False
        needed = set()
        for rule in rules:
            needed.add(frozenset((name, now) for name, now in rule.others.items() if now))
        counts = Counter(frozenset(dict(designs)) for designs in needed)
        never = set[str]().union(*(rule.others for rule in rules)).difference(*counts)
        if never and not never.union([function]).isdisjoint(LASTING):
            return False
        return all(number == self._choices(names) for names, number in counts.items())

    def _choices(self, functions: Iterable[str]) -> int:
        """Count the combinations of designs of functions, or none, that are in rows."""
        return prod(1 + len(self.designs.get(name, ())) for name in functions)

    def _beside(self, function: str, state: KnowledgeState, places: Sequence[int]) -> Iterator[int]:
        """Lines that decide in the ranges next to a place."""
        for number, step in product(range(len(places)), (-1, 1)):
            other = list(places)
            other[number] += step
            if (found := self._found(function, state, other)) is not None:
                yield found.line

    # As metacontrol's loop asks a reasoner.

    def analyze(self, state: KnowledgeState) -> Inference:
        """Infer nothing."""
        objectives = {name: objective_name(name) for name, *_ in state.objectives}
        groundings = {design: grounding_name(design) for _, design in state.groundings}
        return Inference(state, lambda _: frozenset(), frozenset(), objectives, groundings)

    def plan(self, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
        """Look the decisions up: as many as are made at a time.

        As in metacontrol, the state at the beginning says which functions are adapted, and the
        values that are measured by now say to what.
        """
        decisions = []
        changes = 0
        for decision in self._decisions_by_now(inference):
            if decision.design not in (None, inference.state.grounded(decision.function)):
                changes += 1
                if changes > (self.settings.functions_at_a_time or changes):
                    continue
            decisions.append(decision)
        return Plan(tuple(decisions))

    def outcome(self, situation: Situation) -> Outcome:
        """All that is decided in a situation."""
        decisions = tuple(self._decisions(situation.state))
        return Outcome(Reasoning(self.analyze(situation.state), Plan(decisions)))

    def _decisions_by_now(self, inference: Inference) -> list[Decision]:
        decisions = list(self._decisions(inference.state))
        state = inference.state
        if state.measured_since is None or not self.settings.as_metacontrol:
            return decisions
        adapted = {each.function for each in decisions}
        now = replace(state, measurements=state.measured_since)
        return [each for each in self._decisions(now) if each.function in adapted]

    def _decisions(self, state: KnowledgeState) -> Iterator[Decision]:
        order = {name: place for place, name in enumerate(self.settings.order)}
        asked = [each.function for each in state.objectives]
        for function in sorted(asked, key=lambda name: (order.get(name, len(order)), name)):
            then, line = self.rule(function, state)
            if then != STAYS:
                design = None if then == NONE_LEFT else then
                yield Decision(function, design, f"line {line} of {self.path.name}")

    @cached_property
    def _regions(self) -> Regions:
        numbers = {number for scale in self.attributes.values() for number in scale.numbers}
        return Regions(tuple(sorted(numbers)), ())

    @property
    def thresholds(self) -> tuple[float, ...]:
        """The numbers with which measured values are compared."""
        return self._regions.bounds[1:-1]

    def distinguished(self, measured: Collection[float]) -> tuple[object, ...]:
        """What can be distinguished in measured values."""
        if not all(map(isfinite, measured)):
            return tuple(measured)
        return tuple(map(self._regions.around, measured))

    @property
    def expected_attributes(self) -> frozenset[str]:
        """The quality attributes that it asks for."""
        return frozenset(self.attributes)

    @property
    def space(self) -> PolicySpace:
        """What it tells apart, for a comparison with others."""
        named = self.components.keys()
        groups = [each for each in self.settings.interchangeable if set(each) & named]
        alone = sorted(set(named).difference(*groups))
        statuses = set(chain.from_iterable(self.components.values()))
        return PolicySpace(
            tuple(sorted(self.attributes)),
            self._regions.thresholds,
            (*groups, *((name,) for name in alone)),
            tuple(sorted(statuses)),
            tuple(sorted(self._cells)),
        )


def _representatives(
    groups: Iterable[Sequence[str]], components: Iterable[tuple[str, str]]
) -> Reports:
    reported = dict(components)
    found = dict[str, str]()
    for group in groups:
        statuses = sorted(reported.pop(name) for name in group if name in reported)
        found |= dict(zip(group, statuses, strict=False))
    return tuple(sorted((found | reported).items()))


# Reading.


def manager_of(name: Path) -> str | None:
    """The manager that decides by the table of a name, which is a CSV file or shipped; None: it is
    something else.
    """
    if name.suffix == ".csv":
        return f"table:{name}"
    is_shipped = (shipped_folder(SHIPPED) / f"{name}.csv").is_file() and not name.exists()
    return str(name) if is_shipped else None


def find_table(name: str | Path) -> DecisionTable:
    """Read the table of a file, or a shipped one; raises as find and read_table do."""
    return read_table(find(name, SHIPPED))


def read_table(path: Path, changes: Mapping[str, object] | None = None) -> DecisionTable:
    """Read a table, with some of its settings changed.

    Raises:
        InputError: with the line: the file is no table, or two of its rows decide one state
            differently.
    """
    text = decode(path, read_bytes(path, _LIMIT_BYTES))
    lines = text.splitlines(keepends=True)
    head = list(takewhile(lambda line: line.startswith("#") or not line.strip(), lines))
    layer = _layer(path, head)
    layer.data.update(changes or {})
    settings = validated(layer, TableSettings)
    header, rows = _content(path, lines[len(head) :], len(head))
    read = [
        _row(path, line, dict(zip(header, cells, strict=True)), settings) for line, cells in rows
    ]
    if not read:
        remedy = "write a row for each region, as suave-des kb policy --csv does"
        raise line_error(path, len(head) + 1, "has no rows below its header", remedy)
    scales = _scales(header, read)
    components = _lines((*each, row.line) for row in read for each in row.reports or ())
    _check_settings(layer, settings, header, components)
    cells = _cells(path, read, list(scales.values()))
    _check_overlaps(path, cells)
    return DecisionTable(
        path,
        settings,
        scales,
        any(row.reports is not None for row in read),
        components,
        _designs(read),
        cells,
    )


def _scales(header: Iterable[str], rows: Sequence[_Row]) -> dict[str, Scale]:
    """The places of each attribute: between and at the numbers of its column."""
    found = {}
    for number, name in enumerate(_attributes(header)):
        regions = chain.from_iterable(row.regions[number] for row in rows)
        ends = {end for _, end in chain.from_iterable(regions)}
        found[name] = Scale(tuple(sorted(filter(Decimal.is_finite, ends))))
    return found


def _layer(path: Path, head: Sequence[str]) -> Layer:
    text = "".join(line.removeprefix("#").removeprefix(" ") for line in head)
    if all(line.startswith("#") or not line.strip() for line in text.splitlines()):
        text = "{}"
    try:
        return parse_yaml(text, path)
    except InputError as error:
        remedy = (
            "lines that begin with # are settings, such as # latency_s: 0.2; a note is # # note"
        )
        raise InputError(error.problem, file=path, place=error.place, remedy=remedy) from None


def _check_settings(
    layer: Layer, settings: TableSettings, header: Iterable[str], components: Iterable[str]
) -> None:
    functions = _deciding(header)
    for number, name in enumerate(settings.order):
        if name not in functions:
            problem = f"no column decides a function {shown(name)}"
            raise layer.error(problem, ("order", number), did_you_mean(name, functions))
    if settings.functions_at_a_time is not None and settings.functions_at_a_time < 1:
        problem = f"{settings.functions_at_a_time} functions cannot change"
        raise layer.error(
            problem, ("functions_at_a_time",), "write 1 or more; leave it out for all of them"
        )
    known = [*THRUSTER_NAMES, HULL, *components]
    groups = settings.interchangeable
    for name in (members := list(chain.from_iterable(groups))):
        place = ("interchangeable",)
        if name not in known:
            problem = f"there is no component {shown(name)}"
            raise layer.error(problem, place, did_you_mean(name, known))
        if members.count(name) > 1:
            problem = f"{shown(name)} is there twice"
            raise layer.error(problem, place, "name each component once")


def _content(
    path: Path, lines: Sequence[str], above: int
) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The header, and the rows with their lines."""
    reader = csv.reader(lines, strict=True)
    try:
        header = [name.strip() for name in next(reader, [])]
        rows = [(above + reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        remedy = "write cells with commas between them"
        raise line_error(
            path, above + reader.line_num, f"is not valid CSV: {error}", remedy
        ) from None
    _check_header(path, above + 1, header)
    for line, row in rows:
        if len(row) != len(header):
            problem = f"has {len(row)} cells, but there are {len(header)} columns"
            raise line_error(path, line, problem, "write a cell, if only an empty one, for each")
    return header, rows


def _check_header(path: Path, line: int, header: Sequence[str]) -> None:
    if len(header) == 1 and any(sign in header[0] for sign in ";\t"):
        raise line_error(path, line, "the header has one column", "write commas between the cells")
    for name in header:
        if header.count(name) > 1 or not name:
            problem = f"the column {shown(name)} is there twice" if name else "a column has no name"
            raise line_error(path, line, problem, "give each column a name of its own")
    if not _deciding(header):
        problem = "no column says what is decided"
        raise line_error(path, line, problem, f"add one such as f_maintain_motion{_THEN}")


def _attributes(header: Iterable[str]) -> list[str]:
    others = (_COMPONENTS, _AGAIN, *_NO_RESULT)
    return [name for name in header if name not in others and not name.endswith((_NOW, _THEN))]


def _deciding(header: Iterable[str]) -> list[str]:
    """Functions that columns decide."""
    return [name.removesuffix(_THEN) for name in header if name.endswith(_THEN)]


def _check_decisions(path: Path, line: int, then: Mapping[str, str]) -> None:
    """Check that a row decides something."""
    if not then:
        remedy = f"write a design, {STAYS} or {shown(NONE_LEFT)} in a column that ends in {_THEN}"
        raise line_error(path, line, "decides nothing", remedy)
    for function, design in then.items():
        if design in (INCONSISTENT, NO_GROUNDING):
            problem = f"{function}: {shown(design)} is no decision"
            raise line_error(path, line, problem, f"write a design, {STAYS} or {shown(NONE_LEFT)}")


def _row(path: Path, line: int, cells: Mapping[str, str], settings: TableSettings) -> _Row:
    def by_function(ending: str) -> dict[str, str]:
        found = {name: cell.strip() for name, cell in cells.items() if name.endswith(ending)}
        return {name.removesuffix(ending): cell for name, cell in found.items() if cell != _ANY}

    regions = []
    for name in _attributes(cells):
        with located(file=path, place=f"line {line}, {name}"):
            regions.append(_parts(cells[name].strip()))
    then = {name: design for name, design in by_function(_THEN).items() if design}
    _check_decisions(path, line, then)
    reports = _reports(path, line, cells.get(_COMPONENTS, _ANY), settings)
    now = by_function(_NOW)
    functions = _deciding(cells)
    for function in filter(None, map(str.strip, cells.get(_AGAIN, "").split(";"))):
        if function not in functions:
            problem = f"{_AGAIN}: no column decides a function {shown(function)}"
            raise line_error(path, line, problem, did_you_mean(function, functions))
        if then.get(function) == STAYS:
            then[function] = now.get(function, STAYS)
    return _Row(line, tuple(regions), reports, now, then)


@lru_cache(maxsize=4096)  # a table has the same few thousands of times
def _parts(text: str) -> tuple[TestedRegion, ...]:
    """Read the regions in a cell, such as "not measured or < 1.25"; none: whatever it is."""
    found = []
    for part in filter(None, text.split(" or ")):
        region = _MEASURED if part == _ANY else parse_region(part)
        if region is None:
            number = exact(part)
            region = ((">=", number), ("<=", number))
        found.append(region)
    return tuple(found)


def _reports(path: Path, line: int, text: str, settings: TableSettings) -> Reports | None:
    if text.strip() == _ANY:
        return None
    pairs = [part.partition("=") for part in filter(None, map(str.strip, text.split(";")))]
    for name, sign, status in pairs:
        if not (name and sign and status):
            remedy = (
                "write for instance c_thruster_1=FALSE; c_thruster_2=RECOVERED, any, or nothing"
            )
            raise line_error(path, line, f"components: {shown(text)} is no report", remedy)
    reported = [(name.strip(), status.strip()) for name, _, status in pairs]
    return _representatives(settings.interchangeable, reported)


def _designs(rows: Iterable[_Row]) -> dict[str, dict[str, int]]:
    return _lines(
        (function, design, row.line)
        for row in rows
        for function, design in (*row.then.items(), *row.now.items())
        if design not in ("", STAYS, NONE_LEFT, NO_GROUNDING)
    )


def _lines(named: Iterable[tuple[str, str, int]]) -> dict[str, dict[str, int]]:
    """The first line of each pair of names."""
    found: dict[str, dict[str, int]] = {}
    for one, other, line in named:
        found.setdefault(one, {}).setdefault(other, line)
    return found


def _cells(path: Path, rows: Iterable[_Row], scales: Sequence[Scale]) -> _Cells:
    found: _Cells = {}
    number = 0
    for row in rows:
        inside = [_places(*each) for each in zip(row.regions, scales, strict=True)]
        for places, (function, then) in product(product(*inside), row.then.items()):
            number += 1
            if number > _MOST_CELLS:
                remedy = "compare measured values with fewer numbers"
                raise line_error(path, row.line, f"more than {_MOST_CELLS:,} cells", remedy)
            others = {name: now for name, now in row.now.items() if name != function}
            cell = found.setdefault(function, {}).setdefault(places, {})
            asked = row.reports, row.now.get(function)
            cell.setdefault(asked, []).append(_Rule(others, then, row.line))
    return found


@lru_cache(maxsize=4096)
def _places(regions: Sequence[TestedRegion], scale: Scale) -> Sequence[int]:
    return scale.places_in(*regions) if regions else range(len(scale))


def _check_overlaps(path: Path, cells: _Cells) -> None:
    """Check that no two rows decide one state differently."""
    for function, places in cells.items():
        for cell in places.values():
            for rule, other in _contradicting(cell):
                first, second = sorted((rule, other), key=lambda each: each.line)
                both = f"{second.then} here, and {first.then} in line {first.line}"
                remedy = (
                    "let them ask for different states; the setting interchangeable says which"
                    " components count alike"
                )
                raise line_error(path, second.line, f"{function}: {both}, for one state", remedy)


def _contradicting(cell: _Cell) -> Iterator[tuple[_Rule, _Rule]]:
    """Pairs of rules that decide a state that they have in common differently."""
    for one, rules in cell.items():
        reports, now = one
        # in an order that does not depend on hashes, as the first contradiction is told
        wider = dict.fromkeys(product((reports, None), (now, None)))
        if None in one:  # (any, design) and (reports, any) have states in common, too
            wider |= dict.fromkeys(each for each in cell if _agree(one, each))
        for rule, other in product(
            rules, chain.from_iterable(cell.get(each, ()) for each in wider)
        ):
            if rule.then != other.then and all(
                other.others.get(name, now) == now for name, now in rule.others.items()
            ):
                yield rule, other


def _agree(one: _Asked, other: _Asked) -> bool:
    return all(a is None or b is None or a == b for a, b in zip(one, other, strict=True))
