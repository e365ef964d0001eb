"""The replay: a page that plays missions, read, repeated or run, with the reasoning behind each
adaptation.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from suave_des import __version__
from suave_des.api import run_mission
from suave_des.campaign.campaign import opened_campaign
from suave_des.compiling import Array
from suave_des.domain import FOLLOW_PIPELINE, SEA_BED_Z_M, THRUSTER_NAMES, UNGROUND_MODE
from suave_des.errors import InputError, KnowledgeError
from suave_des.events import ComponentStatus, PipelineDetected
from suave_des.files import check_folder
from suave_des.kb.explain import LEFT_OUT, Derivation, verdicts
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.states import ManagingSettings
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.rdf import local_name
from suave_des.knowledge.reasoner import performance
from suave_des.knowledge.rules import write_rule
from suave_des.knowledge.state import Reasoning
from suave_des.managed.follow import there_and_back
from suave_des.metrics.result import KnowledgeRecord
from suave_des.monitor.diagnostics import FAILED
from suave_des.pages.page import page
from suave_des.records.mission_folder import MISSION_FILE, MissionRecord, read_mission, record_of
from suave_des.records.store import STORE_FILE
from suave_des.resources import find, hashes
from suave_des.results.mission import Rules, adaptations, happenings, mode_spans
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario_knowledge import open_base, read_base
from suave_des.world.pipeline import sample_points

MOST_MISSIONS = 2
"""Missions that a replay shows side by side."""
_DECIMALS: Final = 3
STYLES: Final = ("common.css", "replay.css")
SCRIPTS: Final = ("common.js", "scene_geometry.js", "scene.js", "views.js", "panel.js", "replay.js")
Plain = dict[str, Any]


def missions_in(
    folders: Sequence[Path],
    managers: Sequence[str] = (),
    run: int = 1,
    point: int = 0,
    *,
    confirmed: bool = False,
) -> list[MissionRecord]:
    """Read the missions in folders: a recorded one of each, or those chosen of a campaign, which
    are run again.

    Args:
        managers: names; none: of a campaign the last and the first.
        run, point: of a campaign, the same for all managers.
        confirmed: whether the code of managers and functions that a campaign's folder names may
            run.

    Raises:
        InputError: there is neither a mission nor a campaign in a folder, or too many missions for
            one page.
        MissionError: a manager raised.
    """
    missions: list[MissionRecord] = []
    for folder in folders:
        if (folder / MISSION_FILE).is_file():
            missions.append(read_mission(folder))
        elif (folder / STORE_FILE).is_file():
            opened = opened_campaign(folder, tuple(managers), confirmed=confirmed)
            known = opened.campaign.spec.managers
            chosen = managers or tuple(dict.fromkeys((known[-1], known[0])))
            _check_number(len(chosen))
            missions += [record_of(*opened.run(manager, run, point)) for manager in chosen]
        else:
            check_folder(folder)
            problem = f"has neither a mission ({MISSION_FILE}) nor a campaign that can be run again ({STORE_FILE})"
            remedy = "give the folder that run or campaign wrote with --out"
            raise InputError(problem, file=folder, remedy=remedy)
    _check_number(len(missions))
    for mission, folder in zip(missions, folders, strict=False):
        if mission.settings.pipeline.vertices_m != missions[0].settings.pipeline.vertices_m:
            raise InputError(
                "has another pipeline", file=folder, remedy="give missions over the same one"
            )
    return missions


def missions_run(
    loaded: LoadedScenario, managers: Sequence[str] = ("metacontrol",), run: int = 1, seed: int = 1
) -> list[MissionRecord]:
    """Run missions of a scenario.

    Raises:
        InputError: something chosen cannot be used.
        MissionError: a manager raised.
    """
    _check_number(len(managers))
    return [record_of(run_mission(loaded, each, run, seed), loaded) for each in managers]


def _check_number(number: int) -> None:
    if number > MOST_MISSIONS:
        problem = f"{number} missions are given, and the replay shows {MOST_MISSIONS} side by side at most"
        raise InputError(problem, remedy="name one or two")


# The page


def replay_page(missions: Sequence[MissionRecord]) -> str:
    """Make the page that plays missions over the same pipeline side by side, all at the same
    mission time.
    """
    scenario = missions[0].settings
    battery = scenario.battery
    content = {
        "version": __version__,
        "scenario": {
            "name": scenario.name,
            "description": scenario.description,
            "revision": scenario.revision.name,
            "time_limit_s": scenario.mission.time_limit_s,
            "thresholds_m": list(scenario.reaction_metric.visibility_thresholds_m),
            "pipeline": [list(vertex) for vertex in scenario.pipeline.vertices_m],
            "sea_bed_z_m": SEA_BED_Z_M,
            "view_tangent": scenario.vehicle.camera.tangent,
            "thrusters": len(THRUSTER_NAMES),
            "station": battery
            and [battery.station_x_m, battery.station_y_m, battery.station_radius_m],
        },
        "missions": [mission_on_page(each) for each in missions],
    }
    title = " and ".join(dict.fromkeys(each.name for each in missions))
    return page("replay.html", f"Replay: {title}", content, STYLES, SCRIPTS)


def mission_on_page(mission: MissionRecord) -> Plain:
    """Return a mission as the page plays it; times in s, lengths in m.

    Returns:
        metrics: its row of runs.csv; track: columns of trajectory.csv; modes: by function, times at
            which they took
        effect, with their names; thrusters: times of reports, with the number from 1 and whether it
        works; adaptations: their times; inspected: times at which points of the way along the
        pipeline were reached, with the point's number and the distance until then; way: that way
        from the point seen first, x and y; seen: time, x and y of the first sight, or None; cycles:
        see explain_cycles.
    """
    metrics = mission.metrics
    track = mission.trajectory.round(_DECIMALS)
    modes = {
        function: [(span.begin_s, span.what) for span in spans]
        for function, spans in mode_spans(mission).items()
    }
    events = mission.events[["t_s", "source", "event", "detail"]].itertuples(index=False, name=None)
    way = _way(mission)
    seen = [metrics.get(f"detection_{name}") for name in ("time_s", "x_m", "y_m")]
    return {
        "name": mission.name,
        "metrics": metrics,
        "track": track.astype(object).where(track.notna(), None).to_dict("list"),
        "modes": modes,
        "thrusters": list(_thruster_reports(mission)),
        "adaptations": sorted({each.t_s for each in adaptations(mission)}),
        "events": [(round(t_s, 2), *words) for t_s, *words in events],
        "inspected": list(_inspected(mission, way, modes.get(FOLLOW_PIPELINE, ()))),
        "way": way[:, :2].round(_DECIMALS).tolist(),
        "seen": None if None in seen else seen,
        "cycles": explain_cycles(mission),
    }


def _thruster_reports(mission: MissionRecord) -> Iterator[tuple[float, int, bool]]:
    """When thrusters were reported, with the number from 1, and whether it works."""
    for t_s, (component, status) in happenings(mission, ComponentStatus):
        number = component.rpartition("_")[2]
        if number.isdecimal():
            yield t_s, int(number), status != FAILED


def _way(mission: MissionRecord) -> Array:
    """The way along the pipeline from the point that was seen first, see `there_and_back`; of no
    points, if none was.
    """
    pipeline = mission.settings.pipeline
    points = sample_points(pipeline.vertices_m, pipeline.points_per_piece)
    for _, seen in happenings(mission, PipelineDetected):
        if seen.point < len(points):
            return there_and_back(points)[seen.point :]
    return np.empty((0, 3))


def _inspected(
    mission: MissionRecord, way: Array, modes: Sequence[tuple[float, str]]
) -> Iterator[tuple[float, int, float]]:
    """The points of the way that the vehicle reached while it followed the pipeline, each after the
    one before.
    """
    follow = mission.settings.revision.follow
    follows = [False, *(mode != UNGROUND_MODE for _, mode in modes)]
    lengths_m = np.cumsum(way[:, 2]).tolist()
    next_point = 0
    was_following = False
    start_m = 0.0
    places = mission.trajectory[["t_s", "x_m", "y_m"]].to_numpy()
    for t_s, *place in places.tolist() if len(way) else ():
        is_following = follows[bisect_right(modes, t_s, key=itemgetter(0))]
        if is_following and not was_following:
            next_point = 0 if follow.restarts_on_activation else next_point
            start_m = lengths_m[min(next_point, len(way) - 1)]
        was_following = is_following
        while is_following and next_point < len(way):
            if np.abs(way[next_point, :2] - place).max() > follow.acceptance_m:
                break
            yield round(t_s, 2), next_point, round(lengths_m[next_point] - start_m, 2)
            next_point += 1


# Cycles


def explain_cycles(mission: MissionRecord) -> Plain:
    """Reason about a mission's recorded states again, and explain what follows and what is decided.

    Where the ontologies are not there any more, only the states are given, with a note.

    Returns:
        Plain data for the page. cycles: in order of time, with t_s, objectives (status by function;
        None while all is well), groundings (design in use by function), components (status of each
        that reported one), measured (value of each quality attribute), inferred (index of what
        followed; -1: nothing) and decided (function, design before and chosen, reason, and all
        designs with name, verdict, expected performance, and the reason why one is left out).
        inferences: what followed, each kind of situation once, with t_s and facts (fact, source,
            rule, bindings, and
        because of which facts). rules: text of each rule that took part. note: why some of it is
        missing, or empty.
    """
    scenario = mission.settings
    cycles = list[Plain]()
    known: Plain = {"cycles": cycles, "inferences": [], "rules": {}, "note": ""}
    if not mission.knowledge:
        return known
    try:
        base, note = _base(mission)
        limit = TimeLimit(TIME_LIMIT_S, "the reasoner")
        knowledge = KnowledgeBase.of(
            base, ManagingSettings.of(scenario), scenario.knowledge.reasoner, limit
        )
    except InputError as error:
        cycles += map(_cycle, mission.knowledge)
        return known | {"note": f"Decisions are not explained: {error}"}
    explainer = _Explainer(knowledge)
    for record in mission.knowledge:
        try:
            reasoning = knowledge.infer(record.state)
            inferred = explainer.inferred(record.t_s, reasoning)
            cycles.append(_cycle(record, inferred, list(explainer.decided(reasoning))))
        except KnowledgeError as error:
            missing = "the knowledge base gives no conclusion"
            note = note or f"At {record.t_s:.1f} s {missing}: {error.problem}"
            cycles.append(_cycle(record))
    rules = {
        rule.name: write_rule(rule.name, rule.body, rule.head, local_name).strip()
        for rule in knowledge.base.content.enabled_rules
        if rule.name in explainer.rules
    }
    return known | {"inferences": explainer.inferences, "rules": rules, "note": note}


def _base(mission: MissionRecord) -> tuple[Ontology, str]:
    """Open the mission's ontologies, with a note where one of them has changed since."""
    if mission.loaded is not None:
        return open_base(mission.loaded), ""
    knowledge = mission.settings.knowledge
    # A file beside the scenario has its name from there in the scenario, and its path among the
    # inputs.
    paths = {Path(name).name: Path(name) for name in mission.inputs if Path(name).is_file()}

    def found(name: str) -> Path:
        return paths.get(Path(name).name) or find(name, "ontology")

    ontologies = list(map(found, knowledge.ontologies))
    rules = list(map(found, knowledge.rules))
    base = read_base(mission.settings, ontologies, rules)
    return base, _note_on_changes(mission, hashes((*ontologies, *rules)))


def _note_on_changes(mission: MissionRecord, now: Mapping[str, str]) -> str:
    """A note on which files have another digest now than they had in a mission; empty: none has."""
    before = {Path(name).name: digest for name, digest in mission.inputs.items()}
    today = {Path(name).name: digest for name, digest in now.items()}
    changed = [name for name, digest in today.items() if before.get(name, digest) != digest]
    if not changed:
        return ""
    return f"{', '.join(changed)} changed since the mission: decisions are explained with today's."


class _Explainer:
    """Explains states, the facts of each kind of situation once."""

    def __init__(self, knowledge: KnowledgeBase) -> None:
        self.knowledge = knowledge
        self.inferences: list[Plain] = []
        self.index: dict[object, int] = {}
        self.rules: set[str] = set()

    def inferred(self, t_s: float, reasoning: Reasoning) -> int:
        """The index of what follows; the numbers in its derivations are those of the first such
        cycle.
        """
        facts = reasoning.inference.facts
        state = reasoning.inference.state
        if not facts:
            return -1
        key = facts, state.objectives, state.groundings, state.components
        if key not in self.index:
            self.index[key] = len(self.inferences)
            derived = self.knowledge.explain(state).facts
            for derivation in derived:
                self.rules |= derivation.rules()
            self.inferences.append({"t_s": t_s, "facts": list(map(_step, derived))})
        return self.index[key]

    def decided(self, reasoning: Reasoning) -> Iterator[Plain]:
        inference = reasoning.inference
        for decision in reasoning.plan.decisions:
            designs: list[Plain] = [
                {
                    "name": each.design,
                    "verdict": each.verdict,
                    "performance": float(performance(inference, each.design)),
                    "reason": each.reason if each.verdict == LEFT_OUT else "",
                }
                for each in verdicts(self.knowledge.base, reasoning, decision)
            ]
            designs.sort(key=lambda each: (-each["performance"], each["name"]))
            yield {
                "function": decision.function,
                "before": inference.state.grounded(decision.function),
                "chosen": decision.design,
                "reason": decision.reason,
                "designs": designs,
            }


def _cycle(record: KnowledgeRecord, inferred: int = -1, decided: Sequence[Plain] = ()) -> Plain:
    state = record.state
    return {
        "t_s": round(record.t_s, 2),
        "objectives": {each.function: each.status for each in state.objectives},
        "groundings": dict(state.groundings),
        "components": dict(state.components),
        "measured": {name: round(float(value), 3) for name, value in state.measurements},
        "inferred": inferred,
        "decided": decided,
    }


def _step(derivation: Derivation) -> Plain:
    return {
        "fact": str(derivation.fact),
        "source": derivation.source,
        "rule": derivation.rule,
        "bindings": [(name, _shown(value)) for name, value in derivation.bindings],
        "because": list(map(_step, derivation.premises)),
    }


def _shown(value: object) -> str:
    """A bound value, a number with three decimals at most."""
    if isinstance(value, Decimal):
        return f"{float(value):.3f}".rstrip("0").rstrip(".")
    return str(value)


def adaptation_rules(record: MissionRecord) -> Rules:
    """Find the rules that fired in the reasoning cycle from which each adaptation of a mission
    comes.

    Returns:
        Names of rules, by mission time (s) and function of the adaptation; empty for a manager that
        does not reason.

    Raises:
        InputError: the mission's scenario is of another version.
    """
    known = explain_cycles(record)
    found = {}
    for each in adaptations(record):
        cycle = _decided_in(known["cycles"], each.t_s, each.function, each.after)
        if cycle is not None and cycle["inferred"] >= 0:
            words = each.before.removeprefix("fd_"), each.function.removeprefix("f_")
            facts = known["inferences"][cycle["inferred"]]["facts"]
            steps = [step for step in facts if any(word in step["fact"] for word in words)]
            found[each.t_s, each.function] = tuple(
                dict.fromkeys(rule for step in steps for rule in _rules_of(step))
            )
    return found


def _decided_in(cycles: Sequence[Plain], t_s: float, function: str, design: str) -> Plain | None:
    """Return the last cycle before a time that chose a design for a function in place of
    another.
    """
    for cycle in reversed(cycles):
        for each in cycle["decided"] if cycle["t_s"] <= t_s else ():
            if each["function"] == function and each["before"] != each["chosen"] == design:
                return cycle
    return None


def _rules_of(step: Plain) -> Iterator[str]:
    for premise in step["because"]:
        yield from _rules_of(premise)
    if step["rule"] is not None:
        yield step["rule"]
