"""Replay recorded missions with rules added or disabled: what would have been inferred and
decided.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

from suave_des.errors import InputError, located, number_of
from suave_des.kb.explain import Tracer
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import tracing_pellet, with_bindings
from suave_des.kb.situations import Situation, differing_decisions
from suave_des.kb.states import ManagingSettings, read_rules, recorded_missions
from suave_des.knowledge.pellet import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.state import NONE_LEFT, STAYS, KnowledgeState
from suave_des.scenario.models import Scenario
from suave_des.scenario_knowledge import read_base

_UNCHANGED = dict.fromkeys((STAYS, NONE_LEFT), "no change")


FIRES, DECIDES, CONTRADICTS = "fires", "decides", "contradicts"


class MissionReplay(NamedTuple):
    """A replay of one mission.

    Attributes:
        folder: the mission's output folder, or its campaign's.
        mission: which of the campaign's; empty for a mission with a folder of its own.
        states: number of recorded states.
        found: in order of mission time, in s: the time; "fires", with the conclusions and the
            individuals, without numbers, which differ each time; or "decides", with a decision that
            would have been different; or "contradicts", with what contradicts what in a state.
    """

    folder: Path
    mission: str
    states: int
    found: tuple[tuple[float, str, str], ...]

    def times(self, kind: str) -> list[float]:
        """The times of what was found of a kind."""
        return [t_s for t_s, each, _ in self.found if each == kind]

    def lines(self) -> Iterator[str]:
        """The replay as `kb try` prints it."""
        which = f": {self.mission}" if self.mission else ""
        yield f"{self.folder}{which}: fires in {len({*self.times(FIRES)})} of {self.states} recorded states"
        yield from self._grouped("  ", FIRES)
        yield f"  decisions that would have been different: {len(self.times(DECIDES))}"
        yield from self._grouped("    ", DECIDES)
        if times := self.times(CONTRADICTS):
            yield f"  states that would contradict themselves: {len(times)} ({_span(times)})"
            yield next(f"    {text}" for _, kind, text in self.found if kind == CONTRADICTS)

    def _grouped(self, indent: str, kind: str) -> Iterator[str]:
        """Each text of a kind with its times."""
        times = defaultdict(list)
        for t_s, each, text in self.found:
            if each == kind:
                times[text].append(t_s)
        return (f"{indent}{_span(of_text)}: {text}" for text, of_text in times.items())


def summary(missions: Sequence[MissionReplay]) -> Iterator[str]:
    """Several replays as `kb try` prints them: those in which something happens, and how many they
    are.
    """
    for mission in missions:
        if mission.found or len(missions) == 1:
            yield from mission.lines()
    if len(missions) > 1:
        firing, changed, contradictions = (
            [len(mission.times(kind)) for mission in missions]
            for kind in (FIRES, DECIDES, CONTRADICTS)
        )
        yield (
            f"{len(missions)} missions: fires in {sum(map(bool, firing))}, different decisions in "
            f"{sum(map(bool, changed))} ({number_of(sum(changed), 'decision')}), "
            f"contradictions in {sum(map(bool, contradictions))}"
        )


def _span(times: Sequence[float]) -> str:
    first, last = times[0], times[-1]
    return (
        f"{first:.2f} s" if first == last else f"{first:.2f} s to {last:.2f} s, {len(times)} states"
    )


def try_rules(
    folder: Path,
    rule: str | None = None,
    *,
    disabled: str | None = None,
    limit_s: float = TIME_LIMIT_S,
) -> Iterator[MissionReplay]:
    """Try adding or disabling rules on recorded missions, one after the other.

    Only the recorded states are evaluated: the consequences of different decisions are not
    simulated.

    Args:
        folder: output folder of a mission or of a campaign that recorded its knowledge, or a folder
            of such folders.
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
        found = tuple(
            (record.t_s, *each) for record in mission.records for each in trial.replay(record.state)
        )
        point = f", point {mission.point}" if mission.point else ""
        which = f"{mission.manager}, run {mission.run}{point}" if mission.run else ""
        yield MissionReplay(where, which, len(mission.records), found)


class _Trial:
    """The knowledge base of a scenario, without the change and with it."""

    def __init__(
        self, scenario: Scenario, rule: str | None, disabled: str | None, limit: TimeLimit
    ) -> None:
        self.scenario = scenario
        base, settings = read_base(scenario), ManagingSettings.of(scenario)
        self.before = KnowledgeBase.of(base, settings, scenario.knowledge.reasoner, limit)
        tried = () if rule is None else read_rules(rule, base.vocabulary)
        unwanted = () if disabled is None else (disabled,)
        with located(place="--disable"):
            base.check_names((), unwanted)
        self.after = self.before.changed(base.with_files((), [tried], unwanted))
        self.with_rule = self.after.base if disabled is None else base
        names = {disabled, *(each.name for each in tried)}
        self.rules = [each for each in self.with_rule.content.enabled_rules if each.name in names]
        self.pellet = tracing_pellet(self.with_rule)

    def replay(self, state: KnowledgeState) -> Iterator[tuple[str, str]]:
        """The effects of the change in a recorded state, if it has any; see MissionReplay."""
        before, after = self.before.outcome(Situation(state)), self.after.outcome(Situation(state))
        if after.reasoning is None:
            yield CONTRADICTS, f"contradiction: {after.contradiction}"
            return
        for name, *choices in differing_decisions(before, after):
            one, other = (_UNCHANGED.get(each, each) for each in choices)
            if one != other:
                yield DECIDES, f"{name}: {other} instead of {one}"
        yield from ((FIRES, words) for words in self._firings(state))

    def _firings(self, state: KnowledgeState) -> Iterator[str]:
        """What the tried rules conclude, and the individuals that their variables stand for."""
        tracer = Tracer(self.with_rule, state, self.pellet)
        for bindings, facts in (firing for rule in self.rules for firing in tracer.firings(rule)):
            individuals = [each for each in bindings if not isinstance(each[1], Decimal)]
            bound = with_bindings(individuals) or " with nothing bound"
            yield f"{', '.join(map(str, facts))}{bound}"
