"""Replay recorded missions with rules added or disabled: what would have been inferred and decided."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Final, NamedTuple

from suave_des.errors import InputError, KnowledgeError, number_of
from suave_des.kb.explain import Tracer
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import with_bindings
from suave_des.kb.space import Situation, differing_decisions
from suave_des.kb.states import ManagingSettings, read_rules, recorded_missions
from suave_des.knowledge.pellet import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.state import NONE_LEFT, STAYS
from suave_des.metrics.result import KnowledgeRecord
from suave_des.scenario.models import Scenario
from suave_des.scenario_knowledge import read_base

_UNCHANGED: Final = dict.fromkeys((STAYS, NONE_LEFT), "no change")


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


class MissionReplay(NamedTuple):
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


def try_rules(
    folder: Path, rule: str | None = None, *, disabled: str | None = None, limit_s: float = TIME_LIMIT_S
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
    for where, mission in recorded_missions(folder):
        if trial is None or trial.scenario != mission.scenario:
            trial = _Trial(mission.scenario, rule, disabled, limit)
        cycles = tuple(each for each in map(trial.replay, mission.records) if each is not None)
        point = f", point {mission.point}" if mission.point else ""
        which = f"{mission.manager}, run {mission.run}{point}" if mission.run else ""
        yield MissionReplay(where, which, len(mission.records), cycles)


class _Trial:
    """The knowledge base of a scenario, without the change and with it."""

    def __init__(self, scenario: Scenario, rule: str | None, disabled: str | None, limit: TimeLimit) -> None:
        self.scenario = scenario
        base, settings = read_base(scenario), ManagingSettings.of(scenario)
        self.before = KnowledgeBase.of(base, settings, scenario.knowledge.reasoner, limit)
        tried = () if rule is None else read_rules(rule, base.vocabulary)
        unwanted = () if disabled is None else (disabled,)
        try:
            base.check_names((), unwanted)
        except KnowledgeError as error:
            raise KnowledgeError(error.problem, place="--disable", remedy=error.remedy) from None
        self.after = self.before.changed(base.with_files((), [tried], unwanted))
        self.with_rule = self.after.base if disabled is None else base
        names = {disabled, *(each.name for each in tried)}
        self.rules = [each for each in self.with_rule.content.enabled_rules if each.name in names]
        self.pellet = InProcessPellet(self.with_rule, self.with_rule.content.all_terms())

    def replay(self, record: KnowledgeRecord) -> ReplayedCycle | None:
        """Return the effect of the change in a recorded reasoning cycle; None if it has none."""
        situation = Situation(record.state)
        before, after = self.before.outcome(situation), self.after.outcome(situation)
        if after.reasoning is None:
            return ReplayedCycle(record.t_s, (), (), f"contradiction: {after.contradiction}")
        decisions = []
        for name, *choices in differing_decisions(before, after):
            one, other = (_UNCHANGED.get(each, each) for each in choices)
            if one != other:
                decisions.append(f"{name}: {other} instead of {one}")
        firings = []
        tracer = Tracer(self.with_rule, record.state, self.pellet)
        for bindings, facts in (firing for rule in self.rules for firing in tracer.firings(rule)):
            bound = with_bindings(tuple(each for each in bindings if not isinstance(each[1], Decimal)))
            firings.append(f"{', '.join(map(str, facts))}{bound or ' with nothing bound'}")
        return ReplayedCycle(record.t_s, tuple(firings), tuple(decisions)) if firings or decisions else None
