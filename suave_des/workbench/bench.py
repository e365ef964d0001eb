"""The knowledge workbench as one object: a knowledge base that can be asked."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path

from suave_des.errors import InputError
from suave_des.knowledge.base import KnowledgeBase as Ontologies
from suave_des.knowledge.deliberation import Conclusion, Deliberation
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.state import KnowledgeState, Number
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.wording import did_you_mean, shown
from suave_des.workbench.limit import TIME_LIMIT_S, LimitedReasoner, TimeLimit
from suave_des.workbench.states import Loop, state_from

DEFAULT_SCENARIO = "seams2023"


@dataclass(frozen=True, eq=False)
class KnowledgeBase:
    """Ontologies with a reasoner, and the loop that they are used in.

    Attributes:
        base: the ontologies.
        loop: what the managing subsystem does besides what the rules say.
        reasoner: name of the reasoner.
        limit: of the reasoner's time for one state.
    """

    base: Ontologies
    loop: Loop
    reasoner: str
    limit: TimeLimit = field(repr=False)
    _deliberation: Deliberation = field(repr=False)

    @classmethod
    def load(
        cls,
        ontologies: Sequence[str | Path] = (),
        *,
        scenario: str | Path = DEFAULT_SCENARIO,
        reasoner: str | None = None,
        disabled_rules: Iterable[str] = (),
        time_limit_s: float = TIME_LIMIT_S,
    ) -> KnowledgeBase:
        """Read ontologies and start a reasoner on them.

        Args:
            ontologies: files; without any, those of the scenario.
            scenario: a scenario file, or the name of a shipped one: its ontologies, overridden values, measured
                attributes, and what its revision does in code.
            reasoner: in place of the scenario's.
            disabled_rules: names of rules to switch off.
            time_limit_s: for each inference.

        Raises:
            InputError: a file or name cannot be used.
            KnowledgeError: the ontologies cannot be reasoned with.
        """
        loaded = load_scenario(scenario, ontologies=ontologies, reasoner=reasoner)
        knowledge = loaded.scenario.knowledge
        values = {name: Decimal(repr(value)) for name, value in knowledge.values.items()}
        base = Ontologies.load(loaded.ontologies, values=values)
        base = without_rules(base, disabled_rules)
        return cls.of(base, Loop.of(loaded.scenario), knowledge.reasoner, TimeLimit(time_limit_s))

    @classmethod
    def of(cls, base: Ontologies, loop: Loop, reasoner: str, limit: TimeLimit) -> KnowledgeBase:
        """A workbench on ontologies that are loaded already."""
        inner = limit.run(lambda: make_reasoner(reasoner, base), "loading the ontologies")
        return cls(base, loop, reasoner, limit, Deliberation(base, LimitedReasoner(inner, limit)))

    def state(
        self,
        file: Path | None = None,
        *,
        measurements: Mapping[str, Number] | None = None,
        components: Mapping[str, str] | None = None,
        groundings: Mapping[str, str] | None = None,
        objectives: Iterable[str] = (),
    ) -> KnowledgeState:
        """A state with names checked; without objectives, those of the groundings, else those of the search task.

        Args:
            file: YAML with any of objectives, groundings, components, measurements; what is given besides wins.
            measurements: measured value by quality attribute type.
            components: c_status by component.
            groundings: function design by function.
            objectives: functions, or function=status.

        Raises:
            InputError: a name is unknown, or a value cannot be meant.
        """

        def words(parts: Mapping[str, object] | None) -> list[str]:
            return [f"{name}={value}" for name, value in (parts or {}).items()]

        return state_from(
            self.base,
            self.loop,
            file,
            measured=words(measurements),
            components=words(components),
            groundings=words(groundings),
            objectives=objectives,
        )

    def infer(self, state: KnowledgeState) -> Conclusion:
        """What the reasoner adds to a state, and the plan that follows.

        Raises:
            KnowledgeError: the state contradicts the ontologies, or the reasoner takes too long.
        """
        return self._deliberation.conclude(state, improve_exceeded=self.loop.improves_exceeded)

    def with_base(self, base: Ontologies) -> KnowledgeBase:
        """The same workbench on other ontologies."""
        return KnowledgeBase.of(base, self.loop, self.reasoner, self.limit)


def without_rules(base: Ontologies, names: Iterable[str]) -> Ontologies:
    """The same ontologies with some rules switched off.

    Raises:
        InputError: there is no rule of that name.
    """
    off = sorted(set(names))
    known = [rule.name for rule in base.content.rules]
    for name in off:
        if name not in known:
            raise InputError(f"there is no rule {shown(name)} to switch off", remedy=did_you_mean(name, known))
    if not off:
        return base
    rules = tuple(replace(rule, enabled=rule.enabled and rule.name not in off) for rule in base.content.rules)
    digest = hashlib.sha256("\n".join((base.content_hash, "without", *off)).encode()).hexdigest()
    return replace(base, rules=rules, content=replace(base.content, rules=rules), content_hash=digest)
