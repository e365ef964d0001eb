"""Compare two knowledge bases: their axioms and rules as text, what they decide in every state, and the same missions.

Campaigns and statistics are imported when missions are compared: a knowledge base needs neither.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import rdflib
from rdflib.term import Node

from suave_des.errors import InputError, number_of
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import RDF_TYPE, Lit, Triple, fact_of, is_fact, local_name, term_of
from suave_des.knowledge.rules.writer import literal_text
from suave_des.workbench.policy.cases import Policy, PolicyCase, no_proof
from suave_des.workbench.ranges import ValueRange

if TYPE_CHECKING:
    import pandas

    from suave_des.campaign.progress import OnProgress
    from suave_des.estimates import Interval
    from suave_des.scenario.loader import Replacements

#: Metrics of missions that are compared, with words for it.
METRICS: Final = {"search_time_s": "search time, s", "distance_inspected_m": "distance, m"}
_MANAGER: Final = "metacontrol"


@dataclass(frozen=True)
class AxiomDifference:
    """Axioms and rules that only one of two knowledge bases has, as text.

    Attributes:
        removed: that only the first has.
        added: that only the second has.
    """

    removed: tuple[str, ...]
    added: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """The difference as `kb diff` prints it; nothing where there is none."""
        if not self.removed and not self.added:
            return
        yield f"axioms and rules: {len(self.removed)} removed, {len(self.added)} added"
        yield from (f"  - {text}" for text in self.removed)
        yield from (f"  + {text}" for text in self.added)


def compare_axioms(one: Ontology, other: Ontology) -> AxiomDifference:
    """Compare the axioms, facts and rules of two knowledge bases; labels and comments do not count."""
    before, after = frozenset(axioms_of(one)), frozenset(axioms_of(other))
    return AxiomDifference(tuple(sorted(before - after)), tuple(sorted(after - before)))


def axioms_of(base: Ontology) -> Iterator[str]:
    """Write every axiom, fact and rule as text."""
    for triple in (*base.content.triples, *base.model.triples()):
        yield _triple(base, triple)
    yield from _structure(base)
    for rule in base.rules:
        yield f"rule {rule.name}: {rule.text}" + ("" if rule.enabled else " (switched off)")


def _triple(base: Ontology, triple: Triple) -> str:
    if is_fact(triple):
        return str(fact_of(triple, base.names))
    subject, predicate, value = triple
    shown = literal_text(value) if isinstance(value, Lit) else base.names.short(value)
    if predicate == RDF_TYPE:
        return f"{shown}({base.names.short(subject)})"
    return f"{base.names.short(subject)} {local_name(predicate)} {shown}"


def _structure(base: Ontology) -> Iterator[str]:
    """Axioms with class expressions: what has no name is written out in brackets."""
    graph = rdflib.Graph().parse(data="".join(base.content.structure), format="nt")

    def text(node: Node, above: frozenset[Node]) -> str:
        if not isinstance(node, rdflib.BNode):
            term = term_of(node)
            return literal_text(term) if isinstance(term, Lit) else base.names.short(term)
        if node in above:
            return "[...]"
        parts = sorted(
            f"{local_name(str(predicate))} {text(value, above | {node})}"
            for predicate, value in graph.predicate_objects(node)
        )
        return f"[{'; '.join(parts)}]"

    for subject in sorted(set(graph.subjects()), key=str):
        if not isinstance(subject, rdflib.BNode):
            for predicate, value in graph.predicate_objects(subject):
                yield f"{text(subject, frozenset())} {local_name(str(predicate))} {text(value, frozenset({subject}))}"
        elif (None, None, subject) not in graph:  # else it is part of another one
            yield text(subject, frozenset())


@dataclass(frozen=True)
class CasePair:
    """One kind of state, as both knowledge bases decide it."""

    one: PolicyCase
    other: PolicyCase

    @property
    def functions(self) -> tuple[str, ...]:
        """Functions whose grounding is decided differently."""
        return tuple(name for name in self.one.asked if self.one.outcome(name) != self.other.outcome(name))


@dataclass(frozen=True)
class PolicyDifference:
    """The difference between two policies.

    Attributes:
        compared: number of states that both have.
        differing: kinds of states that they decide differently.
        reported: kinds in which they decide alike, but infer different statuses.
        only_one: function designs that only the first has; likewise only_other.
        without_designs: (A or B, function) for each function that has designs in the other one only.
        computing: rules that compute with numbers; if there are any, the ranges are samples and prove nothing.
    """

    compared: int
    differing: tuple[CasePair, ...] = field(repr=False)
    reported: tuple[CasePair, ...] = field(repr=False)
    only_one: tuple[str, ...]
    only_other: tuple[str, ...]
    without_designs: tuple[tuple[str, str], ...]
    computing: tuple[str, ...]

    @property
    def states(self) -> int:
        """Number of states that are decided differently."""
        return sum(pair.one.reports.combinations for pair in self.differing)

    @property
    def states_reported(self) -> int:
        """Number of states in which only statuses differ."""
        return sum(pair.one.reports.combinations for pair in self.reported)

    def lines(self) -> Iterator[str]:
        """The difference as `kb diff` prints it."""
        are = "is" if self.states == 1 else "are"
        yield f"{self.states} of {self.compared} states {are} decided differently"
        if self.reported:
            yield f"{self.states_reported} more have other statuses, but the same decisions"
        if self.computing:
            yield no_proof(self.computing)
        for which, designs in (("A", self.only_one), ("B", self.only_other)):
            if designs:
                yield f"only {which} has {', '.join(designs)}"
        for which, function in self.without_designs:
            yield f"{function} has no design in {which}"
        groups: dict[str, list[CasePair]] = {}
        for pair in self.differing:
            for name in pair.functions or pair.one.asked:
                before, after = (case.outcome_text(name) for case in (pair.one, pair.other))
                groups.setdefault(f"{name}, now {pair.one.present(name)}: A {before}, B {after}", []).append(pair)
        for heading, pairs in groups.items():
            yield heading
            for ranges, states in _joined(pairs):
                yield f"  {'; '.join(map(str, ranges))}: {number_of(states, 'state')}"
            yield f"  for instance {pairs[0].one.state}"


def compare_policies(one: Policy, other: Policy) -> PolicyDifference:
    """Compare two policies over the same space."""
    there = {(case.ranges, case.state, case.asked): case for case in other.cases}
    pairs = [
        CasePair(case, there[case.ranges, case.state, case.asked])
        for case in one.cases
        if (case.ranges, case.state, case.asked) in there
    ]
    designs = [{design for case in policy.cases for _, design in case.state.groundings} for policy in (one, other)]
    differing: list[CasePair] = []
    alike: list[CasePair] = []
    for pair in pairs:
        (differing if pair.functions or pair.one.marks != pair.other.marks else alike).append(pair)
    return PolicyDifference(
        compared=sum(pair.one.reports.combinations for pair in pairs),
        differing=tuple(differing),
        reported=tuple(pair for pair in alike if pair.one.statuses != pair.other.statuses),
        only_one=tuple(sorted(designs[0] - designs[1])),
        only_other=tuple(sorted(designs[1] - designs[0])),
        without_designs=tuple(
            (which, function)
            for which, policy in (("A", one), ("B", other))
            for function in policy.functions
            if not any(function in dict(case.state.groundings) for case in policy.cases)
        ),
        computing=tuple(sorted({*one.computing, *other.computing})),
    )


def _joined(pairs: Sequence[CasePair]) -> list[tuple[tuple[ValueRange, ...], int]]:
    """Ranges of measured values with the number of states; neighbouring ranges of a single attribute are joined."""
    counts: dict[tuple[ValueRange, ...], int] = {}
    for pair in pairs:
        counts[pair.one.ranges] = counts.get(pair.one.ranges, 0) + pair.one.reports.combinations
    joined: list[tuple[tuple[ValueRange, ...], int]] = []
    for ranges, states in counts.items():
        last = joined[-1][0] if joined else ()
        if len(ranges) == len(last) == 1 and last[0].high == ranges[0].low is not None:
            joined[-1] = (last[0].joined(ranges[0]),), joined[-1][1] + states
        else:
            joined.append((ranges, states))
    return joined


@dataclass(frozen=True)
class PairedDifference:
    """One metric of the same missions under two knowledge bases.

    Attributes:
        metric: column of runs.csv.
        one, other: means.
        difference: mean of other - one, run by run.
        interval: its 95% interval (Student's t); None where no mission differs, or there is one.
        changed: number of missions in which the metric differs.
    """

    metric: str
    one: float
    other: float
    difference: float
    interval: Interval | None
    changed: int


@dataclass(frozen=True)
class MissionDifference:
    """Missions under two knowledge bases, with common random numbers.

    Attributes:
        missions: number of pairs.
        changed: run numbers of the missions in which any column of runs.csv differs.
        metrics: what differs on average.
        extremes: (run, metric, value with one, value with the other): the largest change each way of each metric.
    """

    missions: int
    changed: tuple[int, ...]
    metrics: tuple[PairedDifference, ...]
    extremes: tuple[tuple[int, str, float, float], ...]

    def lines(self) -> Iterator[str]:
        """Which missions change most, as `kb diff` prints it below its table."""
        for run, metric, before, after in self.extremes:
            name, _, unit = METRICS[metric].partition(", ")
            yield f"  run {run}: {name} {before:.1f} {unit} -> {after:.1f} {unit}"


@dataclass(frozen=True)
class MissionsToCompare:
    """Which missions to run.

    Attributes:
        scenario: name or path.
        runs: number of missions with each knowledge base.
        seed: of everything that is random.
        workers: processes.
    """

    scenario: str
    runs: int
    seed: int = 1
    workers: int = 1


def compare_missions(
    missions: MissionsToCompare, one: Replacements, other: Replacements, on_progress: OnProgress | None = None
) -> MissionDifference:
    """Run the same missions with two knowledge bases, and compare them pair by pair.

    Args:
        missions: which.
        one, other: ontologies, rules and values of the scenario, as load_scenario takes them.
        on_progress: called when missions are done.

    Raises:
        InputError: something cannot be used, or missions fail.
    """
    from suave_des.campaign.campaign import run_campaign

    frames = []
    for replacements in (one, other):
        result = run_campaign(
            missions.scenario,
            [_MANAGER],
            missions.runs,
            missions.seed,
            missions.workers,
            on_progress=on_progress,
            **replacements,
        )
        frames.append(result.frame().set_index("run"))
    before, after = frames
    runs = before.index.intersection(after.index)
    if len(runs) < missions.runs:
        raise InputError(
            f"{missions.runs - len(runs)} of {missions.runs} missions failed",
            remedy="suave-des campaign with the same files says why",
        )
    return _compared(before.loc[runs], after.loc[runs])


def _compared(before: pandas.DataFrame, after: pandas.DataFrame) -> MissionDifference:
    from suave_des.report.statistics import mean_interval

    differs = (before.ne(after) & ~(before.isna() & after.isna())).any(axis=1)
    metrics = []
    extremes: dict[tuple[int, str], tuple[int, str, float, float]] = {}
    for name in METRICS:
        x, y = before[name].to_numpy(float), after[name].to_numpy(float)
        change = y - x
        estimated = mean_interval(change)
        metrics.append(
            PairedDifference(
                name,
                float(x.mean()),
                float(y.mean()),
                estimated.value,
                estimated.interval,
                int((change != 0.0).sum()),
            )
        )
        for place in (int(change.argmin()), int(change.argmax())):
            if change[place]:
                run = int(before.index[place])
                extremes[run, name] = (run, name, float(x[place]), float(y[place]))
    return MissionDifference(
        len(before), tuple(int(run) for run in before.index[differs]), tuple(metrics), tuple(extremes.values())
    )
