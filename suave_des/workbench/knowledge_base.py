"""The knowledge base: ontologies, rules and a reasoner that answer questions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from suave_des.knowledge.deliberation import Conclusion, Deliberation
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.limit import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.state import KnowledgeState, Number
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base
from suave_des.workbench.difference import PolicyDifference, compare_policies
from suave_des.workbench.policy.cases import OnCount, Policy, make_policy
from suave_des.workbench.policy.space import PolicySpace
from suave_des.workbench.query import QueryResult, answer, graph_of
from suave_des.workbench.reasons.explain import Explanation, explain
from suave_des.workbench.state_input import ManagingSettings, StateBuilder


def _several(given: str | Path | Sequence[str | Path]) -> Sequence[str | Path]:
    return [given] if isinstance(given, str | Path) else given


@dataclass(frozen=True, eq=False)
class KnowledgeBase:
    """Ontologies and rules with a reasoner, and the settings of the managing subsystem that uses them.

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
    def load(
        cls,
        ontologies: str | Path | Sequence[str | Path] = (),
        *,
        scenario: str | Path = DEFAULT_SCENARIO,
        reasoner: str | None = None,
        rules: str | Path | Sequence[str | Path] = (),
        disabled_rules: str | Sequence[str] = (),
        values: Mapping[str, Any] | None = None,
        time_limit_s: float = TIME_LIMIT_S,
    ) -> KnowledgeBase:
        """Read ontologies and start a reasoner on them.

        Args:
            ontologies: files, or one; without any, those of the scenario.
            scenario: a scenario file, or the name of a shipped one: its ontologies, overridden values, measured
                attributes, and the behaviour of its revision.
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
    def of(cls, base: Ontology, settings: ManagingSettings, reasoner: str, limit: TimeLimit) -> KnowledgeBase:
        """Start a reasoner on ontologies that are loaded already."""
        made = cls(base, settings, reasoner, limit)
        _ = made._deliberation  # what cannot be reasoned with is reported here
        return made

    @cached_property
    def _deliberation(self) -> Deliberation:
        return Deliberation(self.base, make_reasoner(self.reasoner, self.base, self.limit))

    @cached_property
    def _with_all_terms(self) -> Deliberation:
        terms = self.base.content.all_terms()
        return Deliberation(self.base, make_reasoner(self.reasoner, self.base, self.limit, terms))

    def decide(self, state: KnowledgeState) -> Conclusion:
        """Decide as a mission does: infer the terms on which decisions depend and those that rules assert, and plan.

        Raises:
            KnowledgeError: the state contradicts the ontologies, or the reasoner takes too long.
        """
        return self._deliberation.analyze_and_plan(state, improve_exceeded=self.settings.improves_exceeded)

    def state(
        self,
        file: str | Path | None = None,
        *,
        measurements: Mapping[str, Number] | None = None,
        components: Mapping[str, str] | None = None,
        groundings: Mapping[str, str] | None = None,
        objectives: str | Iterable[str] | Mapping[str, str | None] = (),
    ) -> KnowledgeState:
        """Build a state, with its names checked.

        Args:
            file: YAML with any of objectives, groundings, components, measurements; the other arguments replace what
                it says.
            measurements: measured value by quality attribute type.
            components: c_status by component.
            groundings: function design by function.
            objectives: functions, or o_status by function; None: UNGROUNDED without a grounding, else no status.
                Without objectives, the state has those of the groundings, else those of the search task.

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

    def infer(self, state: KnowledgeState) -> Conclusion:
        """Infer all that follows in a state, from rules and axioms, and plan on it.

        Raises:
            KnowledgeError: the state contradicts the ontologies, or the reasoner takes too long.
        """
        return self._with_all_terms.analyze_and_plan(state, improve_exceeded=self.settings.improves_exceeded)

    def explain(self, state: KnowledgeState, question: str = "") -> Explanation:
        """Explain why a fact or a decision follows in a state, or why the state contradicts itself.

        Args:
            state: the state.
            question: a fact such as "fg_status(fg_spiral_high, IN_ERROR_NFR)", "why fd_spiral_low?" or "why not
                fd_spiral_high?"; empty: all that is inferred and decided.

        Raises:
            InputError: the question is none of these, or names what the knowledge base does not have.
            KnowledgeError: the reasoner takes too long.
        """
        doing = f"explaining the state {state}"
        return self.limit.run(
            lambda: explain(self.base, state, question, self.settings.improves_exceeded), doing, self.base.rules
        )

    def policy(self, max_failed: int = 2, on_count: OnCount = lambda done, total: None) -> Policy:
        """Decide every state, with at most `max_failed` components that report a status.

        `on_count` is called repeatedly with the number of kinds of states decided so far, and their total.

        Raises:
            InputError: there would be too many states.
            KnowledgeError: the reasoner takes too long for one of them.
        """
        return make_policy(self.base, self.settings, self.decide, max_failed, on_count=on_count)

    def diff(
        self, other: KnowledgeBase, max_failed: int = 2, on_count: OnCount = lambda done, total: None
    ) -> PolicyDifference:
        """Find the states that another knowledge base decides differently, over all states that either distinguishes.

        Raises:
            InputError: there would be too many states.
            KnowledgeError: the reasoner takes too long for one of them.
        """
        space = PolicySpace.of(self.base, self.settings).common(PolicySpace.of(other.base, other.settings))
        return compare_policies(
            make_policy(self.base, self.settings, self.decide, max_failed, space, on_count),
            make_policy(other.base, other.settings, other.decide, max_failed, space, on_count),
        )

    def query(self, text: str, state: KnowledgeState | None = None, *, inferred: bool = False) -> QueryResult:
        """Answer a query in SPARQL.

        Args:
            text: the query; see suave_des.workbench.query.answer.
            state: adds what it asserts; None: the ontologies alone.
            inferred: adds what Pellet infers.

        Raises:
            InputError: it is not a query.
            KnowledgeError: the state contradicts itself, or it takes too long.
        """
        rules = self.base.rules
        graph = self.limit.run(lambda: graph_of(self.base, state, inferred=inferred), "answering the query", rules)
        return answer(graph, text)
