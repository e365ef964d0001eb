"""The states that managers reasoned about, as JSON lines: of one mission, and of a campaign.

In knowledge.jsonl each line is the state of a reasoning cycle, if it differs from the one before. The first line of
knowledge_states.jsonl has the scenario, each further one a mission: a table of the distinct states without their
measured values, and for each of those cycles its time, the index of its state in that table, and the measured values.
That takes a fifth of the space. Measured values are text in both, so that they stay exact.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from suave_des.errors import InputError
from suave_des.files import opened
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.metrics.result import KnowledgeRecord
from suave_des.scenario.loader import holder_of
from suave_des.scenario.models import Scenario

KNOWLEDGE_FILE: Final = "knowledge.jsonl"
CAMPAIGN_KNOWLEDGE_FILE: Final = "knowledge_states.jsonl"


@dataclass(frozen=True)
class RecordedMission:
    """A mission's knowledge states.

    Attributes:
        manager: its managing subsystem.
        point: of the campaign's sweep.
        run: number of the run.
        scenario: the campaign's, with the values that are swept as at this point.
        records: in order of time.
    """

    manager: str
    point: int
    run: int
    scenario: Scenario = field(repr=False)
    records: tuple[KnowledgeRecord, ...] = field(repr=False)


def knowledge_text(records: Iterable[KnowledgeRecord]) -> str:
    """Return the content of knowledge.jsonl."""
    return "".join(
        json.dumps(
            {
                "t_s": round(record.t_s, 6),
                **_plain(record.state),
                "measurements": {name: format(value, "f") for name, value in record.state.measurements},
            },
            ensure_ascii=False,
        )
        + "\n"
        for record in records
    )


def scenario_line(scenario: Scenario) -> str:
    """Return the first line of knowledge_states.jsonl."""
    return _line({"scenario": scenario.model_dump(mode="json")})


def mission_line(
    manager: str, point: int, run: int, records: Iterable[KnowledgeRecord], swept: Mapping[str, Any] = {}
) -> str:
    """Return the line of a mission in knowledge_states.jsonl; it depends on the mission alone.

    Args:
        manager: name of the managing subsystem.
        point: of the sweep.
        run: number of the run.
        records: of the mission's result.
        swept: value at this point of each key path in the scenario that is swept.
    """
    states: dict[tuple[Any, ...], int] = {}
    table: list[dict[str, Any]] = []
    cycles = []
    for record in records:
        state: KnowledgeState = record.state
        measured = tuple(name for name, _ in state.measurements)
        key = (state.objectives, state.groundings, state.components, measured)
        index = states.setdefault(key, len(states))
        if index == len(table):
            table.append({**_plain(state), "measured": measured})
        cycles.append([round(record.t_s, 6), index, *(format(value, "f") for _, value in state.measurements)])
    place = {"manager": manager, "point": point, "run": run, "swept": dict(swept)}
    return _line({**place, "states": table, "cycles": cycles})


def _plain(state: KnowledgeState) -> dict[str, Any]:
    return {
        "objectives": [[each.function, each.status, each.always_improve] for each in state.objectives],
        "groundings": dict(state.groundings),
        "components": dict(state.components),
    }


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"


def read_knowledge(path: Path) -> tuple[KnowledgeRecord, ...]:
    """Read knowledge.jsonl.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    with _lines(path, "mission") as lines:
        return tuple(_record(line["t_s"], line, line["measurements"]) for line in lines)


_EMPTY: Mapping[str, Any] = {"scenario": {}}


def read_missions(path: Path) -> Iterator[RecordedMission]:
    """Read knowledge_states.jsonl, mission by mission.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    with _lines(path, "campaign") as lines:
        scenario = next(lines, _EMPTY)["scenario"]
        for content in lines:
            at_point = json.loads(json.dumps(scenario))
            for key_path, value in content["swept"].items():
                holder, key = holder_of(at_point, key_path)
                holder[key] = value
            yield RecordedMission(
                str(content["manager"]),
                int(content["point"]),
                int(content["run"]),
                Scenario.model_validate(at_point),
                tuple(_cycle(content["states"], *cycle) for cycle in content["cycles"]),
            )


@contextmanager
def _lines(path: Path, what: str) -> Iterator[Iterator[Any]]:
    """Parse a file's lines one by one; what goes wrong while one is used is an error that names it."""
    number = 0

    def parsed(file: Iterable[str]) -> Iterator[Any]:
        nonlocal number
        for number, line in enumerate(file, start=1):  # noqa: B007
            yield json.loads(line)

    with opened(path) as stream, io.TextIOWrapper(stream, encoding="utf-8") as file:
        try:
            yield parsed(file)
        except (ValueError, KeyError, TypeError, IndexError, AttributeError, InputError) as error:
            problem = "the scenario" if isinstance(error, ValidationError) else error
            raise InputError(
                f"is damaged: {problem}", file=path, place=f"line {number}", remedy=f"run the {what} again"
            ) from None


def _cycle(states: Sequence[Mapping[str, Any]], t_s: Any, index: int, *values: Any) -> KnowledgeRecord:
    state = states[index]
    return _record(t_s, state, dict(zip(state["measured"], values, strict=True)))


def _record(t_s: Any, content: Mapping[str, Any], measurements: Mapping[str, Any]) -> KnowledgeRecord:
    state = KnowledgeState.of(
        [ObjectiveState(str(name), status, bool(always)) for name, status, always in content["objectives"]],
        groundings=content["groundings"],
        components=content["components"],
        measurements=measurements,
    )
    return KnowledgeRecord(float(t_s), state)
