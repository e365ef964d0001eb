"""The policy: what is decided in every state, over regions of measured values, components and groundings."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Final

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.deliberation import Conclusion
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import KnowledgeState
from suave_des.workbench.regions import Region, matters, numbers_in, regions_between, rules_that_compute, values_in
from suave_des.workbench.states import LASTING, Loop
from suave_des.workbench.symmetry import Reports, alike, reports, statuses

if TYPE_CHECKING:
    from collections.abc import Callable

#: Beyond this many inferences a policy is refused: at a millisecond and a half each it would take ten minutes.
LARGEST: Final = 400_000
INCONSISTENT, NONE_LEFT, FLIP_FLOP = "inconsistent", "none left", "flip-flop"


@dataclass(frozen=True)
class Cell:
    """One kind of state, and what is decided in it.

    Attributes:
        regions: of each attribute's measured value, in the policy's order.
        state: one state of this kind.
        reports: what the components report.
        asked: functions that have an objective.
        statuses: what is inferred of objectives and groundings, in words, sorted.
        choices: (function, design) decided; None for the design when none is left.
        marks: any of "inconsistent", "none left", "flip-flop".
        flipping: functions whose grounding flips back and forth.
        problem: what contradicts what, for an inconsistent one.
    """

    regions: tuple[Region, ...]
    state: KnowledgeState
    reports: Reports
    asked: tuple[str, ...]
    statuses: tuple[str, ...] = ()
    choices: tuple[tuple[str, str | None], ...] = ()
    marks: tuple[str, ...] = ()
    flipping: tuple[str, ...] = ()
    problem: str | None = None

    def outcome(self, function: str) -> str:
        """What happens to a function's grounding: a design, "stays", "none left" or "inconsistent"."""
        if INCONSISTENT in self.marks:
            return INCONSISTENT
        choice = dict(self.choices)
        if function not in choice:
            return "stays"
        design = choice[function]
        if design is None:
            return NONE_LEFT
        return "stays" if design == self.state.grounded(function) else design

    @property
    def after(self) -> tuple[tuple[str, str], ...]:
        """Groundings after the decisions."""
        chosen = {function: design for function, design in self.choices if design is not None}
        return tuple(sorted({**dict(self.state.groundings), **chosen}.items()))


@dataclass(frozen=True)
class Policy:
    """The whole decision table.

    Attributes:
        attributes: quality attributes whose measured values make a difference.
        regions: of each attribute, rising.
        cells: one for each kind of state, in a fixed order.
        alike: groups of components that are treated alike.
        without_effect: measured attributes that no rule and no design looks at.
        computing: rules that compute with numbers; if there are any, the regions are samples and prove nothing.
        max_failed: at most so many components report anything.
    """

    attributes: tuple[str, ...]
    regions: Mapping[str, tuple[Region, ...]]
    cells: tuple[Cell, ...] = field(repr=False)
    alike: tuple[tuple[str, ...], ...]
    without_effect: tuple[str, ...]
    computing: tuple[str, ...]
    max_failed: int

    @cached_property
    def states(self) -> int:
        """Number of states covered; alike components count one by one, each region once."""
        return sum(cell.reports.combinations for cell in self.cells)

    def marked(self, mark: str) -> tuple[Cell, ...]:
        """Cells with a mark."""
        return tuple(cell for cell in self.cells if mark in cell.marks)

    @cached_property
    def functions(self) -> tuple[str, ...]:
        """Functions that some state asks for."""
        return tuple(sorted({function for cell in self.cells for function in cell.asked}))


@dataclass(frozen=True)
class Space:
    """What a policy distinguishes.

    Attributes:
        attributes: quality attributes whose measured values make a difference.
        numbers: ends of the regions, rising.
        alike: groups of components that are treated alike.
        words: what components may report.
    """

    attributes: tuple[str, ...]
    numbers: tuple[Decimal, ...]
    alike: tuple[tuple[str, ...], ...]
    words: tuple[str, ...]

    @classmethod
    def of(cls, base: Ontology, loop: Loop) -> Space:
        """What can make a difference to these ontologies."""
        attributes = tuple(name for name in _measured(base, loop) if matters(base, name))
        return cls(attributes, numbers_in(base), alike(base), statuses(base))

    def common(self, other: Space) -> Space:
        """What makes a difference here or there; components are alike only if they are so in both that have them."""
        groups: dict[tuple[int, int], list[str]] = {}
        for number, group in enumerate(self.alike):
            for name in group:
                there = next((place for place, each in enumerate(other.alike) if name in each), -1)
                groups.setdefault((number, there), []).append(name)
        known = {name for group in self.alike for name in group}
        only_there = (tuple(name for name in group if name not in known) for group in other.alike)
        return Space(
            tuple(sorted({*self.attributes, *other.attributes})),
            tuple(sorted({*self.numbers, *other.numbers})),
            (*map(tuple, groups.values()), *filter(None, only_there)),
            tuple(sorted({*self.words, *other.words})),
        )


def make_policy(
    base: Ontology,
    loop: Loop,
    infer: Callable[[KnowledgeState], Conclusion],
    max_failed: int,
    space: Space | None = None,
) -> Policy:
    """Decide every kind of state.

    Args:
        base: the ontologies.
        loop: which attributes are measured, and what the managing subsystem does in code.
        infer: analyzes a state and plans on it.
        max_failed: at most so many components report anything.
        space: what to distinguish; left out, what can make a difference.

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
    space = space or Space.of(base, loop)
    attributes = space.attributes
    between = regions_between(space.numbers)
    combinations = list(reports(space.alike, space.words, max_failed))
    situations = list(_situations(base))
    total = len(between) ** len(attributes) * len(combinations) * len(situations)
    if total > LARGEST:
        raise InputError(
            f"the policy has {total:,} kinds of states, which is too much",
            remedy=f"at most {LARGEST:,}; lower --max-failed, or give a scenario that measures less",
        )
    cells: list[Cell] = []
    for regions in itertools.product(between, repeat=len(attributes)):
        for values in values_in(regions):
            known = {name: value for name, value in zip(attributes, values, strict=True) if value is not None}
            for each in combinations:
                part = []
                for asked, groundings in situations:
                    state = KnowledgeState.of(
                        [loop.objective(function, groundings.get(function)) for function in asked],
                        groundings=groundings,
                        components=dict(each.components),
                        measurements=known,
                    )
                    part.append(_decided(Cell(regions, state, each, asked), infer))
                cells += _with_flip_flops(part)
    return Policy(
        attributes=attributes,
        regions=dict.fromkeys(attributes, between),
        cells=tuple(cells),
        alike=space.alike,
        without_effect=tuple(name for name in _measured(base, loop) if name not in attributes),
        computing=rules_that_compute(base),
        max_failed=max_failed,
    )


def _measured(base: Ontology, loop: Loop) -> list[str]:
    return [name for name in loop.measured if name in base.quality_attributes]


def _situations(base: Ontology) -> Iterator[tuple[tuple[str, ...], dict[str, str]]]:
    """Functions asked for together, as the mission's tasks do, with each way to ground them."""
    solvable = [name for name in base.functions if base.designs(name)]
    lasting = [name for name in LASTING if name in solvable]
    tasks = [(*lasting, name) for name in solvable if name not in lasting] or [tuple(lasting)]
    for task in tasks:
        for designs in itertools.product(*((None, *base.designs(name)) for name in task)):
            yield task, {name: design for name, design in zip(task, designs, strict=True) if design is not None}


def _decided(cell: Cell, infer: Callable[[KnowledgeState], Conclusion]) -> Cell:
    try:
        conclusion = infer(cell.state)
    except KnowledgeError as error:
        if not error.problem.startswith("contradiction"):
            raise
        return replace(cell, marks=(INCONSISTENT,), problem=error.problem)
    choices = tuple((each.function, each.design) for each in conclusion.plan.decisions)
    marks = (NONE_LEFT,) if any(design is None for _, design in choices) else ()
    return replace(cell, statuses=tuple(sorted(conclusion.statuses)), choices=choices, marks=marks)


def _with_flip_flops(cells: list[Cell]) -> list[Cell]:
    """Mark cells whose decisions lead back to their own groundings by way of others, while nothing else changes."""
    found = {(cell.asked, cell.state.groundings): cell for cell in cells}
    flipping: dict[object, tuple[str, ...]] = {}
    for start in found:
        way = [start]
        while len(way) <= len(found):
            cell = found[way[-1]]
            following = (cell.asked, cell.after)
            if INCONSISTENT in cell.marks or following == way[-1] or following not in found:
                break
            way.append(following)
            if following == start:
                designs = [dict(groundings) for _, groundings in way]
                flipping[start] = tuple(name for name in cell.asked if len({each.get(name) for each in designs}) > 1)
                break
    return [
        replace(cell, marks=(*cell.marks, FLIP_FLOP), flipping=functions)
        if (functions := flipping.get((cell.asked, cell.state.groundings)))
        else cell
        for cell in cells
    ]
