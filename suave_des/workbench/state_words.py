"""States as `--at` takes them: NAME=VALUE, a YAML file, or a time of a recorded mission."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from decimal import Decimal
from pathlib import Path

from suave_des.campaign.knowledge_records import CAMPAIGN_KNOWLEDGE_FILE, KNOWLEDGE_FILE, read_knowledge, read_missions
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.knowledge.state import KnowledgeState
from suave_des.metrics.result import KnowledgeRecord
from suave_des.workbench.state_input import StateBuilder


def add_at(builder: StateBuilder, words: Iterable[str], option: str = "--at") -> None:
    """Add parts of a state, each named as is shortest.

    Args:
        builder: to which they are added.
        words: each NAME=VALUE (a quality attribute, a component, or a function with its design), a YAML file of a
            state, or FOLDER@TIME for what a mission recorded last until a time in s.
        option: for messages.

    Raises:
        InputError: it is none of these, or names what the knowledge base does not have.
    """
    for word in words:
        folder, at, time = word.rpartition("@")
        name, equals, value = word.partition("=")
        try:
            if equals and "/" not in name:
                builder.add(_kind(builder, name.strip()), name.strip(), value.strip())
            elif at:
                add_state(builder, recorded_state(recorded_states(Path(folder)), _seconds(time)))
            else:
                builder.add_file(Path(word))
        except InputError as error:
            if error.file is not None and Path(word).is_file():
                raise
            remedy = error.remedy or "NAME=VALUE, a YAML file, or FOLDER@SECONDS of a recorded mission"
            raise InputError(error.problem, place=option, remedy=remedy) from None


def _kind(builder: StateBuilder, name: str) -> str:
    base = builder.base
    kinds = {"measurements": base.quality_attributes, "components": base.components, "groundings": base.functions}
    for kind, known in kinds.items():
        if name in known:
            return kind
    known_names = [each for names in kinds.values() for each in names]
    problem = f"there is no quality attribute, component or function {shown(name)}"
    raise InputError(problem, remedy=did_you_mean(name, known_names))


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{shown(text)} is not a time in s", remedy="such as flown@53.7") from None


def recorded_states(folder: Path, run: int | None = None) -> tuple[KnowledgeRecord, ...]:
    """The states of a recorded mission, or of one run of a campaign that recorded its knowledge.

    Raises:
        InputError: there are none, or the campaign has no such run.
    """
    if (folder / KNOWLEDGE_FILE).is_file():
        return read_knowledge(folder / KNOWLEDGE_FILE)
    if not (folder / CAMPAIGN_KNOWLEDGE_FILE).is_file():
        remedy = "give the folder of suave-des run --manager metacontrol --out FOLDER"
        raise InputError(f"{folder} has no recorded states", remedy=remedy)
    missions = list(read_missions(folder / CAMPAIGN_KNOWLEDGE_FILE))
    for mission in missions:
        if mission.run == run:
            return mission.records
    runs = sorted({mission.run for mission in missions})
    remedy = f"run: a number from {runs[0]} to {runs[-1]}" if runs else "record a campaign with --record-knowledge"
    raise InputError(f"{folder} has no states of run {shown(run)}", remedy=remedy)


def recorded_state(records: Iterable[KnowledgeRecord], at_s: float) -> KnowledgeState:
    """The state that was recorded last until a mission time.

    Raises:
        InputError: the first one came later.
    """
    known = list(records)
    before = [record for record in known if record.t_s <= at_s]
    if not before:
        first = f"the first one is at {known[0].t_s:.2f} s" if known else "there are none"
        raise InputError(f"no state was recorded until {at_s:g} s", remedy=first)
    return before[-1].state


def add_state(builder: StateBuilder, state: KnowledgeState) -> None:
    """Add all parts of a state; what monitors report of things that the ontologies do not have is left out.

    Raises:
        InputError: the knowledge base lacks a function or a design.
    """
    base = builder.base
    parts: dict[str, Mapping[str, str | Decimal | None]] = {
        "objectives": {each.function: each.status for each in state.objectives},
        "groundings": dict(state.groundings),
        "components": {name: status for name, status in state.components if name in base.components},
        "measurements": {name: value for name, value in state.measurements if name in base.quality_attributes},
    }
    for kind, content in parts.items():
        for name, value in content.items():
            builder.add(kind, name, value)
