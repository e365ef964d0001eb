"""knowledge_states.jsonl: what the managers of a campaign's missions reasoned about, one JSON object a line.

The first line has the scenario, each further one a mission: the distinct states without their measured values in a
table, and for each reasoning cycle whose state differs from the one before its time, the number of its state in that
table, and the measured values as text, so that they stay exact. That takes a fifth of the room of knowledge.jsonl.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from suave_des.errors import InputError
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.scenario.loader import set_value
from suave_des.scenario.models import Scenario
from suave_des.simulation.result import KnowledgeRecord

CAMPAIGN_KNOWLEDGE_FILE: Final = "knowledge_states.jsonl"


@dataclass(frozen=True)
class RecordedMission:
    """A mission's knowledge states.

    Attributes:
        manager: its managing subsystem.
        point: of the campaign's sweep.
        run: number of the run.
        scenario: the campaign's, with what is swept set as at this point.
        records: in order of time.
    """

    manager: str
    point: int
    run: int
    scenario: Scenario = field(repr=False)
    records: tuple[KnowledgeRecord, ...] = field(repr=False)


def scenario_line(scenario: Scenario) -> str:
    """The first line of the file."""
    return _line({"scenario": scenario.model_dump(mode="json")})


def mission_line(
    manager: str, point: int, run: int, records: Iterable[KnowledgeRecord], swept: Mapping[str, Any] = {}
) -> str:
    """The line of a mission; it depends on the mission alone.

    Args:
        manager: name of the managing subsystem.
        point: of the sweep.
        run: number of the run.
        records: of the mission's result.
        swept: value at this point of each key path in the scenario that is swept.
    """
    states: dict[tuple[Any, ...], int] = {}
    cycles = []
    for record in records:
        state: KnowledgeState = record.state
        rest = (state.objectives, state.groundings, state.components, tuple(name for name, _ in state.measurements))
        number = states.setdefault(rest, len(states))
        values = [format(value, "f") for _, value in state.measurements]
        cycles.append([round(record.t_s, 6), number, *values])
    table = [
        {
            "objectives": [[each.function, each.status, each.always_improve] for each in objectives],
            "groundings": dict(groundings),
            "components": dict(components),
            "measured": measured,
        }
        for objectives, groundings, components, measured in states
    ]
    place = {"manager": manager, "point": point, "run": run, "swept": dict(swept)}
    return _line({**place, "states": table, "cycles": cycles})


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"


def read_missions(path: Path) -> Iterator[RecordedMission]:
    """Read such a file, mission by mission.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    try:
        with path.open(encoding="utf-8") as file:
            scenario: dict[str, Any] = {}
            for number, line in enumerate(file, start=1):
                try:
                    content = json.loads(line)
                    if number == 1:
                        scenario = content["scenario"]
                    else:
                        yield _mission(scenario, content)
                except (ValueError, KeyError, TypeError, IndexError, AttributeError, InputError) as error:
                    said = "the scenario" if isinstance(error, ValidationError) else error
                    raise InputError(
                        f"is damaged: {said}", file=path, place=f"line {number}", remedy="run the campaign again"
                    ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy="give a campaign's output folder") from None


def _mission(scenario: Mapping[str, Any], content: Mapping[str, Any]) -> RecordedMission:
    at_point = json.loads(json.dumps(scenario))
    for path, value in content["swept"].items():
        set_value(at_point, path, value)
    return RecordedMission(
        str(content["manager"]),
        int(content["point"]),
        int(content["run"]),
        Scenario.model_validate(at_point),
        tuple(_record(content["states"], cycle) for cycle in content["cycles"]),
    )


def _record(states: Sequence[Mapping[str, Any]], cycle: Sequence[Any]) -> KnowledgeRecord:
    t_s, number, *values = cycle
    state = states[number]
    return KnowledgeRecord(
        float(t_s),
        KnowledgeState.of(
            [ObjectiveState(str(name), status, bool(always)) for name, status, always in state["objectives"]],
            groundings=state["groundings"],
            components=state["components"],
            measurements=dict(zip(state["measured"], values, strict=True)),
        ),
    )
