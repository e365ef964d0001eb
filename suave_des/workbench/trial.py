"""A dry run: what one rule more, or one less, would have inferred and decided in recorded missions."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

from pydantic import ValidationError

from suave_des.campaign.knowledge_file import KNOWLEDGE_FILE, read_knowledge
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.base import KnowledgeBase as Ontologies
from suave_des.knowledge.limit import TimeLimit
from suave_des.knowledge.rule_files import RulesFile, hash_with_rules, with_rules
from suave_des.knowledge.rule_parser import parse_rule, parse_rules
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.state import Fact, KnowledgeState, Value
from suave_des.resources import find
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
        folder: the mission's output folder.
        cycles: recorded states.
        moments: those at which the rule fires or changes something, in order of time.
    """

    folder: Path
    cycles: int
    moments: tuple[Moment, ...]


def try_rule(
    folder: Path,
    text: str | None,
    disabled: str | None,
    ontologies: Sequence[Path],
    reasoner: str | None,
    limit_s: float,
) -> tuple[MissionTrial, ...]:
    """Try a rule, or the lack of one, on recorded missions.

    Only the recorded states are reasoned about: what would have followed from another decision is not simulated.

    Args:
        folder: output folder of a mission, or a folder of such folders.
        text: the rule, as "name: body -> head"; it takes the place of those of its name.
        disabled: in its place the name of a rule to do without.
        ontologies: in place of those of the missions' scenario.
        reasoner: in place of the scenario's.
        limit_s: of the reasoner, for one state.

    Raises:
        InputError: there is no recorded mission, or the rule cannot be used.
        KnowledgeError: the ontologies cannot be reasoned with.
    """
    if (text is None) == (disabled is None):
        raise InputError("give a rule, or --disable NAME", remedy="one of the two")
    return tuple(_trial(each, text, disabled, ontologies, reasoner, limit_s) for each in _missions(folder))


def _missions(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise InputError("no such folder", file=folder, remedy="give the folder that suave-des run --out wrote")
    found = [path.parent for path in sorted(folder.glob(f"*/{KNOWLEDGE_FILE}"))]
    if (folder / KNOWLEDGE_FILE).is_file():
        found.insert(0, folder)
    if not found:
        raise InputError(
            f"has no {KNOWLEDGE_FILE}, nor has a folder in it",
            file=folder,
            remedy="suave-des run --manager metacontrol --out records what is reasoned about",
        )
    return found


def _trial(
    folder: Path,
    text: str | None,
    disabled: str | None,
    ontologies: Sequence[Path],
    reasoner: str | None,
    limit_s: float,
) -> MissionTrial:
    scenario = _scenario(folder / _MISSION_FILE)
    knowledge = scenario.knowledge
    base = Ontologies.load(
        ontologies or [find(each, "ontology") for each in knowledge.ontologies],
        values={name: Decimal(repr(value)) for name, value in knowledge.values.items()},
        rules=[find(each, "ontology") for each in knowledge.rules],
        disabled_rules=knowledge.disabled_rules,
    )
    if text is not None:
        name = parse_rule(text, "the rule to try").name
        other = _with(base, text)
    else:
        name = str(disabled)
        other = _without(base, name)
    loop, limit = Loop.of(scenario), TimeLimit(limit_s, "--time-limit")
    before = KnowledgeBase.of(base, loop, reasoner or knowledge.reasoner, limit)
    after = KnowledgeBase.of(other, loop, reasoner or knowledge.reasoner, limit)
    records = read_knowledge(folder / KNOWLEDGE_FILE)
    firing_in = before if text is None else after
    moments = [_moment(record, before, after, name, firing_in) for record in records]
    return MissionTrial(folder, len(records), tuple(each for each in moments if each is not None))


def _scenario(path: Path) -> Scenario:
    try:
        return Scenario.model_validate(json.loads(path.read_text(encoding="utf-8"))["scenario"])
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path, remedy="give a mission's folder") from None
    except (ValueError, KeyError, TypeError, ValidationError):
        raise InputError("is not a mission's record", file=path, remedy="run the mission again") from None


def _with(base: Ontologies, text: str) -> Ontologies:
    file = RulesFile(Path("the rule to try"), text, parse_rules(text, "the rule to try"))
    content = with_rules(base.content, [file.rules(base.vocabulary)], ())
    return replace(
        base, content=content, rules=content.rules, content_hash=hash_with_rules(base.content_hash, [file], ())
    )


def _without(base: Ontologies, name: str) -> Ontologies:
    content = with_rules(base.content, [], [name])
    return replace(
        base, content=content, rules=content.rules, content_hash=hash_with_rules(base.content_hash, [], [name])
    )


def _moment(
    record: KnowledgeRecord, before: KnowledgeBase, after: KnowledgeBase, name: str, firing_in: KnowledgeBase
) -> Moment | None:
    state: KnowledgeState = record.state
    recorded, _ = _decisions(before, state)
    then, problem = _decisions(after, state)
    firings: tuple[Firing, ...] = ()
    if problem is None:
        tracer = Tracer(firing_in.base, state)
        less = after if firing_in is before else before
        without = less.infer(state).inference
        known = without.facts | without.asserted
        rules = [rule for rule in firing_in.base.content.enabled_rules if rule.name == name]
        firings = tuple(_firings(tracer, rules, known))
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
