"""The knowledge base: ontologies, rules and a reasoner that answer questions, those in SPARQL
too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import rdflib
from rdflib.namespace import RDFS

from suave_des.arguments import plain_arguments
from suave_des.errors import InputError, nearest
from suave_des.kb.deciding import decide_all
from suave_des.kb.difference import PolicyDifference, compare_decisions
from suave_des.kb.explain import Explainer, Explanation
from suave_des.kb.matching import tracing_pellet
from suave_des.kb.policy import Policy, make_policy
from suave_des.kb.situations import OnCount, Outcome, Situation
from suave_des.kb.space import PolicySpace, States
from suave_des.kb.states import ManagingSettings, StateBuilder
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TIME_LIMIT_S, TimeLimit, reasoning_on
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.rdf import PREFIXES, Triple, fact_of, n_triple
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.rules import IDENTITIES
from suave_des.knowledge.state import (
    ContradictionError,
    Fact,
    KnowledgeState,
    NumberLike,
    Reasoning,
)
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base

if TYPE_CHECKING:  # or every command of kb would load the parser
    from rdflib.plugins.sparql.sparql import Query
    from rdflib.query import Result

_UNNAMED = re.compile(r"(?<![^\s])_:([A-Za-z0-9]+)(?=\s)")
_MODEL_NAME = re.compile(r"\b(?:suave|tomasys|mros):\w(?:[\w.-]*\w)?")
_PREFIXES = {
    name: PREFIXES[name]
    for name in ("suave", "tomasys", "mros", "rdf", "rdfs", "owl", "xsd", "swrl")
}


@dataclass(frozen=True)
class QueryResult:
    """A table of answers.

    Attributes:
        columns: names of the variables; "answer" for ASK; subject, predicate, object for CONSTRUCT
            and DESCRIBE.
        rows: texts, sorted unless the query orders them; known namespaces as prefixes; None for an
            unbound variable.
        unknown: names in the query that the knowledge base does not have, each with the nearest one
            in parentheses.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str | None, ...], ...]
    unknown: tuple[str, ...] = ()


def _several(given: str | Path | Sequence[str | Path]) -> Sequence[str | Path]:
    return [given] if isinstance(given, str | Path) else given


@dataclass(frozen=True, eq=False)
class KnowledgeBase:
    """Ontologies and rules with a reasoner, and the settings of the managing subsystem that uses
    them.

    Attributes:
        base: the ontologies and rules.
        settings: what the managing subsystem does in addition to the rules.
        reasoner: name of the reasoner.
        limit: of the reasoner's time for one state.

    Example:
        >>> knowledge = KnowledgeBase.load(rules="spare.swrl")
        >>> state = knowledge.state(measurements={"water_visibility": 1.8})
        >>> for decision in knowledge.infer(state).plan.decisions:
        ...     print(decision.function, decision.design)
    """

    base: Ontology
    settings: ManagingSettings
    reasoner: str
    limit: TimeLimit = field(repr=False)

    @classmethod
    @plain_arguments
    def load(
        cls,
        ontologies: str | Path | Sequence[str | Path] = (),
        *,
        scenario: str | Path = DEFAULT_SCENARIO,
        reasoner: str | None = None,
        rules: str | Path | Sequence[str | Path] = (),
        disabled_rules: str | Sequence[str] = (),
        values: Mapping[str, object] | None = None,
        time_limit_s: float = TIME_LIMIT_S,
    ) -> KnowledgeBase:
        """Read ontologies and start a reasoner on them.

        Args:
            ontologies: files, or one; without any, those of the scenario.
            scenario: a scenario file, or the name of a shipped one: its ontologies, overridden
                values, measured attributes, and the behaviour of its revision.
            reasoner: in place of the scenario's.
            rules: files of rules as text, in addition to the scenario's.
            disabled_rules: names of rules to disable.
            values: new values of the scenario by key path, as of `with_values`.
            time_limit_s: for each inference.

        Raises:
            InputError: a file or name cannot be used.
            KnowledgeError: the ontologies cannot be reasoned with.
        """
        loaded = load_scenario(
            scenario,
            ontologies=_several(ontologies),
            reasoner=reasoner,
            rules=_several(rules),
            disabled_rules=[disabled_rules] if isinstance(disabled_rules, str) else disabled_rules,
            values=values or {},
        )
        reasoner = loaded.scenario.knowledge.reasoner
        limit = TimeLimit(time_limit_s, "--time-limit")
        return cls.of(open_base(loaded), ManagingSettings.of(loaded.scenario), reasoner, limit)

    @classmethod
    def of(
        cls, base: Ontology, settings: ManagingSettings, reasoner: str, limit: TimeLimit
    ) -> KnowledgeBase:
        """Start a reasoner on ontologies that are loaded already."""
        made = cls(base, settings, reasoner, limit)
        _ = made._reasoner  # what cannot be reasoned with is reported here
        return made

    def changed(self, base: Ontology) -> KnowledgeBase:
        """Return the same with ontologies or rules changed in this process: the cache on disk knows
        files only.

        Raises:
            KnowledgeError: Pellet cannot use them.
        """
        return KnowledgeBase.of(base, self.settings, "pellet", self.limit)

    @cached_property
    def _reasoner(self) -> Reasoner:
        return Reasoner(self.base, self.reasoner, self.limit)

    @cached_property
    def _with_all_terms(self) -> Reasoner:
        return Reasoner(self.base, self.reasoner, self.limit, self.base.content.all_terms())

    @cached_property
    def _tracing_pellet(self) -> InProcessPellet:
        return tracing_pellet(self.base)

    def decide(self, state: KnowledgeState, facts: tuple[Triple, ...] = ()) -> Reasoning:
        """Decide as a mission does: infer the terms on which decisions depend and those that rules
        assert, and plan.

        The facts are assertions in addition to those of the state.

        Raises:
            KnowledgeError: the state contradicts the ontologies, planning needs what they do not
                say, or the reasoner takes too long.
        """
        return self._reasoner.analyze_and_plan(
            state, facts, improve_exceeded=self.settings.improves_exceeded
        )

    def outcome(self, situation: Situation) -> Outcome:
        """Decide as `decide` does, in a situation that may contradict itself."""
        try:
            return Outcome(self.decide(situation.state, situation.facts))
        except ContradictionError as error:
            return Outcome(None, error.problem.removeprefix("contradiction: "))

    @plain_arguments
    def state(
        self,
        file: str | Path | None = None,
        *,
        measurements: Mapping[str, NumberLike] | None = None,
        components: Mapping[str, str] | None = None,
        groundings: Mapping[str, str] | None = None,
        objectives: str | Iterable[str] | Mapping[str, str | None] = (),
    ) -> KnowledgeState:
        """Build a state, with its names checked.

        Args:
            file: YAML with any of objectives, groundings, components, measurements; the other
                arguments replace what it says.
            measurements: measured value by quality attribute type.
            components: c_status by component.
            groundings: function design by function.
            objectives: functions, or o_status by function; None: UNGROUNDED without a grounding,
                else no status. Without objectives, the state has those of the groundings, else
                those of the search task.

        Raises:
            InputError: a name is unknown, or a value makes no sense.
        """
        if not isinstance(objectives, Mapping):
            objectives = dict.fromkeys([objectives] if isinstance(objectives, str) else objectives)
        builder = StateBuilder(self.base, self.settings)
        if file is not None:
            builder.add_file(Path(file))
        parts = {
            "measurements": measurements,
            "components": components,
            "groundings": groundings,
            "objectives": objectives,
        }
        for kind, given in parts.items():
            for name, value in (given or {}).items():
                builder.add(kind, name, value)
        return builder.state()

    def infer(self, state: KnowledgeState) -> Reasoning:
        """Infer all that follows in a state, from rules and axioms, and plan on it.

        Raises:
            KnowledgeError: the state contradicts the ontologies, or the reasoner takes too long.
        """
        return self._with_all_terms.analyze_and_plan(
            state, improve_exceeded=self.settings.improves_exceeded
        )

    def identities(self, state: KnowledgeState) -> tuple[Fact, ...]:
        """Infer which individuals are the same, and which are different, by rules; each pair once.

        Raises:
            KnowledgeError: as infer.
        """
        if not any(atom.predicate in IDENTITIES for atom in self.base.content.conclusions):
            return ()
        given = self.base.assertions(state)

        def by_rules() -> set[Triple]:
            without = InProcessPellet(self.base.with_rules(()), self.base.content.all_terms())
            return self._tracing_pellet.identities(given) - without.identities(given)

        facts = {
            fact_of((min(one, str(other)), name, max(one, str(other))), self.base.names)
            for one, name, other in self.limit.run(by_rules, reasoning_on(state))
            if one != other
        }
        return tuple(sorted(facts, key=str))

    @plain_arguments
    def explain(self, state: KnowledgeState, question: str = "") -> Explanation:
        """Explain why a fact or a decision follows in a state.

        Args:
            question: a fact such as "fg_status(fg_spiral_high, IN_ERROR_NFR)", "why fd_spiral_low?"
                or "why not fd_spiral_high?"; empty: all that is inferred and decided.

        Raises:
            InputError: the question is none of these, or names what the knowledge base does not
                have.
            KnowledgeError: the state contradicts the ontologies, or the reasoner takes too long.
        """
        reasoning = self.infer(state)
        return self.limit.run(
            lambda: Explainer(self.base, reasoning, self._tracing_pellet).answer(question),
            f"explaining the state {state}",
        )

    def policy(
        self,
        max_failed: int = 2,
        on_count: OnCount = lambda done, total: None,
        space: PolicySpace | None = None,
    ) -> Policy:
        """Decide every state, with at most `max_failed` components that report a status.

        Args:
            on_count: called with how many kinds of states have been inferred, first 0, and how many
                have to be.
            space: what to tell apart; None: what can have an effect.

        Raises:
            InputError: there would be too many states.
            KnowledgeError: the reasoner takes too long for one of them.
        """
        states = States.of(self.base, self.settings, max_failed, space or self.space)
        decided = decide_all(self.base, states, self.outcome, on_count)
        return make_policy(self.base, self.settings, states, max_failed, decided, self.outcome)

    @cached_property
    def space(self) -> PolicySpace:
        """What its policy tells apart."""
        return PolicySpace.of(self.base, self.settings)

    def diff(
        self,
        other: KnowledgeBase,
        max_failed: int = 2,
        on_count: OnCount = lambda done, total: None,
    ) -> PolicyDifference:
        """Find the states that another knowledge base decides differently, over all states that
        either distinguishes.

        `on_count` is called as by `policy`, for this one and then for the other.

        Raises:
            InputError: there would be too many states.
            KnowledgeError: the reasoner takes too long for one of them.
        """
        both = self, other
        space = self.space.union(other.space)
        one, two = (States.of(each.base, each.settings, max_failed, space) for each in both)
        states = one.shared(two)
        before, after = (decide_all(each.base, states, each.outcome, on_count) for each in both)
        return compare_decisions(states, before, after, [each.base for each in both])

    @plain_arguments
    def query(
        self, text: str, state: KnowledgeState | None = None, *, inferred: bool = False
    ) -> QueryResult:
        """Answer a query in SPARQL.

        Args:
            text: SELECT, ASK, CONSTRUCT or DESCRIBE. The prefixes suave, tomasys, mros, rdf, rdfs,
                owl, xsd and swrl need no declaration.
            state: adds what it asserts; None: the ontologies alone.
            inferred: adds what Pellet infers.

        Raises:
            InputError: it is not a query, or would read something else than the knowledge base.
            KnowledgeError: the state contradicts itself, or it takes too long.
        """
        graph = self.limit.run(
            lambda: graph_of(self.base, state, inferred=inferred), "answering the query"
        )
        return answer(graph, text)


def graph_of(base: Ontology, state: KnowledgeState | None, *, inferred: bool) -> rdflib.Graph:
    """Return the graph that queries are answered from, with labels and comments; see
    KnowledgeBase.query.
    """
    situation = () if state is None else base.assertions(state)
    more: Iterable[Triple] = (
        InProcessPellet(base, base.content.all_terms()).infer(situation) if inferred else ()
    )
    # in the order in which they came: an answer with LIMIT is always the same
    graph = rdflib.Graph("SimpleMemory")
    lines = base.content.n_triples(base.content.rules) + "".join(map(n_triple, (*situation, *more)))
    names = {name: rdflib.BNode(name) for name in _UNNAMED.findall(lines)}
    graph.parse(data=lines, format="nt", bnode_context=names)
    for source in base.sources:
        for predicate in (RDFS.label, RDFS.comment):
            for subject, value in sorted(source.graph.subject_objects(predicate)):
                if isinstance(subject, rdflib.URIRef):
                    graph.add((subject, predicate, value))
    for prefix, namespace in _PREFIXES.items():
        graph.bind(prefix, namespace, override=True, replace=True)
    return graph


def answer(graph: rdflib.Graph, text: str) -> QueryResult:
    """Answer a query from a graph of graph_of; see KnowledgeBase.query."""
    query = _parsed(text)
    unknown = tuple(_unknown(graph, text))
    try:
        result = graph.query(query)
        if result.type == "ASK":
            return QueryResult(("answer",), ((str(result.askAnswer).lower(),),), unknown)
        columns, answers = _answers(result, text)
        rows = [tuple(map(partial(_text, graph), each)) for each in answers]
    except Exception as error:  # evaluation raises whatever the functions of the query raise
        raise InputError(f"the query cannot be answered: {' '.join(str(error).split())}") from None
    if result.type != "SELECT" or "OrderBy" not in str(query.algebra):
        rows.sort(key=lambda row: [cell or "" for cell in row])
    return QueryResult(tuple(columns), tuple(rows), unknown)


def _answers(result: Result, text: str) -> tuple[list[str], Iterable[Iterable[object]]]:
    """The columns of the answers, and their rows."""
    if result.type != "SELECT":
        return ["subject", "predicate", "object"], result.graph or ()
    names = list(map(str, result.vars or ()))
    if "*" in text.partition("{")[0]:  # which rdflib returns in any order
        names.sort()
    rows = []
    for row in result:
        rows.append([row[name] for name in names])  # type: ignore
    return names, rows


def _parsed(text: str) -> Query:
    """Parse a query that reads the knowledge base only."""
    from rdflib.plugins.sparql import prepareQuery

    try:
        query = prepareQuery(text, initNs=_PREFIXES)
    except Exception as error:  # the parser raises many kinds; each means that this is not a query
        reason = " ".join(str(error).split()) or type(error).__name__
        remedy = "for instance SELECT ?d WHERE { ?d tomasys:solvesF ?f }"
        raise InputError(f"not a SPARQL query: {reason}", remedy=remedy) from None
    if "ServiceGraphPattern" in str(query.algebra) or query.algebra.get("datasetClause"):
        remedy = "remove them: only the knowledge base can be queried"
        raise InputError("SERVICE and FROM read from other sources", remedy=remedy)
    return query


def _unknown(graph: rdflib.Graph, text: str) -> Iterator[str]:
    """Yield the names of the models' namespaces in a query that no triple has, with the nearest one
    that some has.
    """
    known = {str(_text(graph, each)) for each in (*graph.all_nodes(), *graph.predicates())}
    for name in sorted({*_MODEL_NAME.findall(text)} - known):
        near = nearest(name, known)
        yield f"{name} ({near})" if near else name


def _text(graph: rdflib.Graph, term: object) -> str | None:
    if term is None:
        return None
    if isinstance(term, rdflib.URIRef):
        return graph.namespace_manager.normalizeUri(term).strip("<>")
    return f"_:{term}" if isinstance(term, rdflib.BNode) else str(term)
