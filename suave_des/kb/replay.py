"""Replay recorded missions with rules added or disabled: what would have been inferred and decided."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from suave_des.errors import MISTAKES_LOGGER, InputError, KnowledgeError, number_of
from suave_des.files import read_json
from suave_des.findings import Level, ordered
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import with_bindings
from suave_des.kb.situations import Situation
from suave_des.kb.states import ManagingSettings, read_rules
from suave_des.kb.tracing import Tracer, pellet_for
from suave_des.knowledge.checks import findings_on_rule
from suave_des.knowledge.content import with_rules
from suave_des.knowledge.pellet import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.state import NONE_LEFT
from suave_des.metrics.result import KnowledgeRecord
from suave_des.monitor.diagnostics import REPORTED_STATUSES
from suave_des.records.knowledge import CAMPAIGN_KNOWLEDGE_FILE, KNOWLEDGE_FILE, read_knowledge, read_missions
from suave_des.scenario.models import Scenario
from suave_des.scenario_knowledge import read_base

_MISSION_FILE = "mission.json"


class ReplayedCycle(NamedTuple):
    """One recorded reasoning cycle in which a rule fires or something changes.

    Attributes:
        t_s: mission time.
        firings: each way in which a rule fires: conclusions and individuals, without numbers, which differ each time.
        decisions: those that would have been different.
        contradiction: for a state that would contradict itself, what contradicts what.
    """

    t_s: float
    firings: tuple[str, ...]
    decisions: tuple[str, ...]
    contradiction: str = ""


@dataclass(frozen=True)
class MissionReplay:
    """A replay of one mission.

    Attributes:
        folder: the mission's output folder, or its campaign's.
        mission: which of the campaign's; empty for a mission with a folder of its own.
        states: number of recorded states.
        cycles: the cycles in which a rule fires or something changes, in order of time.
    """

    folder: Path
    mission: str
    states: int
    cycles: tuple[ReplayedCycle, ...]

    def lines(self) -> Iterator[str]:
        """The replay as `kb try` prints it."""
        which = f": {self.mission}" if self.mission else ""
        firing_cycles = sum(bool(cycle.firings) for cycle in self.cycles)
        yield f"{self.folder}{which}: fires in {firing_cycles} of {self.states} recorded states"
        yield from self._grouped("  ", lambda cycle: cycle.firings)
        yield f"  decisions that would have been different: {sum(len(cycle.decisions) for cycle in self.cycles)}"
        yield from self._grouped("    ", lambda cycle: cycle.decisions)
        contradicting = [cycle for cycle in self.cycles if cycle.contradiction]
        if contradicting:
            yield f"  states that would contradict themselves: {len(contradicting)} ({_times(contradicting)})"
            yield f"    {contradicting[0].contradiction}"

    def _grouped(self, indent: str, texts_of: Callable[[ReplayedCycle], Iterable[str]]) -> Iterator[str]:
        """Each text with the times of its cycles."""
        found: dict[str, list[ReplayedCycle]] = {}
        for cycle in self.cycles:
            for text in texts_of(cycle):
                found.setdefault(text, []).append(cycle)
        return (f"{indent}{_times(cycles)}: {text}" for text, cycles in found.items())


def summary(missions: Sequence[MissionReplay]) -> Iterator[str]:
    """Several replays as `kb try` prints them: those in which something happens, and how many they are."""
    for mission in missions:
        if mission.cycles or len(missions) == 1:
            yield from mission.lines()
    if len(missions) > 1:
        cycles = [mission.cycles for mission in missions]
        firing = sum(any(each.firings for each in one) for one in cycles)
        changed = [sum(len(each.decisions) for each in one) for one in cycles]
        contradictions = sum(any(each.contradiction for each in one) for one in cycles)
        yield (
            f"{len(missions)} missions: fires in {firing}, different decisions in {sum(map(bool, changed))} "
            f"({number_of(sum(changed), 'decision')}), contradictions in {contradictions}"
        )


def _times(cycles: Sequence[ReplayedCycle]) -> str:
    first, last = cycles[0].t_s, cycles[-1].t_s
    return f"{first:.2f} s" if first == last else f"{first:.2f} s to {last:.2f} s, {len(cycles)} states"


class _RecordedMission(NamedTuple):
    folder: Path
    mission: str
    scenario: Scenario
    records: tuple[KnowledgeRecord, ...]


def try_rules(
    folder: Path,
    rule: str | None = None,
    *,
    disabled: str | None = None,
    limit_s: float = TIME_LIMIT_S,
) -> Iterator[MissionReplay]:
    """Try adding or disabling rules on recorded missions, one after the other.

    Only the recorded states are evaluated: the consequences of different decisions are not simulated.

    Args:
        folder: output folder of a mission or of a campaign that recorded its knowledge, or a folder of such folders.
        rule: a rule as text, or a file of rules; they replace those of the same name.
        disabled: alternatively, the name of a rule to disable.
        limit_s: of the reasoner, for one state.

    Raises:
        InputError: there is no recorded mission, or the rule cannot be used.
        KnowledgeError: the ontologies cannot be reasoned with.
    """
    if (rule is None) == (disabled is None):
        raise InputError("give a rule, or --disable NAME", remedy="one of the two")
    limit = TimeLimit(limit_s, "--time-limit")
    trial: _Trial | None = None
    for mission in _recorded_missions(folder):
        used = mission.scenario
        if trial is None or trial.scenario != used:
            is_first = trial is None
            before = KnowledgeBase.of(read_base(used), ManagingSettings.of(used), used.knowledge.reasoner, limit)
            trial = _Trial(used, before, rule, disabled)
            if is_first and rule is not None:
                trial.warn()
        cycles = tuple(each for each in map(trial.replay, mission.records) if each is not None)
        yield MissionReplay(mission.folder, mission.mission, len(mission.records), cycles)


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
        return Scenario.model_validate(read_json(path)["scenario"])
    except (ValueError, KeyError, TypeError, ValidationError):
        raise InputError("is not a mission's record", file=path, remedy="run the mission again") from None


class _Trial:
    """The knowledge base of a scenario, without the change and with it."""

    def __init__(self, scenario: Scenario, before: KnowledgeBase, rule: str | None, disabled: str | None) -> None:
        tried = () if rule is None else read_rules(rule, before.base.vocabulary)
        try:
            content = with_rules(before.base.content, [tried], () if disabled is None else (disabled,))
        except KnowledgeError as error:
            raise KnowledgeError(error.problem, place="--disable", remedy=error.remedy) from None
        self.scenario, self.before, self.after = scenario, before, before.changed(replace(before.base, content=content))
        both = self.after, self.before
        self.with_rule, self.without_rule = both if disabled is None else both[::-1]
        names = {disabled, *(each.name for each in tried)}
        self.rules = [each for each in self.with_rule.base.content.enabled_rules if each.name in names]

    def warn(self) -> None:
        """Log the errors and warnings that `kb check` would have about the rules that are tried."""
        names, after = dict.fromkeys(rule.name for rule in self.rules), self.after
        found = (findings_on_rule(name, after.base, REPORTED_STATUSES, after.settings.measured) for name in names)
        for finding in ordered(chain.from_iterable(found)):
            if finding.level is not Level.INFO:
                logging.getLogger(MISTAKES_LOGGER).warning("%s", finding)

    @cached_property
    def _pellet(self) -> InProcessPellet:
        return pellet_for(self.with_rule.base)

    def replay(self, record: KnowledgeRecord) -> ReplayedCycle | None:
        """Return the effect of the change in a recorded reasoning cycle; None if it has none."""
        situation = Situation(record.state)
        before, after = self.before.outcome(situation), self.after.outcome(situation)
        if after.reasoning is None:
            return ReplayedCycle(record.t_s, (), (), f"contradiction: {after.contradiction}")
        decisions = []
        for name in sorted({*before.changes, *after.changes}):
            one, other = (_design(outcome.changes.get(name)) for outcome in (before, after))
            if one != other:
                decisions.append(f"{name}: {other} instead of {one}")
        without = self.without_rule.outcome(situation).known
        firings = []
        tracer = Tracer(self.with_rule.base, record.state, self._pellet)
        for bindings, facts in (firing for rule in self.rules for firing in tracer.firings(rule)):
            known = " (known without it)" if without.issuperset(facts) else ""
            bound = with_bindings(tuple(each for each in bindings if not isinstance(each[1], Decimal)))
            firings.append(f"{', '.join(map(str, facts))}{known}{bound or ' with nothing bound'}")
        return ReplayedCycle(record.t_s, tuple(firings), tuple(decisions)) if firings or decisions else None


def _design(choice: str | None) -> str:
    return "no change" if choice in (None, NONE_LEFT) else str(choice)
