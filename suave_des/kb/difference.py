"""Compare two knowledge bases: their axioms and rules as text, what they decide in every state, and
the same missions; or decision tables.

Campaigns and statistics are imported when missions are compared: a knowledge base needs neither.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

import rdflib
from rdflib.term import Node

from suave_des.errors import InputError, number_of
from suave_des.estimates import Estimate
from suave_des.kb.matching import Probes
from suave_des.kb.situations import Decide, Situation, compare
from suave_des.kb.space import PolicySpace, States, add_decisions
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.rdf import (
    RDF_TYPE,
    SWRL,
    Lit,
    Triple,
    fact_of,
    is_fact,
    local_name,
    n_triple,
)
from suave_des.knowledge.rdf_files import term_of
from suave_des.knowledge.reasoner import regions_of
from suave_des.knowledge.rules import write_term
from suave_des.knowledge.state import KnowledgeState
from suave_des.records.metrics import DISTANCE, SEARCH_TIME, Metric, metric_of
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.scenario_knowledge import open_base
from suave_des.tables import Table

if TYPE_CHECKING:
    import pandas

#: Metrics of missions that are always compared; others are where they differ.
COMPARED_METRICS = (SEARCH_TIME, DISTANCE)
_MANAGER = "metacontrol"
#: Numbers of missions that are listed.
_MOST_RUNS = 10
_PLACES = ("initial_", "detection_")


def compare_axioms(one: Ontology, other: Ontology) -> tuple[list[str], list[str]]:
    """Compare the axioms, facts and rules of two knowledge bases; labels and comments do not count.

    Returns:
        as text, what only the first has, and what only the second has.
    """
    before, after = frozenset(_axioms(one)), frozenset(_axioms(other))
    return sorted(before - after), sorted(after - before)


def _axioms(base: Ontology) -> Iterator[str]:
    """Write every axiom, fact and rule as text; what a rule consists of is no axiom of its own."""
    for triple in (*base.content.triples, *chain.from_iterable(base.model.own.values())):
        if not str(triple[2]).startswith(SWRL):
            yield _triple(base, triple)
    yield from _structure(base)
    for rule in base.rules:
        yield f"rule {rule.name}: {rule.text}" + ("" if rule.enabled else " (switched off)")


def _triple(base: Ontology, triple: Triple) -> str:
    if is_fact(triple):
        return str(fact_of(triple, base.names))
    subject, predicate, value = triple
    shown = write_term(value) if isinstance(value, Lit) else base.names.short(value)
    if predicate == RDF_TYPE:
        return f"{shown}({base.names.short(subject)})"
    return f"{base.names.short(subject)} {local_name(predicate)} {shown}"


def _structure(base: Ontology) -> Iterator[str]:
    """Axioms with class expressions: what has no name is written out in brackets."""
    graph = rdflib.Graph().parse(data="".join(map(n_triple, base.content.structure)), format="nt")

    def text(node: Node, above: frozenset[Node]) -> str:
        if not isinstance(node, rdflib.BNode):
            term = term_of(node)
            return write_term(term) if isinstance(term, Lit) else base.names.short(term)
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


@dataclass(frozen=True, eq=False)
class PolicyDifference:
    """The difference between two policies.

    Attributes:
        compared: number of states that both have.
        cells: a row for each kind of state that is decided differently: the columns of a policy's
            cases that tell it from others; `statuses` and what happens, `_then`, of both, with `_a`
            and `_b` at the end; one such `state`.
        reported: number of states in which they decide alike, but infer different statuses.
        functions: that have an objective.
        no_proof: why rules may do more than compare; if there are any reasons, the ranges are
            samples only.
    """

    compared: int
    cells: pandas.DataFrame = field(repr=False)
    reported: int
    space: PolicySpace
    functions: tuple[str, ...]
    no_proof: tuple[str, ...]

    @property
    def states(self) -> int:
        """Number of states that are decided differently."""
        return int(self.cells["states"].sum())

    def lines(self) -> Iterator[str]:
        """The difference as `kb diff` prints it."""
        yield f"{self.states} of {self.compared} states {'is' if self.states == 1 else 'are'} decided differently"
        if self.reported:
            yield f"{self.reported} more have other statuses, but the same decisions"
        yield from (
            f"{reason}: each range was tried with one value only" for reason in self.no_proof
        )
        groups = defaultdict(list)
        for number, case in enumerate(self.cells.to_dict("records")):
            for name in self.functions:
                one, other = case[f"{name}_then_a"], case[f"{name}_then_b"]
                if one != other:
                    heading = f"{name}, now {case[f'{name}_now']}: A {one}, B {other}"
                    groups[heading].append(number)
        for heading, numbers in groups.items():
            yield heading
            cells = self.cells.iloc[numbers]
            yield from (f"  {text}" for text in self._ranges(cells))
            yield f"  for instance {cells['state'].iloc[0]}"

    def _ranges(self, cells: pandas.DataFrame) -> Iterator[str]:
        """The ranges of measured values, neighbours joined, and the number of states in each."""
        names = self.space.attributes
        scale = self.space.scale
        for box, number in sorted(_boxes(cells, names).items()):
            words = [
                f"{name} {scale.text(*span)}" if len(names) > 1 else scale.text(*span)
                for name, span in zip(names, box, strict=True)
                if span != (0, len(scale) - 1)
            ]
            yield f"{'; '.join(words) or 'whatever is measured'}: {number_of(number, 'state')}"


#: First and last place of each attribute.
_Box = tuple[tuple[int, int], ...]


def _boxes(cells: pandas.DataFrame, names: Sequence[str]) -> dict[_Box, int]:
    """The number of states in each box of measured values, neighbours joined."""
    boxes = Counter[_Box]()
    for *places, number in cells[[*names, "states"]].itertuples(index=False):
        boxes[tuple((place, place) for place in places)] += number
    for at in reversed(range(len(names))):
        # first place and number of states by all other ends
        joined: dict[Any, tuple[int, int]] = {}
        for box, number in sorted(boxes.items(), key=lambda each: each[0][at]):
            first, last = box[at]
            first, before = joined.pop((box[:at], first - 1, box[at + 1 :]), (first, 0))
            joined[box[:at], last, box[at + 1 :]] = first, before + number
        boxes = Counter(
            {(*a, (first, last), *b): number for (a, last, b), (first, number) in joined.items()}
        )
    return boxes


def compare_decisions(
    states: States, one: Decide, other: Decide, bases: Iterable[Ontology], *, infer: bool = True
) -> PolicyDifference:
    """Compare what two knowledge bases decide in all of some states; see PolicyDifference.

    Args:
        bases: in whose rules reasons are looked for to do more than compare.
        infer: whether both infer statuses, which are compared then.
    """
    differing = []
    of_one = []
    of_other = []
    reported = 0
    for situation, before, after in compare(one, other, map(Situation, states)):
        state = situation.state
        if any(before.choice(name) != after.choice(name) for name, *_ in state.objectives):
            differing.append(state)
            of_one.append(before)
            of_other.append(after)
        elif infer and before.statuses != after.statuses:
            reported += states.reports[state.components]
    cells = states.frame(differing)
    add_decisions(cells, states, of_one, "_a")
    add_decisions(cells, states, of_other, "_b")
    cells["state"] = differing
    compared = len(states.measured) * len(states.tasks) * sum(states.reports.values())
    reasons = chain.from_iterable(regions_of(base).reasons for base in bases)
    no_proof = tuple(dict.fromkeys(reasons))
    return PolicyDifference(compared, cells, reported, states.space, states.functions, no_proof)


class MissionDifference(NamedTuple):
    """Missions under two knowledge bases, with common random numbers.

    Attributes:
        changed: run numbers of the missions in which any column of runs.csv differs.
        metrics: search time, distance, and what else differs: each with its values with one (`a`)
            and with the other (`b`), by run, where both are known; the mean of b - a, run by run,
            with its 95% interval (Student's t); and the number of missions in which it differs.
    """

    missions: int
    changed: tuple[int, ...]
    metrics: tuple[tuple[Metric, pandas.DataFrame, Estimate, int], ...]

    def table(self, decisions: PolicyDifference) -> Table:
        """Decisions and missions in one table."""
        rows: list[tuple[str, ...]] = [
            ("decisions", "", "", "", "", f"{decisions.states} of {decisions.compared} states"),
            ("missions", "", "", "", "", f"{len(self.changed)} of {self.missions}"),
        ]
        for metric, pairs, found, changed in self.metrics:
            values = [*(f"{each:.2f}" for each in pairs.mean()), f"{found.value:+.2f}"]
            rows.append(
                (metric.brief, *values, found.text("+.2f"), f"{changed} of {self.missions}")
            )
        return Table(("", "A", "B", "B - A", "95% interval", "different"), rows)

    def lines(self) -> Iterator[str]:
        """Which missions differ."""
        more = len(self.changed) - _MOST_RUNS
        numbers = ", ".join(map(str, self.changed[:_MOST_RUNS]))
        yield f"runs that differ: {numbers}" + (f" and {more} more" if more > 0 else "")


def compare_missions(
    scenario: str,
    runs: int,
    one: Replacements,
    other: Replacements,
    *,
    managers: Sequence[str] = (_MANAGER, _MANAGER),
    **campaign: Any,
) -> MissionDifference:
    """Run the same missions with two knowledge bases or tables, and compare them pair by pair.

    Args:
        scenario: name or path.
        runs: number of missions with each knowledge base.
        one, other: ontologies, rules and values of the scenario, as load_scenario takes them.
        managers: the manager with each.
        campaign: seed, workers and on_progress, as run_campaign takes them; one worker by default.

    Raises:
        InputError: something cannot be used, or missions fail.
    """
    from suave_des.campaign.campaign import run_campaign

    frames = []
    for manager, replacements in zip(managers, (one, other), strict=True):
        result = run_campaign(
            scenario, [manager], runs, **{"workers": 1, **campaign}, **replacements
        )
        frames.append(result.frame().drop(columns="manager").set_index("run"))
    before, after = frames
    common = before.index.intersection(after.index)
    if len(common) < runs:
        remedy = "suave-des campaign with the same files says why"
        raise InputError(f"{runs - len(common)} of {runs} missions failed", remedy=remedy)
    return paired(before.loc[common], after.loc[common])


def firing_states(
    scenario: str, runs: int, one: Replacements, other: Replacements, *, seed: int, limit: TimeLimit
) -> tuple[int, int]:
    """Count the states of missions with one knowledge base in which a rule fires that only one of
    the two has.

    Returns:
        how many states, and of how many.
    """
    from suave_des.api import run_mission

    loaded = [load_scenario(scenario, **replacements) for replacements in (one, other)]
    bases = list(map(open_base, loaded))
    ours, theirs = ({rule.text: rule.body for rule in base.content.enabled_rules} for base in bases)
    differing = [(ours | theirs)[text] for text in ours.keys() ^ theirs.keys()]
    probes = Probes(bases[1], limit, differing)
    regions = regions_of(bases[1])
    missions = (run_mission(loaded[0], _MANAGER, run, seed) for run in range(1, runs + 1))
    alike = defaultdict[Hashable, list[KnowledgeState]](list)
    for record in chain.from_iterable(mission.knowledge for mission in missions):
        alike[regions.key(record.state)].append(record.state)
    firing = [states for states in alike.values() if probes.holding(Situation(states[0]))]
    return sum(map(len, firing)), sum(map(len, alike.values()))


def paired(before: pandas.DataFrame, after: pandas.DataFrame) -> MissionDifference:
    """Compare rows of runs.csv with the same run numbers, which are their index."""
    import pandas

    from suave_des.results.statistics import mean_interval

    differs = before.ne(after) & ~(before.isna() & after.isna())
    numbers = map(str, before.select_dtypes("number"))
    others = [each for each in numbers if differs[each].any() and not each.startswith(_PLACES)]
    metrics = []
    for name in dict.fromkeys((*COMPARED_METRICS, *others)):
        pairs = pandas.DataFrame({"a": before[name], "b": after[name]}, dtype=float).dropna()
        metric = metric_of(name) or Metric(name, name.replace("_", " "))
        found = mean_interval((pairs["b"] - pairs["a"]).to_numpy())
        metrics.append((metric, pairs, found, int(differs[name].sum())))
    return MissionDifference(
        len(before), tuple(int(run) for run in before.index[differs.any(axis=1)]), tuple(metrics)
    )
