"""A dry run: what one rule more, or one less, would have inferred and decided in recorded missions."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

from pydantic import ValidationError

from suave_des.campaign.knowledge_records import CAMPAIGN_KNOWLEDGE_FILE, KNOWLEDGE_FILE, read_knowledge, read_missions
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.content import with_rules
from suave_des.knowledge.limit import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rules.files import RulesFile, hash_with_rules
from suave_des.knowledge.rules.parser import parse_rule, parse_rules
from suave_des.knowledge.rules.syntax import Rule
from suave_des.knowledge.state import Fact, KnowledgeState, Value
from suave_des.resources import find
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Scenario
from suave_des.simulation.result import KnowledgeRecord
from suave_des.workbench.bench import KnowledgeBase
from suave_des.workbench.states import Loop
from suave_des.workbench.tracing import Tracer

_MISSION_FILE = "mission.json"


@dataclass(frozen=True)
class Firing:
    """One way in which the rule fires in a state.

    Attributes:
        facts: what it concludes.
        bindings: value of each variable.
        is_new: whether none of these facts is there without the rule.
    """

    facts: tuple[Fact, ...]
    bindings: tuple[tuple[str, Value], ...]
    is_new: bool


@dataclass(frozen=True)
class Otherwise:
    """A decision that would have been another.

    Attributes:
        function: whose grounding.
        recorded: design decided without the change; None: no adaptation, or no design left.
        then: design decided with it.
    """

    function: str
    recorded: str | None
    then: str | None


@dataclass(frozen=True)
class Moment:
    """One recorded reasoning cycle at which the rule fires or changes something.

    Attributes:
        t_s: mission time.
        state: what was reasoned about.
        firings: of the rule.
        otherwise: decisions that would have been others.
        problem: for a state that would contradict itself: what contradicts what.
    """

    t_s: float
    state: KnowledgeState
    firings: tuple[Firing, ...]
    otherwise: tuple[Otherwise, ...]
    problem: str | None = None


@dataclass(frozen=True)
class MissionTrial:
    """A rule's dry run on one mission.

    Attributes:
        folder: the mission's output folder, or its campaign's.
        mission: which of the campaign's; empty for a mission with a folder of its own.
        cycles: recorded states.
        moments: those at which the rule fires or changes something, in order of time.
    """

    folder: Path
    mission: str
    cycles: int
    moments: tuple[Moment, ...]


@dataclass(frozen=True)
class Change:
    """What to try, and what it is tried on.

    Attributes:
        text: the rule, as "name: body -> head"; it takes the place of those of its name. None: without a rule.
        disabled: in its place the name of a rule to do without.
        ontologies: in place of those of the missions' scenario.
        scenario: file or name of a scenario in place of that of the missions.
        rules: files of rules as text, besides the scenario's.
        disabled_rules: names of rules to switch off with and without the change.
        reasoner: in place of the scenario's.
        limit_s: of the reasoner, for one state.
    """

    text: str | None = None
    disabled: str | None = None
    ontologies: Sequence[Path] = ()
    scenario: str | None = None
    rules: Sequence[Path] = ()
    disabled_rules: Sequence[str] = ()
    reasoner: str | None = None
    limit_s: float = TIME_LIMIT_S


@dataclass(frozen=True)
class _Recorded:
    folder: Path
    mission: str
    scenario: Scenario
    records: tuple[KnowledgeRecord, ...]


def try_rule(folder: Path, change: Change) -> Iterator[MissionTrial]:
    """Try a rule, or the lack of one, on recorded missions, one after the other.

    Only the recorded states are reasoned about: what would have followed from another decision is not simulated.

    Args:
        folder: output folder of a mission or of a campaign that recorded its knowledge, or a folder of such folders.
        change: what to try.

    Raises:
        InputError: there is no recorded mission, or the rule cannot be used.
        KnowledgeError: the ontologies cannot be reasoned with.
    """
    if (change.text is None) == (change.disabled is None):
        raise InputError("give a rule, or --disable NAME", remedy="one of the two")
    pair: _Pair | None = None
    for recorded in _recorded(folder):
        if pair is None or pair.scenario != recorded.scenario:
            pair = _Pair(recorded.scenario, change)
        moments = [pair.moment(record) for record in recorded.records]
        found = tuple(each for each in moments if each is not None)
        yield MissionTrial(recorded.folder, recorded.mission, len(recorded.records), found)


def _recorded(folder: Path) -> Iterator[_Recorded]:
    if not folder.is_dir():
        raise InputError("no such folder", file=folder, remedy="give the folder that suave-des run --out wrote")
    folders = [folder, *sorted(path for path in folder.iterdir() if path.is_dir())]
    any_found = False
    for each in folders:
        if (each / KNOWLEDGE_FILE).is_file():
            any_found = True
            yield _Recorded(each, "", _scenario(each / _MISSION_FILE), read_knowledge(each / KNOWLEDGE_FILE))
        if (each / CAMPAIGN_KNOWLEDGE_FILE).is_file():
            any_found = True
            for one in read_missions(each / CAMPAIGN_KNOWLEDGE_FILE):
                point = f", point {one.point}" if one.point else ""
                yield _Recorded(each, f"{one.manager}, run {one.run}{point}", one.scenario, one.records)
    if not any_found:
        raise InputError(
            f"has no {KNOWLEDGE_FILE} or {CAMPAIGN_KNOWLEDGE_FILE}, nor has a folder in it",
            file=folder,
            remedy="run --manager metacontrol --out records what is reasoned about, campaign with --record-knowledge",
        )


def _scenario(path: Path) -> Scenario:
    try:
        return Scenario.model_validate(json.loads(path.read_text(encoding="utf-8"))["scenario"])
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path, remedy="give a mission's folder") from None
    except (ValueError, KeyError, TypeError, ValidationError):
        raise InputError("is not a mission's record", file=path, remedy="run the mission again") from None


def _with(base: Ontology, text: str) -> Ontology:
    file = RulesFile(Path("the rule to try"), text, parse_rules(text, "the rule to try"))
    content = with_rules(base.content, [file.rules(base.vocabulary)], ())
    return replace(
        base, content=content, rules=content.rules, content_hash=hash_with_rules(base.content_hash, [file], ())
    )


def _without(base: Ontology, name: str) -> Ontology:
    try:
        content = with_rules(base.content, [], [name])
    except KnowledgeError as error:
        raise KnowledgeError(error.problem, place="--disable", remedy=error.remedy) from None
    return replace(
        base, content=content, rules=content.rules, content_hash=hash_with_rules(base.content_hash, [], [name])
    )


class _Pair:
    """The knowledge base of a scenario, without the change and with it."""

    def __init__(self, scenario: Scenario, change: Change) -> None:
        self.scenario = scenario
        if change.scenario is not None:
            loaded = load_scenario(change.scenario)
            used, ontologies, rules = loaded.scenario, loaded.ontologies, loaded.rules
        else:
            used = scenario
            named = () if change.ontologies else used.knowledge.ontologies
            ontologies = tuple(find(each, "ontology") for each in named)
            rules = tuple(find(each, "ontology") for each in used.knowledge.rules)
        base = Ontology.load(
            change.ontologies or ontologies,
            values={name: Decimal(repr(value)) for name, value in used.knowledge.values.items()},
            rules=[*rules, *change.rules],
            disabled_rules=[*used.knowledge.disabled_rules, *change.disabled_rules],
        )
        if change.text is not None:
            self.rule = parse_rule(change.text, "the rule to try").name
            other = _with(base, change.text)
        else:
            self.rule = str(change.disabled)
            other = _without(base, self.rule)
        loop, limit = Loop.of(used), TimeLimit(change.limit_s, "--time-limit")
        reasoner = change.reasoner or used.knowledge.reasoner
        self.before = KnowledgeBase.of(base, loop, reasoner, limit)
        self.after = KnowledgeBase.of(other, loop, reasoner, limit)
        self.has_rule, self.lacks_it = self.after, self.before
        if change.text is None:
            self.has_rule, self.lacks_it = self.before, self.after
        self.rules = [rule for rule in self.has_rule.base.content.enabled_rules if rule.name == self.rule]

    def moment(self, record: KnowledgeRecord) -> Moment | None:
        """What the change does at a recorded reasoning cycle; None: nothing."""
        state: KnowledgeState = record.state
        recorded, _ = _decisions(self.before, state)
        then, problem = _decisions(self.after, state)
        firings: tuple[Firing, ...] = ()
        if problem is None:
            without = self.lacks_it.infer(state).inference
            firings = tuple(_firings(Tracer(self.has_rule.base, state), self.rules, without.facts | without.asserted))
        otherwise = tuple(
            Otherwise(function, recorded.get(function), then.get(function))
            for function in sorted(recorded.keys() | then.keys())
            if problem is None and recorded.get(function) != then.get(function)
        )
        if not firings and not otherwise and problem is None:
            return None
        return Moment(record.t_s, state, firings, otherwise, problem)


def _firings(tracer: Tracer, rules: Sequence[Rule], known: frozenset[Fact]) -> Iterator[Firing]:
    for rule in rules:
        for bindings, facts in tracer.firings(rule):
            yield Firing(facts, bindings, is_new=not known.issuperset(facts))


def _decisions(bench: KnowledgeBase, state: KnowledgeState) -> tuple[dict[str, str | None], str | None]:
    """Groundings that would be changed, by function; and the problem of a state that contradicts itself."""
    try:
        decisions = bench.infer(state).plan.decisions
    except KnowledgeError as error:
        if not error.problem.startswith("contradiction"):
            raise
        return {}, error.problem
    return {each.function: each.design for each in decisions if each.design != state.grounded(each.function)}, None
