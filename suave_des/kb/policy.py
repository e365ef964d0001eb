"""The policy: the decision in every state, over ranges of measured values, component reports and groundings."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain
from typing import Final, NamedTuple

from suave_des.errors import InputError, KnowledgeError
from suave_des.kb.situations import INCONSISTENT, Decide, Outcome, Situation
from suave_des.kb.space import (
    ComponentReports,
    Dependence,
    PolicySpace,
    ValueRange,
    component_reports,
    measured_attributes,
    ranges_between,
    rules_that_compute,
    values_in,
)
from suave_des.kb.states import LASTING, ManagingSettings
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import NO_GROUNDING, NONE_LEFT, KnowledgeState, ObjectiveState

#: Beyond this many kinds of states a policy is refused: at a millisecond and a half each it would take ten minutes.
LARGEST: Final = 400_000
FLIP_FLOP: Final = "flip-flop"
OnCount = Callable[[int, int], object]


@dataclass(frozen=True, slots=True)
class PolicyCase:
    """One kind of state, and what is decided in it.

    Attributes:
        ranges: of each attribute's measured value, in the policy's order.
        state: one state of this kind.
        reports: what the components report.
        asked: functions that have an objective.
        outcome: what follows and is decided; None as long as that is not known.
        flipping: functions whose grounding flips back and forth.
    """

    ranges: tuple[ValueRange, ...]
    state: KnowledgeState
    reports: ComponentReports
    asked: tuple[str, ...]
    outcome: Outcome | None = None
    flipping: tuple[str, ...] = ()

    @property
    def decided(self) -> Outcome:
        """What follows and is decided."""
        assert self.outcome is not None
        return self.outcome

    @property
    def marks(self) -> tuple[str, ...]:
        """Any of "inconsistent", "none left", "flip-flop"."""
        reasoning = self.decided.reasoning
        if reasoning is None:
            return (INCONSISTENT,)
        return (NONE_LEFT,) * bool(reasoning.plan.without_design) + (FLIP_FLOP,) * bool(self.flipping)

    def choice(self, function: str) -> str:
        """What happens to a function's grounding, and whether the choice flips back and forth."""
        return self.decided.choice(function) + (f" ({FLIP_FLOP})" if function in self.flipping else "")

    def present(self, function: str) -> str:
        """The design that a function has in this state, "ungrounded" or "no objective"."""
        if function not in self.asked:
            return "no objective"
        return self.state.grounded(function) or NO_GROUNDING


@dataclass(frozen=True)
class Policy:
    """The whole decision table.

    Attributes:
        attributes: quality attributes whose measured values have an effect.
        ranges: of each attribute, ascending.
        cases: one for each kind of state, in a fixed order.
        alike: groups of interchangeable components.
        without_effect: measured attributes that no rule and no design refers to.
        computing: rules that compute with numbers; if there are any, the ranges are samples and prove nothing.
        max_failed: maximum number of components that report a status.
    """

    attributes: tuple[str, ...]
    ranges: Mapping[str, tuple[ValueRange, ...]]
    cases: tuple[PolicyCase, ...] = field(repr=False)
    alike: tuple[tuple[str, ...], ...]
    without_effect: tuple[str, ...]
    computing: tuple[str, ...]
    max_failed: int

    @cached_property
    def states(self) -> int:
        """Number of states covered; interchangeable components count one by one, each range once."""
        return sum(case.reports.combinations for case in self.cases)

    @property
    def marks(self) -> dict[str, int]:
        """Number of states with each mark."""
        marks = (INCONSISTENT, NONE_LEFT, FLIP_FLOP)
        return {mark: sum(case.reports.combinations for case in self.marked(mark)) for mark in marks}

    def marked(self, mark: str) -> tuple[PolicyCase, ...]:
        """Cases with a mark."""
        return tuple(case for case in self.cases if mark in case.marks)

    @cached_property
    def functions(self) -> tuple[str, ...]:
        """Functions that have an objective in a state."""
        return tuple(sorted({function for case in self.cases for function in case.asked}))


def make_policy(
    base: Ontology,
    settings: ManagingSettings,
    decide: Decide[Situation],
    max_failed: int,
    space: PolicySpace | None = None,
    on_count: OnCount = lambda done, total: None,
) -> Policy:
    """Decide every kind of state; those that differ in nothing on which a decision can depend, once.

    Args:
        base: the ontologies and rules.
        settings: measured attributes, and behaviour of the managing subsystem that is not in the rules.
        decide: concludes what follows and is decided in a situation.
        max_failed: maximum number of components that report a status.
        space: what to tell apart; None: what can have an effect.
        on_count: called with the number of kinds of states that have been inferred so far, first 0, and how many have
            to be.

    Raises:
        InputError: max_failed is negative, or there would be too many states.
        KnowledgeError: there is nothing to decide, or the reasoner takes too long.
    """
    if max_failed < 0:
        raise InputError(f"{max_failed} components cannot fail", remedy="give 0 or more")
    if not any(map(base.designs, base.functions)):
        raise KnowledgeError(
            "no function has a function design, so there is nothing to decide",
            file=", ".join(map(str, base.files)),
            remedy="give an ontology that uses TOMASys as suave.owl does",
        )
    space = space or PolicySpace.of(base, settings)
    kinds = partial(kinds_of_states, base, settings, max_failed, space)
    key = _key_of(Dependence.of(base, space))
    # States are inferred before all cases are made: memory that is full of cases makes each inference slower.
    different: dict[Hashable, KnowledgeState] = {}
    for case in chain.from_iterable(kinds()):
        different.setdefault(key(case), case.state)
    on_count(0, len(different))
    decided: dict[Hashable, Outcome] = {}
    for each, state in different.items():
        decided[each] = decide(Situation(state))
        on_count(len(decided), len(different))

    def outcome(case: PolicyCase) -> Outcome:
        known = decided[key(case)]
        # What contradicts what is told with measured values.
        return decide(Situation(case.state)) if known.reasoning is None else known

    cases = [
        case for group in kinds() for case in _with_flip_flops([replace(each, outcome=outcome(each)) for each in group])
    ]
    return Policy(
        attributes=space.attributes,
        ranges=dict.fromkeys(space.attributes, ranges_between(space.numbers)),
        cases=tuple(cases),
        alike=space.alike,
        without_effect=tuple(name for name in measured_attributes(base, settings) if name not in space.attributes),
        computing=rules_that_compute(base),
        max_failed=max_failed,
    )


def _key_of(depends: Dependence) -> Callable[[PolicyCase], Hashable]:
    """Make a function that returns what the decision in a case can depend on."""
    relevant: dict[tuple[str, ...], list[str]] = {}
    places: dict[tuple[object, ...], dict[str, Hashable]] = {}

    def key(case: PolicyCase) -> Hashable:
        state = case.state
        if case.asked not in relevant:
            relevant[case.asked] = sorted(frozenset[str]().union(*map(depends.attributes.__getitem__, case.asked)))
        if state.measurements not in places:
            places[state.measurements] = depends.places(state.measurements)
        known = places[state.measurements]
        return case.asked, state.groundings, state.components, tuple(map(known.get, relevant[case.asked]))

    return key


class _Task(NamedTuple):
    """Functions asked for together, as the mission's tasks do, and one way to ground them."""

    asked: tuple[str, ...]
    objectives: tuple[ObjectiveState, ...]
    groundings: tuple[tuple[str, str], ...]


def kinds_of_states(
    base: Ontology, settings: ManagingSettings, max_failed: int, space: PolicySpace
) -> Iterator[list[PolicyCase]]:
    """Yield every kind of state, undecided, in groups that differ only in objectives and groundings.

    Raises:
        InputError: there would be too many states.
    """
    total = _number_of_kinds(base, settings, max_failed, space)
    if total > LARGEST:
        raise InputError(
            f"the policy has {total:,} kinds of states, which is too many",
            remedy=f"at most {LARGEST:,}; lower --max-failed, or give a scenario with fewer measured attributes",
        )
    combinations = list(component_reports(space.alike, space.statuses, max_failed))
    tasks = list(_tasks(base, settings, space))
    for ranges in itertools.product(ranges_between(space.numbers), repeat=len(space.attributes)):
        for values in values_in(ranges):
            known = zip(space.attributes, values, strict=True)
            measured = tuple((name, value) for name, value in known if value is not None)
            for each in combinations:
                yield [
                    PolicyCase(ranges, KnowledgeState(objectives, groundings, each.components, measured), each, asked)
                    for asked, objectives, groundings in tasks
                ]


def _number_of_kinds(base: Ontology, settings: ManagingSettings, max_failed: int, space: PolicySpace) -> int:
    between = ranges_between(space.numbers)
    reports = sum(1 for _ in component_reports(space.alike, space.statuses, max_failed))
    others = reports * sum(1 for _ in _tasks(base, settings, space))
    measured: int = len(between) ** len(space.attributes)
    if measured * others <= LARGEST:  # else so many already that it does not matter how many values a range has
        ranges = itertools.product(between, repeat=len(space.attributes))
        measured = sum(1 for each in ranges for _ in values_in(each))
    return measured * others


def _tasks(base: Ontology, settings: ManagingSettings, space: PolicySpace) -> Iterator[_Task]:
    solvable = [name for name in base.functions if base.designs(name) or name in space.functions]
    lasting = [name for name in LASTING if name in solvable]
    for asked in [(*lasting, name) for name in solvable if name not in lasting] or [tuple(lasting)]:
        for designs in itertools.product(*((None, *base.designs(name)) for name in asked)):
            groundings = {name: design for name, design in zip(asked, designs, strict=True) if design is not None}
            state = settings.state(dict.fromkeys(asked), groundings)
            yield _Task(asked, state.objectives, state.groundings)


def _with_flip_flops(cases: Sequence[PolicyCase]) -> Iterator[PolicyCase]:
    """Mark the cases whose decisions lead through other groundings back to their own, all else being constant."""

    def after(case: PolicyCase) -> Hashable:
        chosen = {function: design for function, design in case.decided.changes.items() if design != NONE_LEFT}
        return case.asked, tuple(sorted({**dict(case.state.groundings), **chosen}.items()))

    found: dict[Hashable, PolicyCase] = {(case.asked, case.state.groundings): case for case in cases}
    for start, case in found.items():
        way = [start]
        while (following := after(found[way[-1]])) in found and following not in way:
            way.append(following)
        designs = [dict(found[each].state.groundings) for each in way] if following == start else []
        flipping = (name for name in case.asked if len({each.get(name) for each in designs}) > 1)
        yield replace(case, flipping=tuple(flipping)) if len(designs) > 1 else case


def no_proof(computing: Sequence[str]) -> str:
    """Warn that a policy is not a proof, because of rules that compute."""
    return f"not a proof, as measured values are samples for rules that compute: {', '.join(computing)}"


_Groundings = tuple[tuple[str, str], ...]
_Column = tuple[ValueRange, ...]


class TableRow(NamedTuple):
    """A row of a function's table: reports and groundings as far as they have an effect, and the outcome by column."""

    components: str
    groundings: dict[str, str]
    outcomes: tuple[str, ...]


@dataclass(frozen=True)
class FunctionTable:
    """What happens to one function's grounding, over everything that has an effect on it.

    Attributes:
        function: which function.
        attributes: whose measured values have an effect.
        columns: ranges of these attributes' values; neighbours that are equal in every row are joined.
        rows: one for each combination of reports and groundings.
    """

    function: str
    attributes: tuple[str, ...]
    columns: tuple[_Column, ...]
    rows: tuple[TableRow, ...]


def function_table(policy: Policy, function: str) -> FunctionTable:
    """Tabulate one function, without the dimensions on which it does not depend."""
    cases = [case for case in policy.cases if function in case.asked]
    outcomes = [case.choice(function) for case in cases]
    values: dict[tuple[str, str], list[Hashable]] = {
        **{("grounding", name): [case.present(name) for case in cases] for name in policy.functions},
        ("components", ""): [case.reports for case in cases],
        **{("attribute", name): [case.ranges[place] for case in cases] for place, name in enumerate(policy.attributes)},
    }
    kept = _dimensions(values, outcomes, ("grounding", function))
    attributes, grounded = ([name for kind, name in kept if kind == wanted] for wanted in ("attribute", "grounding"))
    found: dict[tuple[ComponentReports | None, _Groundings], dict[_Column, str]] = {}
    for case, outcome in zip(cases, outcomes, strict=True):
        reports = case.reports if ("components", "") in kept else None
        row = found.setdefault((reports, tuple((name, case.present(name)) for name in grounded)), {})
        column = tuple(case.ranges[policy.attributes.index(name)] for name in attributes)
        before = row.setdefault(column, outcome)
        if before != outcome:
            row[column] = f"{before} or {outcome}, by the order of the values"
    joined = [_joined(policy.ranges[name], place, list(found.values())) for place, name in enumerate(attributes)]
    columns = list(itertools.product(*joined))
    by_reports: dict[ComponentReports | None, dict[_Groundings, tuple[str, ...]]] = {}
    for (reports, groundings), row in found.items():
        in_columns = tuple(row.get(tuple(first for _, first in column), "") for column in columns)
        by_reports.setdefault(reports, {})[groundings] = in_columns
    # Reports that lead to the same outcomes for every grounding are in one row.
    groups: dict[Hashable, list[ComponentReports | None]] = {}
    for reports, rows in by_reports.items():
        groups.setdefault(tuple(rows.items()), []).append(reports)
    return FunctionTable(
        function,
        tuple(attributes),
        tuple(tuple(shown for shown, _ in column) for column in columns),
        tuple(
            TableRow(_reports_text(filter(None, group), policy), dict(groundings), results)
            for group in groups.values()
            for groundings, results in by_reports[group[0]].items()
        ),
    )


def _dimensions(
    values: Mapping[tuple[str, str], Sequence[Hashable]], outcomes: Sequence[str], own: tuple[str, str]
) -> list[tuple[str, str]]:
    """What outcomes depend on: other groundings, components, attributes, and always a function's own grounding."""
    kept = list(values)
    for dimension in values:
        fewer = [each for each in kept if each != dimension]
        seen: dict[Hashable, str] = {}
        points = zip(zip(*(values[each] for each in fewer), strict=True), outcomes, strict=True)
        if dimension != own and all(seen.setdefault(at, outcome) == outcome for at, outcome in points):
            kept = fewer
    return kept


def _joined(
    ranges: Sequence[ValueRange], place: int, rows: Sequence[dict[_Column, str]]
) -> list[tuple[ValueRange, ValueRange]]:
    """Join the neighbours that are equal in all rows and other columns: (joined range, first range in it)."""

    def outcomes(one: ValueRange) -> list[dict[_Column, str]]:
        return [{(*at[:place], *at[place + 1 :]): row[at] for at in row if at[place] == one} for row in rows]

    joined: list[tuple[ValueRange, ValueRange]] = []
    for one in ranges:
        if joined and not joined[-1][0].is_missing and outcomes(joined[-1][1]) == outcomes(one):
            joined[-1] = joined[-1][0].joined(one), joined[-1][1]
        else:
            joined.append((one, one))
    return joined


def _reports_text(group: Iterator[ComponentReports], policy: Policy) -> str:
    """What components report: counted where they are interchangeable, else named; empty without an effect."""
    texts = []
    for reports in group:
        counted: dict[tuple[str, str], int] = {}
        for component, status in reports.components:
            kind = next(each for each in policy.alike if component in each)
            label = component if len(kind) == 1 else "" if len(policy.alike) == 1 else f" of {kind[0]} and alike"
            counted[label, status] = counted.get((label, status), 0) + 1
        parts = [
            f"{label} {status}" if label and not label.startswith(" ") else f"{number} {status}{label}"
            for (label, status), number in counted.items()
        ]
        texts.append(" + ".join(parts) or "no report")
    return ", ".join(texts)


def columns_of(policy: Policy) -> tuple[str, ...]:
    """Columns of the CSV file."""
    now, then = ([f"{function}_{when}" for function in policy.functions] for when in ("now", "then"))
    return (*policy.attributes, "components", "states", *now, "statuses", *then, "marks", "problem")


def rows_of(policy: Policy) -> Iterator[tuple[object, ...]]:
    """Rows of the CSV file: every case."""
    for case in policy.cases:
        yield (
            *map(str, case.ranges),
            "; ".join(f"{name}={status}" for name, status in case.reports.components),
            case.reports.combinations,
            *(case.present(name) if name in case.asked else "" for name in policy.functions),
            "; ".join(case.decided.statuses),
            *(case.decided.choice(name) if name in case.asked else "" for name in policy.functions),
            "; ".join(case.marks),
            case.decided.contradiction,
        )
