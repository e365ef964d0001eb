"""The knowledge workbench as one object: a knowledge base that can be asked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from suave_des.knowledge.deliberation import Conclusion, Deliberation
from suave_des.knowledge.limit import TIME_LIMIT_S, TimeLimit, in_words
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.state import KnowledgeState, Number
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.knowledge import open_base
from suave_des.workbench.difference import PolicyDifference, compare
from suave_des.workbench.explain import Explanation, explain
from suave_des.workbench.policy import Policy, Space, make_policy
from suave_des.workbench.query import QueryResult, run_query
from suave_des.workbench.states import Loop, state_from

DEFAULT_SCENARIO = "seams2023"


def _several(files: str | Path | Sequence[str | Path]) -> Sequence[str | Path]:
    return [files] if isinstance(files, str | Path) else files


@dataclass(frozen=True, eq=False)
class KnowledgeBase:
    """An ontology with a reasoner, and the loop that they are used in.

    Attributes:
        base: the ontologies.
        loop: what the managing subsystem does besides what the rules say.
        reasoner: name of the reasoner.
        limit: of the reasoner's time for one state.
    """

    base: Ontology
    loop: Loop
    reasoner: str
    limit: TimeLimit = field(repr=False)
    _deliberation: Deliberation = field(repr=False)

    @classmethod
    def load(
        cls,
        ontologies: str | Path | Sequence[str | Path] = (),
        *,
        scenario: str | Path = DEFAULT_SCENARIO,
        reasoner: str | None = None,
        rules: str | Path | Sequence[str | Path] = (),
        disabled_rules: str | Sequence[str] = (),
        time_limit_s: float = TIME_LIMIT_S,
    ) -> KnowledgeBase:
        """Read ontologies and start a reasoner on them.

        Args:
            ontologies: files, or one; without any, those of the scenario.
            scenario: a scenario file, or the name of a shipped one: its ontologies, overridden values, measured
                attributes, and what its revision does in code.
            reasoner: in place of the scenario's.
            rules: files of rules as text, besides the scenario's.
            disabled_rules: names of rules to switch off.
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
        )
        reasoner = loaded.scenario.knowledge.reasoner
        limit = TimeLimit(time_limit_s, "--time-limit")
        return cls.of(open_base(loaded), Loop.of(loaded.scenario), reasoner, limit)

    @classmethod
    def of(cls, base: Ontology, loop: Loop, reasoner: str, limit: TimeLimit) -> KnowledgeBase:
        """A workbench on ontologies that are loaded already."""
        return cls(base, loop, reasoner, limit, Deliberation(base, make_reasoner(reasoner, base, limit)))

    def state(
        self,
        file: str | Path | None = None,
        *,
        measurements: Mapping[str, Number] | None = None,
        components: Mapping[str, str] | None = None,
        groundings: Mapping[str, str] | None = None,
        objectives: str | Iterable[str] | Mapping[str, str | None] = (),
    ) -> KnowledgeState:
        """A state with names checked; without objectives, those of the groundings, else those of the search task.

        Args:
            file: YAML with any of objectives, groundings, components, measurements; what is given besides wins.
            measurements: measured value by quality attribute type.
            components: c_status by component.
            groundings: function design by function.
            objectives: functions, or o_status by function; none: UNGROUNDED without a grounding, else nothing.

        Raises:
            InputError: a name is unknown, or a value cannot be meant.
        """

        def words(parts: Mapping[str, object] | None) -> list[str]:
            return [f"{name}={value}" for name, value in (parts or {}).items()]

        def statuses(parts: Mapping[str, object]) -> list[str]:
            return [name if status is None else f"{name}={status}" for name, status in parts.items()]

        asked = [objectives] if isinstance(objectives, str) else objectives
        return state_from(
            self.base,
            self.loop,
            None if file is None else Path(file),
            measured=words(measurements),
            components=words(components),
            groundings=words(groundings),
            objectives=statuses(objectives) if isinstance(objectives, Mapping) else asked,
        )

    def infer(self, state: KnowledgeState) -> Conclusion:
        """What the reasoner adds to a state, and the plan that follows.

        Raises:
            KnowledgeError: the state contradicts the ontologies, or the reasoner takes too long.
        """
        return self._deliberation.analyze_and_plan(state, improve_exceeded=self.loop.improves_exceeded)

    def explain(self, state: KnowledgeState, question: str = "") -> Explanation:
        """Why a fact or a decision follows in a state, or why the state contradicts itself.

        Args:
            state: the state.
            question: a fact such as "fg_status(fg_spiral_high, IN_ERROR_NFR)", "why fd_spiral_low?" or "why not
                fd_spiral_high?"; empty: all that is inferred and decided.

        Raises:
            InputError: the question is none of these, or names what the knowledge base does not have.
            KnowledgeError: the reasoner takes too long.
        """
        doing = f"explaining the state {in_words(state)}"
        return self.limit.run(lambda: explain(self.base, state, question, self.loop.improves_exceeded), doing)

    def policy(self, max_failed: int = 2) -> Policy:
        """What is decided in every state.

        Args:
            max_failed: at most so many components report anything.

        Raises:
            InputError: there would be too many states.
            KnowledgeError: the reasoner takes too long for one of them.
        """
        return make_policy(self.base, self.loop, self.infer, max_failed)

    def diff(self, other: KnowledgeBase, max_failed: int = 2) -> PolicyDifference:
        """Where another knowledge base decides differently, over everything that either of them distinguishes.

        Args:
            other: the other one.
            max_failed: at most so many components report anything.

        Raises:
            InputError: there would be too many states.
            KnowledgeError: the reasoner takes too long for one of them.
        """
        space = Space.of(self.base, self.loop).common(Space.of(other.base, other.loop))
        return compare(
            make_policy(self.base, self.loop, self.infer, max_failed, space),
            make_policy(other.base, other.loop, other.infer, max_failed, space),
        )

    def query(self, text: str, state: KnowledgeState | None = None, *, inferred: bool = False) -> QueryResult:
        """Ask in SPARQL.

        Args:
            text: the query; see suave_des.workbench.query.run_query.
            state: adds what it asserts; None: the ontologies alone.
            inferred: adds what Pellet infers.

        Raises:
            InputError: it is no query.
            KnowledgeError: the state contradicts itself, or it takes too long.
        """
        return self.limit.run(lambda: run_query(self.base, text, state, inferred=inferred), "answering the query")
