"""A mission's MAPE-K cycles: what was known, what followed by which rule, and what was decided."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

from suave_des.errors import InputError, KnowledgeError
from suave_des.kb.explain import LEFT_OUT, verdicts
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.states import ManagingSettings
from suave_des.kb.tracing import Derivation
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.planning import performance
from suave_des.knowledge.rdf import local_name
from suave_des.knowledge.rules import write_rule
from suave_des.knowledge.state import Reasoning
from suave_des.metrics.result import KnowledgeRecord
from suave_des.pages.recorded import Recorded, recorded
from suave_des.records.mission_folder import MissionRecord
from suave_des.resources import find
from suave_des.results.mission import adaptations
from suave_des.results.mission_figures import Rules
from suave_des.scenario.yamlfile import InputFiles
from suave_des.scenario_knowledge import open_base, read_base

_TIME_DIGITS = 2


@dataclass(frozen=True)
class Step:
    """How a fact follows, as the page shows it; see Derivation."""

    fact: str
    source: str
    rule: str | None = None
    bindings: tuple[tuple[str, str], ...] = ()
    because: tuple[Step, ...] = ()


@dataclass(frozen=True)
class Design:
    """A function design in a decision.

    Attributes:
        name: of the design.
        verdict: "chosen", "left out" or "not the best".
        performance: that the knowledge base expects of it.
        reason: why it is left out; empty for the others.
    """

    name: str
    verdict: str
    performance: float
    reason: str = ""


@dataclass(frozen=True)
class FunctionDecision:
    """A decision about a function: the design grounded before and the one chosen, why, and all designs."""

    function: str
    before: str | None
    chosen: str | None
    reason: str
    designs: tuple[Design, ...]


@dataclass(frozen=True)
class Cycle:
    """A reasoning cycle.

    Attributes:
        t_s: mission time at which it began.
        objectives: status of each function's objective; None while all is well.
        groundings: design in use, by function.
        components: status of each component that has reported one.
        measured: value of each quality attribute.
        inferred: index in `Cycles.inferences` of what followed; -1: nothing.
        decided: what was decided.
    """

    t_s: float
    objectives: Mapping[str, str | None]
    groundings: Mapping[str, str]
    components: Mapping[str, str]
    measured: Mapping[str, float]
    inferred: int
    decided: tuple[FunctionDecision, ...]


@dataclass(frozen=True)
class Inferred:
    """What followed in a state, with its derivations as they were at one time."""

    t_s: float
    facts: tuple[Step, ...]


@dataclass(frozen=True)
class Cycles:
    """All reasoning cycles of a mission.

    Attributes:
        cycles: in order of time.
        inferences: what followed in them, each kind of situation once.
        rules: text of each rule that took part.
        note: why some of it is missing or may differ from what the mission saw; empty: nothing is.
    """

    cycles: tuple[Cycle, ...] = ()
    inferences: tuple[Inferred, ...] = ()
    rules: Mapping[str, str] = field(default_factory=dict)
    note: str = ""


def explain_cycles(mission: Recorded) -> Cycles:
    """Reason about the recorded states again, and explain what follows and what is decided.

    Where the ontologies are not there any more, only the states are given, with a note.
    """
    if not mission.record.knowledge:
        return Cycles()
    try:
        base, note = _base(mission)
        settings, reasoner = ManagingSettings.of(mission.scenario), mission.scenario.knowledge.reasoner
        knowledge = KnowledgeBase.of(base, settings, reasoner, TimeLimit(TIME_LIMIT_S, "the reasoner"))
    except InputError as error:
        cycles = tuple(_cycle(record, -1, ()) for record in mission.record.knowledge)
        return Cycles(cycles, note=f"Decisions are not explained: {error}")
    return _Explainer(knowledge).cycles(mission, note)


def _base(mission: Recorded) -> tuple[Ontology, str]:
    """Open the mission's ontologies, with a note where one of them has changed since."""
    if mission.loaded is not None:
        return open_base(mission.loaded), ""
    base = read_base(mission.scenario)
    files = InputFiles()
    for name in (*mission.scenario.knowledge.ontologies, *mission.scenario.knowledge.rules):
        files.ontology(find(name, "ontology"))
    before = {Path(name).name: digest for name, digest in mission.record.inputs.items()}
    changed = [
        Path(name).name for name, digest in files.inputs.items() if before.get(Path(name).name, digest) != digest
    ]
    note = f"{', '.join(changed)} changed since the mission: decisions are explained with today's." if changed else ""
    return base, note


class _Explainer:
    """Explains states, the facts of each kind of situation once."""

    def __init__(self, knowledge: KnowledgeBase) -> None:
        self.knowledge = knowledge
        self.inferences: list[Inferred] = []
        self.index: dict[object, int] = {}
        self.rules: set[str] = set()

    def cycles(self, mission: Recorded, note: str) -> Cycles:
        cycles = []
        for record in mission.record.knowledge:
            try:
                reasoning = self.knowledge.infer(record.state)
                inferred, decided = self._inferred(record.t_s, reasoning), tuple(self._decided(reasoning))
            except KnowledgeError as error:
                note = note or f"At {record.t_s:.1f} s the knowledge base gives no conclusion: {error.problem}"
                inferred, decided = -1, ()
            cycles.append(_cycle(record, inferred, decided))
        base = self.knowledge.base
        texts = {
            rule.name: write_rule(rule.name, rule.body, rule.head, local_name).strip()
            for rule in base.content.enabled_rules
            if rule.name in self.rules
        }
        return Cycles(tuple(cycles), tuple(self.inferences), texts, note)

    def _inferred(self, t_s: float, reasoning: Reasoning) -> int:
        """The index of what follows; the numbers in its derivations are those of the first such cycle."""
        facts, state = reasoning.inference.facts, reasoning.inference.state
        if not facts:
            return -1
        key = facts, state.objectives, state.groundings, state.components
        if key not in self.index:
            self.index[key] = len(self.inferences)
            derived = self.knowledge.explain(state).facts
            for derivation in derived:
                self.rules |= derivation.rules()
            self.inferences.append(Inferred(t_s, tuple(map(_step, derived))))
        return self.index[key]

    def _decided(self, reasoning: Reasoning) -> Iterator[FunctionDecision]:
        base, inference = self.knowledge.base, reasoning.inference
        for decision in reasoning.plan.decisions:
            designs = []
            for each in verdicts(base, reasoning, decision):
                expected = float(performance(inference, each.design))
                designs.append(
                    Design(each.design, each.verdict, expected, each.reason if each.verdict == LEFT_OUT else "")
                )
            designs.sort(key=lambda each: (-each.performance, each.name))
            before = inference.state.grounded(decision.function)
            yield FunctionDecision(decision.function, before, decision.design, decision.reason, tuple(designs))


def _cycle(record: KnowledgeRecord, inferred: int, decided: Sequence[FunctionDecision]) -> Cycle:
    state = record.state
    return Cycle(
        t_s=round(record.t_s, _TIME_DIGITS),
        objectives={each.function: each.status for each in state.objectives},
        groundings=dict(state.groundings),
        components=dict(state.components),
        measured={name: round(float(value), 3) for name, value in state.measurements},
        inferred=inferred,
        decided=tuple(decided),
    )


def _step(derivation: Derivation) -> Step:
    bindings = tuple((name, _shown(value)) for name, value in derivation.bindings)
    because = tuple(map(_step, derivation.premises))
    return Step(str(derivation.fact), derivation.source, derivation.rule, bindings, because)


def _shown(value: object) -> str:
    """A bound value, a number with three decimals at most."""
    return f"{float(value):.3f}".rstrip("0").rstrip(".") if isinstance(value, Decimal) else str(value)


def adaptation_rules(record: MissionRecord) -> Rules:
    """Find the rules that fired in the reasoning cycle from which each adaptation of a mission comes.

    Returns:
        Names of rules, by mission time (s) and function of the adaptation; empty for a manager that does not reason.

    Raises:
        InputError: the mission's scenario is of another version.
    """
    known = explain_cycles(recorded(record))
    found = {}
    for each in adaptations(record):
        cycle = _decided_in(known.cycles, each.t_s, each.function, each.after)
        if cycle is not None and cycle.inferred >= 0:
            found[each.t_s, each.function] = _rules(known, cycle, each.function, each.before)
    return found


def _decided_in(cycles: Sequence[Cycle], t_s: float, function: str, design: str) -> Cycle | None:
    """Return the last cycle before a time that chose a design for a function in place of another."""

    def chose(cycle: Cycle) -> bool:
        return any(each.function == function and each.before != each.chosen == design for each in cycle.decided)

    return next((cycle for cycle in reversed(cycles) if cycle.t_s <= t_s and chose(cycle)), None)


def _rules(known: Cycles, cycle: Cycle, function: str, before: str) -> tuple[str, ...]:
    """Return the rules behind what was inferred of a function's objective or of the design that it had."""
    words = before.removeprefix("fd_"), function.removeprefix("f_")
    steps = [step for step in known.inferences[cycle.inferred].facts if any(word in step.fact for word in words)]
    return tuple(dict.fromkeys(rule for step in steps for rule in _rules_of(step)))


def _rules_of(step: Step) -> Iterator[str]:
    for premise in step.because:
        yield from _rules_of(premise)
    if step.rule is not None:
        yield step.rule
