"""All kinds of situations that a policy tells apart, and what is decided in them.

States are places of measured values, reports of components and groundings. Only the number of
components with a status counts where ontologies and rules treat components alike.
"""

from __future__ import annotations

import itertools
import operator
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, TypeVar

from suave_des.errors import InputError
from suave_des.kb.effects import has_effect, interchangeable_components
from suave_des.kb.reports import Reports, component_reports
from suave_des.kb.scale import Scale
from suave_des.kb.situations import Outcome
from suave_des.kb.states import LASTING, ManagingSettings
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import regions_of
from suave_des.knowledge.rules import texts_of
from suave_des.knowledge.state import NO_GROUNDING, KnowledgeState
from suave_des.monitor.diagnostics import FAILED, RECOVERED

if TYPE_CHECKING:
    import pandas

#: Beyond this many kinds of states a policy is refused: at a millisecond and a half each it would
#: take ten minutes.
MOST_STATES = 400_000
_T = TypeVar("_T")


@dataclass(frozen=True)
class PolicySpace:
    """What a policy tells apart.

    Attributes:
        attributes: quality attributes whose measured values have an effect, by name.
        numbers: ends of the ranges, ascending.
        alike: groups of interchangeable components.
        statuses: that components can report.
        functions: that have a design, if only in one of two knowledge bases; without one there is
            nothing to ask for.
    """

    attributes: tuple[str, ...]
    numbers: tuple[Decimal, ...]
    alike: tuple[tuple[str, ...], ...]
    statuses: tuple[str, ...]
    functions: tuple[str, ...] = ()

    @classmethod
    def of(cls, base: Ontology, settings: ManagingSettings) -> PolicySpace:
        """What can have an effect in these ontologies."""
        attributes = filter(partial(has_effect, base), measured_attributes(base, settings))
        functions = filter(base.designs, base.functions)
        # What the thruster monitor reports, and what enabled rules ask for.
        asked = texts_of(
            (atom for rule in base.content.enabled_rules for atom in rule.body), rdf.C_STATUS
        )
        return cls(
            tuple(attributes),
            regions_of(base).thresholds,
            interchangeable_components(base),
            tuple(sorted({*asked, FAILED, RECOVERED})),
            tuple(functions),
        )

    @property
    def scale(self) -> Scale:
        """The places of measured values."""
        return Scale(self.numbers)

    def alike_to(self, component: str) -> tuple[str, ...]:
        """The group of a component; empty if it has none."""
        return next((group for group in self.alike if component in group), ())

    def union(self, other: PolicySpace) -> PolicySpace:
        """What has an effect in either; components are alike only if they are so in both that have
        them.
        """
        groups = defaultdict(list)
        for name in dict.fromkeys(itertools.chain(*self.alike, *other.alike)):
            groups[self.alike_to(name), other.alike_to(name)].append(name)
        return PolicySpace(
            tuple(sorted({*self.attributes, *other.attributes})),
            tuple(sorted({*self.numbers, *other.numbers})),
            tuple(map(tuple, groups.values())),
            tuple(sorted({*self.statuses, *other.statuses})),
            tuple(sorted({*self.functions, *other.functions})),
        )


def spread(items: Sequence[_T], most: int) -> Sequence[_T]:
    """Take at most so many, spread evenly; the same ones each time."""
    if len(items) <= most:
        return items
    return [items[number * len(items) // most] for number in range(most)]


def measured_attributes(base: Ontology, settings: ManagingSettings) -> list[str]:
    """Quality attributes of the ontologies that the scenario measures, by name."""
    return sorted(name for name in settings.measured if name in base.model.attributes)


@dataclass(frozen=True)
class States:
    """Every kind of state that a space tells apart: any measured values, with any reports and any
    task.

    Attributes:
        measured: (attribute, value) of those attributes that are measured.
        reports: what components report, with the number of states for which each stands.
        tasks: states with objectives and groundings only.
    """

    space: PolicySpace
    measured: tuple[tuple[tuple[str, Decimal], ...], ...]
    reports: Mapping[Reports, int]
    tasks: tuple[KnowledgeState, ...]

    @classmethod
    def of(
        cls, base: Ontology, settings: ManagingSettings, max_failed: int, space: PolicySpace
    ) -> States:
        """Find the kinds of states of a knowledge base in which at most `max_failed` components
        report a status.

        Raises:
            InputError: max_failed is negative, or there would be too many states.
        """
        if max_failed < 0:
            raise InputError(f"{max_failed} components cannot fail", remedy="give 0 or more")
        reports = component_reports(space.alike, space.statuses, max_failed)
        tasks = tuple(_tasks(base, settings, space))
        scale = space.scale
        attributes = space.attributes
        measured: tuple[tuple[tuple[str, Decimal], ...], ...] = ()
        # at least, as some places of the scale stand for several values
        total = len(scale) ** len(attributes) * len(reports) * len(tasks)
        if total <= MOST_STATES:
            measured = tuple(
                tuple(
                    (name, each)
                    for name, each in zip(attributes, values, strict=True)
                    if each is not None
                )
                for places in itertools.product(range(len(scale)), repeat=len(attributes))
                for values in scale.values(places)
            )
            total = len(measured) * len(reports) * len(tasks)
        if total > MOST_STATES:
            remedy = f"at most {MOST_STATES:,}; lower --max-failed, or give a scenario with fewer measured attributes"
            raise InputError(
                f"the policy has {total:,} kinds of states, which is too many", remedy=remedy
            )
        return cls(space, measured, reports, tasks)

    def __len__(self) -> int:
        return len(self.measured) * len(self.reports) * len(self.tasks)

    def __iter__(self) -> Iterator[KnowledgeState]:
        """One state of each kind; those that differ only in their task follow one another."""
        for values, reports, task in itertools.product(self.measured, self.reports, self.tasks):
            yield KnowledgeState(task.objectives, task.groundings, reports, values)

    @cached_property
    def functions(self) -> tuple[str, ...]:
        """All that have an objective in a state, by name."""
        return tuple(sorted({each.function for task in self.tasks for each in task.objectives}))

    def frame(self, states: Sequence[KnowledgeState]) -> Any:
        """Describe some of the states, one in each row.

        Returns:
            a data frame: the place of each attribute's value on the scale; the `components` that
            report; how many `states` it stands for, as interchangeable components count one by one;
            and of each function with an objective the grounding `_now`, else empty.
        """
        import pandas  # an inference alone needs none, the larger part of its start

        columns: dict[str, list[str] | list[int]] = {}
        scale = self.space.scale
        for name in self.space.attributes:
            columns[name] = [scale.place(dict(each.measurements).get(name)) for each in states]
        columns["components"] = [
            "; ".join(f"{name}={status}" for name, status in each.components) for each in states
        ]
        columns["states"] = [self.reports[each.components] for each in states]
        for name in self.functions:
            columns[f"{name}_now"] = [present(each, name) for each in states]
        return pandas.DataFrame(columns)

    def shared(self, other: States) -> States:
        """The states that another knowledge base with the same space has, too."""
        return replace(self, tasks=tuple(task for task in self.tasks if task in other.tasks))


def present(state: KnowledgeState, function: str) -> str:
    """The grounding of a function that has an objective; empty if it has none."""
    if all(each.function != function for each in state.objectives):
        return ""
    return state.grounded(function) or NO_GROUNDING


def add_decisions(
    cases: pandas.DataFrame, states: States, outcomes: Sequence[Outcome], suffix: str = ""
) -> None:
    """Add to a frame of states the inferred `statuses`, and what happens to the grounding of each
    function, `_then`.
    """
    cases[f"statuses{suffix}"] = ["; ".join(outcome.statuses) for outcome in outcomes]
    for name in states.functions:
        cases[f"{name}_then{suffix}"] = [
            outcome.choice(name) if now else ""
            for outcome, now in zip(outcomes, cases[f"{name}_now"], strict=True)
        ]


def _tasks(
    base: Ontology, settings: ManagingSettings, space: PolicySpace
) -> Iterator[KnowledgeState]:
    solvable = [name for name in base.functions if base.designs(name) or name in space.functions]
    lasting = tuple(filter(solvable.__contains__, LASTING))
    others: list[tuple[str, ...]] = [(name,) for name in solvable if name not in lasting]
    for other in others or [()]:
        asked = (*lasting, *other)
        for designs in itertools.product(*(("", *base.designs(name)) for name in asked)):
            grounded = filter(operator.itemgetter(1), zip(asked, designs, strict=True))
            yield settings.state(dict.fromkeys(asked), dict(grounded))
