"""The policy: the decision in every state, over ranges of measured values, component reports and groundings."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.deliberation import NONE_LEFT, STAYS, Conclusion
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import NO_GROUNDING, ContradictionError, KnowledgeState
from suave_des.workbench.policy.space import (
    ComponentReports,
    PolicySpace,
    component_reports,
    measured_attributes,
    rules_that_compute,
)
from suave_des.workbench.ranges import ValueRange, ranges_between, values_in
from suave_des.workbench.state_input import LASTING, ManagingSettings

#: Beyond this many inferences a policy is refused: at a millisecond and a half each it would take ten minutes.
LARGEST: Final = 400_000
INCONSISTENT, FLIP_FLOP = "inconsistent", "flip-flop"
OnCount = Callable[[int, int], object]


@dataclass(frozen=True)
class PolicyCase:
    """One kind of state, and the decisions in it.

    Attributes:
        ranges: of each attribute's measured value, in the policy's order.
        state: one state of this kind.
        reports: what the components report.
        asked: functions that have an objective.
        statuses: what is inferred of objectives and groundings, as text, sorted.
        changes: (function, new design) of each function whose grounding changes; "none left" for the design if so.
        marks: any of "inconsistent", "none left", "flip-flop".
        flipping: functions whose grounding flips back and forth.
        problem: what contradicts what, in an inconsistent state.
    """

    ranges: tuple[ValueRange, ...]
    state: KnowledgeState
    reports: ComponentReports
    asked: tuple[str, ...]
    statuses: tuple[str, ...] = ()
    changes: tuple[tuple[str, str], ...] = ()
    marks: tuple[str, ...] = ()
    flipping: tuple[str, ...] = ()
    problem: str | None = None

    def outcome(self, function: str) -> str:
        """What happens to a function's grounding: a design, "stays", "none left" or "inconsistent"."""
        if INCONSISTENT in self.marks:
            return INCONSISTENT
        return dict(self.changes).get(function, STAYS)

    def outcome_text(self, function: str) -> str:
        """The outcome, and whether the choice flips back and forth."""
        return self.outcome(function) + (f" ({FLIP_FLOP})" if function in self.flipping else "")

    def present(self, function: str) -> str:
        """The design that a function has in this state, "ungrounded" or "no objective"."""
        if function not in self.asked:
            return "no objective"
        return self.state.grounded(function) or NO_GROUNDING

    @property
    def after(self) -> tuple[tuple[str, str], ...]:
        """Groundings after the decisions."""
        chosen = {function: design for function, design in self.changes if design != NONE_LEFT}
        return tuple(sorted({**dict(self.state.groundings), **chosen}.items()))


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
    infer: Callable[[KnowledgeState], Conclusion],
    max_failed: int,
    space: PolicySpace | None = None,
    on_count: OnCount = lambda done, total: None,
) -> Policy:
    """Decide every kind of state.

    Args:
        settings: measured attributes, and behaviour of the managing subsystem that is not in the rules.
        infer: analyzes a state and plans on it.
        max_failed: maximum number of components that report a status.
        space: what to tell apart; None: what can have an effect.
        on_count: called repeatedly with the number of kinds of states decided so far, and their total.

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
    attributes = space.attributes
    between = ranges_between(space.numbers)
    cases: list[PolicyCase] = []
    total = _number_of_kinds(base, max_failed, space)
    for kinds in kinds_of_states(base, settings, max_failed, space):
        cases += _with_flip_flops([_decide(case, infer) for case in kinds])
        on_count(len(cases), total)
    return Policy(
        attributes=attributes,
        ranges=dict.fromkeys(attributes, between),
        cases=tuple(cases),
        alike=space.alike,
        without_effect=tuple(name for name in measured_attributes(base, settings) if name not in attributes),
        computing=rules_that_compute(base),
        max_failed=max_failed,
    )


def kinds_of_states(
    base: Ontology, settings: ManagingSettings, max_failed: int, space: PolicySpace
) -> Iterator[list[PolicyCase]]:
    """Yield every kind of state, undecided, in groups that differ only in objectives and groundings.

    Raises:
        InputError: there would be too many states.
    """
    total = _number_of_kinds(base, max_failed, space)
    if total > LARGEST:
        raise InputError(
            f"the policy has {total:,} kinds of states, which is too many",
            remedy=f"at most {LARGEST:,}; lower --max-failed, or give a scenario with fewer measured attributes",
        )
    between = ranges_between(space.numbers)
    combinations = list(component_reports(space.alike, space.statuses, max_failed))
    tasks = list(_tasks(base, space))
    for ranges in itertools.product(between, repeat=len(space.attributes)):
        for values in values_in(ranges):
            known = {name: value for name, value in zip(space.attributes, values, strict=True) if value is not None}
            for each in combinations:
                part = []
                for asked, groundings in tasks:
                    state = KnowledgeState.of(
                        [settings.objective(function, groundings.get(function)) for function in asked],
                        groundings=groundings,
                        components=dict(each.components),
                        measurements=known,
                    )
                    part.append(PolicyCase(ranges, state, each, asked))
                yield part


def _number_of_kinds(base: Ontology, max_failed: int, space: PolicySpace) -> int:
    measured: int = len(ranges_between(space.numbers)) ** len(space.attributes)
    reports = sum(1 for _ in component_reports(space.alike, space.statuses, max_failed))
    return measured * reports * sum(1 for _ in _tasks(base, space))


def _tasks(base: Ontology, space: PolicySpace) -> Iterator[tuple[tuple[str, ...], dict[str, str]]]:
    """Functions asked for together, as the mission's tasks do, with each way to ground them."""
    solvable = [name for name in base.functions if base.designs(name) or name in space.functions]
    lasting = [name for name in LASTING if name in solvable]
    tasks = [(*lasting, name) for name in solvable if name not in lasting] or [tuple(lasting)]
    for task in tasks:
        for designs in itertools.product(*((None, *base.designs(name)) for name in task)):
            yield task, {name: design for name, design in zip(task, designs, strict=True) if design is not None}


def _decide(case: PolicyCase, infer: Callable[[KnowledgeState], Conclusion]) -> PolicyCase:
    try:
        conclusion = infer(case.state)
    except ContradictionError as error:
        return replace(case, marks=(INCONSISTENT,), problem=error.problem)
    marks = (NONE_LEFT,) if conclusion.plan.without_design else ()
    changes = tuple(conclusion.changes.items())
    return replace(case, statuses=tuple(sorted(conclusion.statuses)), changes=changes, marks=marks)


def _with_flip_flops(cases: list[PolicyCase]) -> list[PolicyCase]:
    """Mark the cases whose decisions lead through other groundings back to their own, all else being constant."""
    found = {(case.asked, case.state.groundings): case for case in cases}
    flipping: dict[object, tuple[str, ...]] = {}
    for start in found:
        way = [start]
        while len(way) <= len(found):
            case = found[way[-1]]
            following = (case.asked, case.after)
            if INCONSISTENT in case.marks or following == way[-1] or following not in found:
                break
            way.append(following)
            if following == start:
                designs = [dict(groundings) for _, groundings in way]
                flipping[start] = tuple(name for name in case.asked if len({each.get(name) for each in designs}) > 1)
                break
    return [
        replace(case, marks=(*case.marks, FLIP_FLOP), flipping=functions)
        if (functions := flipping.get((case.asked, case.state.groundings)))
        else case
        for case in cases
    ]


def no_proof(computing: Sequence[str]) -> str:
    """Warn that a policy is not a proof, because of rules that compute."""
    return f"not a proof, as measured values are samples for rules that compute: {', '.join(computing)}"
