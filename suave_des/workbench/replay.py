"""Replay recorded missions with one rule added or removed: what would have been inferred and decided."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from suave_des.campaign.knowledge_records import CAMPAIGN_KNOWLEDGE_FILE, KNOWLEDGE_FILE, read_knowledge, read_missions
from suave_des.errors import MISTAKES_LOGGER, InputError, KnowledgeError
from suave_des.knowledge.checks.findings import Finding, Level, ordered
from suave_des.knowledge.checks.rules import findings_on_rule
from suave_des.knowledge.content import with_rules
from suave_des.knowledge.deliberation import NONE_LEFT
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.pellet.limit import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.rules.files import hash_with_rules, read_rule
from suave_des.knowledge.rules.parser import parse_rule
from suave_des.knowledge.state import ContradictionError, Fact, KnowledgeState, Value
from suave_des.metrics.result import KnowledgeRecord
from suave_des.monitor.diagnostics import REPORTED_STATUSES
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Scenario
from suave_des.scenario_knowledge import read_base
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.reasons.tracing import Tracer, pellet_for
from suave_des.workbench.state_input import ManagingSettings

_MISSION_FILE = "mission.json"
_GIVEN = Path("the rule to try")


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
class ChangedDecision:
    """A decision that would have been different.

    Attributes:
        function: whose grounding is decided.
        recorded: design decided without the change; None: no adaptation, or no design left.
        then: design decided with it.
    """

    function: str
    recorded: str | None
    then: str | None


@dataclass(frozen=True)
class ReplayedCycle:
    """One recorded reasoning cycle in which the rule fires or changes something.

    Attributes:
        t_s: mission time.
        firings: of the rule.
        decisions: those that would have been different.
        contradiction: for a state that would contradict itself, what contradicts what.
    """

    t_s: float
    state: KnowledgeState
    firings: tuple[Firing, ...]
    decisions: tuple[ChangedDecision, ...]
    contradiction: str | None = None


@dataclass(frozen=True)
class MissionReplay:
    """A replay of one mission.

    Attributes:
        folder: the mission's output folder, or its campaign's.
        mission: which of the campaign's; empty for a mission with a folder of its own.
        states: number of recorded states.
        cycles: the cycles in which the rule fires or changes something, in order of time.
    """

    folder: Path
    mission: str
    states: int
    cycles: tuple[ReplayedCycle, ...]

    def lines(self) -> Iterator[str]:
        """The replay as `kb try` prints it."""
        firings: dict[str, list[ReplayedCycle]] = {}
        decisions: dict[str, list[ReplayedCycle]] = {}
        for cycle in self.cycles:
            for firing in cycle.firings:
                firings.setdefault(_firing_text(firing), []).append(cycle)
            for each in cycle.decisions:
                then, recorded = each.then or "no change", each.recorded or "no change"
                decisions.setdefault(f"{each.function}: {then} instead of {recorded}", []).append(cycle)
        which = f": {self.mission}" if self.mission else ""
        firing_cycles = sum(bool(cycle.firings) for cycle in self.cycles)
        yield f"{self.folder}{which}: fires in {firing_cycles} of {self.states} recorded states"
        for text, cycles in firings.items():
            yield f"  {_times(cycles)}: {text}"
        yield f"  decisions that would have been different: {sum(map(len, decisions.values()))}"
        for text, cycles in decisions.items():
            yield f"    {_times(cycles)}: {text}"
        contradicting = [cycle for cycle in self.cycles if cycle.contradiction]
        if contradicting:
            yield f"  states that would contradict themselves: {len(contradicting)} ({_times(contradicting)})"
            yield f"    {contradicting[0].contradiction}"


def _firing_text(firing: Firing) -> str:
    """Describe conclusions and individuals, without numbers, which differ each time."""
    bound = ", ".join(f"?{name} = {value}" for name, value in firing.bindings if not isinstance(value, Decimal))
    known = "" if firing.is_new else " (known without it)"
    return f"{', '.join(map(str, firing.facts))}{known} with {bound or 'nothing bound'}"


def _times(cycles: Sequence[ReplayedCycle]) -> str:
    first, last = cycles[0].t_s, cycles[-1].t_s
    return f"{first:.2f} s" if first == last else f"{first:.2f} s to {last:.2f} s, {len(cycles)} states"


@dataclass(frozen=True)
class RuleChange:
    """The rule to try, and the knowledge base to try it on.

    Attributes:
        text: the rule, as "name: body -> head"; it replaces those of the same name. None: no rule is added.
        disabled: alternatively, the name of a rule to disable.
        ontologies: in place of those of the missions' scenario.
        scenario: file or name of a scenario in place of that of the missions.
        rules: files of rules as text, in addition to the scenario's.
        disabled_rules: names of rules to switch off with and without the change.
        reasoner: in place of the scenario's.
        limit_s: of the reasoner, for one state.
        values: of that scenario, by key path.
    """

    text: str | None = None
    disabled: str | None = None
    ontologies: Sequence[Path] = ()
    scenario: str | None = None
    rules: Sequence[Path] = ()
    disabled_rules: Sequence[str] = ()
    reasoner: str | None = None
    limit_s: float = TIME_LIMIT_S
    values: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class _RecordedMission:
    folder: Path
    mission: str
    scenario: Scenario
    records: tuple[KnowledgeRecord, ...]


def try_rule(folder: Path, change: RuleChange) -> Iterator[MissionReplay]:
    """Try adding or disabling a rule on recorded missions, one after the other.

    Only the recorded states are evaluated: the consequences of different decisions are not simulated.

    Args:
        folder: output folder of a mission or of a campaign that recorded its knowledge, or a folder of such folders.
        change: what to try.

    Raises:
        InputError: there is no recorded mission, or the rule cannot be used.
        KnowledgeError: the ontologies cannot be reasoned with.
    """
    if (change.text is None) == (change.disabled is None):
        raise InputError("give a rule, or --disable NAME", remedy="one of the two")
    comparison: _Comparison | None = None
    for mission in _recorded_missions(folder):
        if comparison is None or comparison.scenario != mission.scenario:
            is_first = comparison is None
            comparison = _Comparison(mission.scenario, change)
            for mistake in comparison.mistakes() if is_first and change.text is not None else ():
                logging.getLogger(MISTAKES_LOGGER).warning("%s", mistake)
        cycles = (comparison.replay(record) for record in mission.records)
        replayed = tuple(each for each in cycles if each is not None)
        yield MissionReplay(mission.folder, mission.mission, len(mission.records), replayed)


def _recorded_missions(folder: Path) -> Iterator[_RecordedMission]:
    if not folder.is_dir():
        raise InputError("no such folder", file=folder, remedy="give the folder that suave-des run --out wrote")
    is_any_found = False
    for each in [folder, *sorted(path for path in folder.iterdir() if path.is_dir())]:
        if (each / KNOWLEDGE_FILE).is_file():
            is_any_found = True
            yield _RecordedMission(each, "", _scenario(each / _MISSION_FILE), read_knowledge(each / KNOWLEDGE_FILE))
        if (each / CAMPAIGN_KNOWLEDGE_FILE).is_file():
            is_any_found = True
            for one in read_missions(each / CAMPAIGN_KNOWLEDGE_FILE):
                point = f", point {one.point}" if one.point else ""
                yield _RecordedMission(each, f"{one.manager}, run {one.run}{point}", one.scenario, one.records)
    if not is_any_found:
        raise InputError(
            f"has no {KNOWLEDGE_FILE} or {CAMPAIGN_KNOWLEDGE_FILE}, nor has a folder in it",
            file=folder,
            remedy="record with run --manager metacontrol --out, or campaign --record-knowledge",
        )


def mission_scenario(folder: Path) -> Scenario:
    """The scenario of a recorded mission, or of a campaign's first one.

    Raises:
        InputError: there is none.
    """
    return next(_recorded_missions(folder)).scenario


def _scenario(path: Path) -> Scenario:
    try:
        return Scenario.model_validate(json.loads(path.read_text(encoding="utf-8"))["scenario"])
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path, remedy="give a mission's folder") from None
    except (ValueError, KeyError, TypeError, ValidationError):
        raise InputError("is not a mission's record", file=path, remedy="run the mission again") from None


class _Comparison:
    """The knowledge base of a scenario, without the change and with it."""

    def __init__(self, scenario: Scenario, change: RuleChange) -> None:
        self.scenario = scenario
        read = partial(read_base, more_rules=change.rules, disabled_rules=change.disabled_rules)
        if change.scenario is not None:
            loaded = load_scenario(change.scenario, values=change.values)
            base = read(loaded.scenario, change.ontologies or loaded.ontologies, loaded.rules)
            used = loaded.scenario
        elif change.values:
            problem = "the recorded scenario cannot be changed"
            raise InputError(problem, place="--set", remedy="name one with --scenario")
        else:
            used, base = scenario, read(scenario, change.ontologies or None)
        name = parse_rule(change.text, _GIVEN).name if change.text is not None else change.disabled
        settings, limit = ManagingSettings.of(used), TimeLimit(change.limit_s, "--time-limit")
        reasoner = change.reasoner or used.knowledge.reasoner
        self.before = KnowledgeBase.of(base, settings, reasoner, limit)
        self.after = KnowledgeBase.of(_changed(base, change), settings, reasoner, limit)
        self.with_rule, self.without_rule = self.after, self.before
        if change.text is None:
            self.with_rule, self.without_rule = self.before, self.after
        self.rules = [rule for rule in self.with_rule.base.content.enabled_rules if rule.name == name]

    def mistakes(self) -> tuple[Finding, ...]:
        """Return the errors and warnings that `kb check` would have about the rule that is tried."""
        names = {rule.name for rule in self.rules}
        measured = self.after.settings.measured
        found = (findings_on_rule(name, self.after.base, REPORTED_STATUSES, measured) for name in names)
        return tuple(each for each in ordered(chain.from_iterable(found)) if each.level is not Level.INFO)

    @cached_property
    def _pellet(self) -> InProcessPellet:
        return pellet_for(self.with_rule.base)

    def replay(self, record: KnowledgeRecord) -> ReplayedCycle | None:
        """Return the effect of the change in a recorded reasoning cycle; None if it has none."""
        state = record.state
        recorded, _ = _decisions(self.before, state)
        then, contradiction = _decisions(self.after, state)
        if contradiction is not None:
            return ReplayedCycle(record.t_s, state, (), (), contradiction)
        without = self.without_rule.decide(state).inference
        tracer = Tracer(self.with_rule.base, state, self._pellet)
        firings = tuple(
            Firing(facts, bindings, is_new=not (without.facts | without.asserted).issuperset(facts))
            for rule in self.rules
            for bindings, facts in tracer.firings(rule)
        )
        decisions = tuple(
            ChangedDecision(function, recorded.get(function), then.get(function))
            for function in sorted(recorded.keys() | then.keys())
            if recorded.get(function) != then.get(function)
        )
        return ReplayedCycle(record.t_s, state, firings, decisions) if firings or decisions else None


def _changed(base: Ontology, change: RuleChange) -> Ontology:
    texts = [] if change.text is None else [change.text]
    disabled = [] if change.disabled is None else [change.disabled]
    rules = [[read_rule(text, base.vocabulary, _GIVEN)] for text in texts]
    try:
        content = with_rules(base.content, rules, disabled)
    except KnowledgeError as error:
        raise KnowledgeError(error.problem, place="--disable", remedy=error.remedy) from None
    digest = hash_with_rules(base.content_hash, texts, disabled)
    return replace(base, content=content, content_hash=digest)


def _decisions(bench: KnowledgeBase, state: KnowledgeState) -> tuple[dict[str, str], str | None]:
    """Groundings that would be changed, by function; and the contradiction in a state that has one."""
    try:
        changes = bench.decide(state).changes
    except ContradictionError as error:
        return {}, error.problem
    return {function: design for function, design in changes.items() if design != NONE_LEFT}, None
