"""The data of the MAPE-K loop: the knowledge state, its inference, and the plan.

Nothing here imports a reasoner, so that the rest of the simulation may use these types at no cost.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from functools import cached_property
from typing import NamedTuple

from suave_des.errors import KnowledgeError, shown

Value = str | bool | Decimal
#: Functions with their designs, or components with their statuses.
Pairs = tuple[tuple[str, str], ...]
#: Quality attribute types with their measured values.
Measured = tuple[tuple[str, Decimal], ...]
NumberLike = Decimal | float | int | str
#: Status of an objective whose function has no function design in use.
UNGROUNDED = "UNGROUNDED"
#: What a record or a table shows in place of a function design where a function has none.
NO_GROUNDING = "ungrounded"
#: What happens to a function's grounding that gets no other design.
STAYS = "stays"
NONE_LEFT = "none left"
#: Beyond this power of ten (floats end at 308) a number is a mistake, and its text would fill the
# memory.
MAX_EXPONENT = 400
#: Halves of surrogate pairs: also what Python reads bytes as that are not UTF-8.
_SURROGATE = re.compile("[\ud800-\udfff]")


class ContradictionError(KnowledgeError):
    """A state that contradicts the ontologies, or ontologies that contradict themselves."""


def exact(number: NumberLike) -> Decimal:
    """Convert a number to the decimal that the shortest text of a float denotes: 0.1, not
    0.1000000000000000055.

    Trailing zeros are dropped, so that equal numbers are written alike.

    Raises:
        KnowledgeError: it is not a finite number.
    """
    try:
        value = Decimal(repr(float(number)) if isinstance(number, float) else number)
    except (InvalidOperation, ValueError, TypeError) as error:
        raise KnowledgeError(f"{number!r} is not a number") from error
    if not value.is_finite() or abs(value.adjusted()) > MAX_EXPONENT:
        raise KnowledgeError(f"{number!r} is not a finite number of ordinary size")
    return Decimal(plain_text(value))


def plain_text(number: Decimal) -> str:
    """Write a number without exponent, and without zeros at the end of its decimals."""
    text = format(number, "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def _text(name: str, value: object) -> str:
    """Return a value that is text.

    Raises:
        KnowledgeError: it is something else, or no file can hold it.
    """
    if not isinstance(value, str):
        raise KnowledgeError(f"{name}: {shown(value)} is not text", remedy="write it in quotes")
    if _SURROGATE.search(value):
        problem = f"{name}: {shown(value)} has a character that no file can hold"
        raise KnowledgeError(problem, remedy="write it in UTF-8")
    return value


def _texts(parts: Mapping[str, str] | None) -> Pairs:
    """Sort texts by name; errors as `_text`."""
    return tuple(sorted((name, _text(name, value)) for name, value in (parts or {}).items()))


class ObjectiveState(NamedTuple):
    """A current objective of the mission: the required function, and its status as recorded by the
    loop.
    """

    function: str
    status: str | None = None
    always_improve: bool = False


@dataclass(frozen=True, slots=True)
class KnowledgeState:
    """The variable part of the knowledge base: hashable, sorted by name, and without inferences.

        KnowledgeState.of(
            [ObjectiveState("f_generate_search_path", UNGROUNDED)],
            components={"c_thruster_1": "FALSE"},
            measurements={"water_visibility": 2.4},
        )

    Attributes:
        objectives: one for each function that the current task needs.
        groundings: (function, function design) now in use.
        components: (component, c_status) as diagnostics report it, for example ("c_thruster_1",
            "FALSE").
        measurements: (quality attribute type, measured value).
        measured_since: the values that were measured when the inference was over, with which
            designs are chosen; None: the same.
    """

    objectives: tuple[ObjectiveState, ...] = ()
    groundings: Pairs = ()
    components: Pairs = ()
    measurements: Measured = ()
    measured_since: Measured | None = None

    @classmethod
    def of(
        cls,
        objectives: Iterable[ObjectiveState] = (),
        *,
        groundings: Mapping[str, str] | None = None,
        components: Mapping[str, str] | None = None,
        measurements: Mapping[str, NumberLike] | None = None,
    ) -> KnowledgeState:
        """Make a state from unsorted parts; floats become exact short decimals.

        Raises:
            KnowledgeError: a measured value is not a finite number, a design or a status is not
                text, or a function has two objectives.
        """
        known = sorted(objectives, key=lambda objective: objective.function)
        for each in known:
            if each.status is not None:
                _text(each.function, each.status)
        for one, other in itertools.pairwise(known):
            if one.function == other.function:
                raise KnowledgeError(
                    f"function {one.function} has two objectives", remedy="give it one"
                )
        return cls(
            objectives=tuple(known),
            groundings=_texts(groundings),
            components=_texts(components),
            measurements=tuple(
                sorted((name, exact(value)) for name, value in (measurements or {}).items())
            ),
        )

    def __str__(self) -> str:
        """Return the form that messages show, on one line."""
        values: tuple[tuple[str, Value], ...] = (
            *self.groundings,
            *self.components,
            *self.measurements,
        )
        parts = [
            *(
                f"objective {each.function}" + (f" ({each.status})" if each.status else "")
                for each in self.objectives
            ),
            *(f"{name} = {value_text(value)}" for name, value in values),
            *(f"then {name} = {value_text(value)}" for name, value in self.measured_since or ()),
        ]
        return ", ".join(parts) or "the empty state"

    def planned_with(self) -> dict[str, Decimal]:
        """The measured values with which designs are chosen."""
        return dict(self.measurements if self.measured_since is None else self.measured_since)

    def grounded(self, function: str) -> str | None:
        """The function design in use for a function."""
        return next((design for name, design in self.groundings if name == function), None)


@dataclass(frozen=True, slots=True)
class Fact:
    """One property value: names are short (the IRI's last part) where that is unambiguous, else
    IRIs.
    """

    subject: str
    property: str
    value: Value

    def __str__(self) -> str:
        """As a rule atom: fg_status(fg_spiral_high, IN_ERROR_NFR), Component(c_thruster_1)."""
        if self.property == "type":
            return f"{self.value}({self.subject})"
        return f"{self.property}({self.subject}, {value_text(self.value)})"


def value_text(value: Value) -> str:
    """Write a value as rules and facts do: true, 2.25, IN_ERROR_NFR; no text is two quotes."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) or '""'


@dataclass(frozen=True)
class Inference:
    """The facts that the reasoner adds to a state.

    Attributes:
        state: the state that was analyzed.
        asserted_in: finds the facts of the knowledge base and of a state, when they are needed.
        facts: the inferred facts, none of which is asserted.
        objectives: name of a function's objective, by the function's name.
        groundings: name of a function design's grounding, by the design's name.
    """

    state: KnowledgeState
    asserted_in: Callable[[KnowledgeState], frozenset[Fact]] = field(compare=False, repr=False)
    facts: frozenset[Fact]
    objectives: Mapping[str, str] = field(compare=False, repr=False)
    groundings: Mapping[str, str] = field(compare=False, repr=False)

    @cached_property
    def asserted(self) -> frozenset[Fact]:
        """The facts of the knowledge base and of the state."""
        return self.asserted_in(self.state)

    @cached_property
    def _index(self) -> dict[tuple[str, str], tuple[Value, ...]]:
        index: dict[tuple[str, str], list[Value]] = {}
        for fact in sorted(self.asserted | self.facts, key=lambda fact: str(fact.value)):
            index.setdefault((fact.subject, fact.property), []).append(fact.value)
        return {key: tuple(values) for key, values in index.items()}

    def values(self, subject: str, property_name: str) -> tuple[Value, ...]:
        """Asserted and inferred values of a property, sorted by their text."""
        return self._index.get((subject, property_name), ())

    def subjects(self, property_name: str, value: Value) -> tuple[str, ...]:
        """Subjects with a value of a property, asserted or inferred, sorted by name."""
        return tuple(
            sorted(
                s
                for (s, p), values in self._index.items()
                if p == property_name and value in values
            )
        )

    def objective_status(self, function: str) -> str | None:
        """Status of a function's objective, asserted or inferred; None while it is met."""
        return next(map(str, self.values(self.objectives[function], "o_status")), None)

    def grounding_status(self, function: str) -> str | None:
        """Status of a function's current grounding; None if it has no problem, or if there is no
        grounding.
        """
        design = self.state.grounded(function)
        if design is None:
            return None
        return next(map(str, self.values(self.groundings[design], "fg_status")), None)

    @cached_property
    def statuses(self) -> frozenset[str]:
        """The inferred statuses of objectives and groundings, in words."""
        found = []
        for objective in self.state.objectives:
            status = self.objective_status(objective.function)
            if status is not None and status != objective.status:
                found.append(f"objective of {objective.function} is {status}")
            if (
                True in self.values(self.objectives[objective.function], "o_updatable")
                and not objective.always_improve
            ):
                found.append(f"objective of {objective.function} is updatable")
        for function, design in self.state.groundings:
            if (status := self.grounding_status(function)) is not None:
                found.append(f"grounding of {design} is {status}")
        return frozenset(found)


@dataclass(frozen=True, slots=True)
class Rejection:
    """A function design that the planner ruled out, and why."""

    design: str
    reason: str


@dataclass(frozen=True, slots=True)
class Decision:
    """The planner's choice for one function.

    Attributes:
        function: whose objective is adapted.
        design: the function design to ground; None if none is left, and the current one is kept.
        reason: why the objective is adapted and the design chosen.
        rejected: the designs that were ruled out, by name.
    """

    function: str
    design: str | None
    reason: str
    rejected: tuple[Rejection, ...] = ()


@dataclass(frozen=True)
class Plan:
    """Decisions for the objectives to adapt, by function name."""

    decisions: tuple[Decision, ...] = ()

    @cached_property
    def designs(self) -> dict[str, str | None]:
        """The chosen function designs, by function; None: no one is left."""
        return {each.function: each.design for each in self.decisions}

    @cached_property
    def without_design(self) -> frozenset[str]:
        """The functions that have no function design left."""
        return frozenset([each.function for each in self.decisions if each.design is None])


@dataclass(frozen=True)
class Reasoning:
    """The result of the loop's steps Analyze and Plan.

    Attributes:
        inference: what the reasoner added to the state.
        plan: decisions for the objectives to adapt.
    """

    inference: Inference
    plan: Plan

    @cached_property
    def changes(self) -> dict[str, str]:
        """New design of each function whose grounding changes, or NONE_LEFT if no design is
        left.
        """
        state = self.inference.state
        outcomes = {each.function: each.design or NONE_LEFT for each in self.plan.decisions}
        return {
            function: outcome
            for function, outcome in outcomes.items()
            if outcome != state.grounded(function)
        }


def objective_name(function: str) -> str:
    """Usual name of the objective of a function: o_generate_search_path for f_generate_search_path."""
    return f"o_{function.removeprefix('f_')}"


def grounding_name(design: str) -> str:
    """Usual name of the grounding of a function design: fg_spiral_high for fd_spiral_high."""
    return f"fg_{design.removeprefix('fd_')}"


def measurement_name(attribute: str) -> str:
    """Usual name of the measured value of a quality attribute type: obs_water_visibility for
    water_visibility.
    """
    return f"obs_{attribute}"
