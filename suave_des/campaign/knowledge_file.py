"""knowledge.jsonl: the states that a mission's manager reasoned about, one JSON object a line, when they changed."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from suave_des.errors import InputError
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.simulation.result import KnowledgeRecord

KNOWLEDGE_FILE = "knowledge.jsonl"


def knowledge_text(records: Iterable[KnowledgeRecord]) -> str:
    """The file: mission times in seconds, measured values as text, so that they stay exact."""
    return "".join(json.dumps(_as_json(record), ensure_ascii=False) + "\n" for record in records)


def _as_json(record: KnowledgeRecord) -> dict[str, Any]:
    state: KnowledgeState = record.state
    return {
        "t_s": round(record.t_s, 6),
        "objectives": [[each.function, each.status, each.always_improve] for each in state.objectives],
        "groundings": dict(state.groundings),
        "components": dict(state.components),
        "measurements": {name: format(value, "f") for name, value in state.measurements},
    }


def read_knowledge(path: Path) -> tuple[KnowledgeRecord, ...]:
    """Read such a file.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy="give a mission's output folder") from None
    return tuple(_record(path, number, line) for number, line in enumerate(lines, start=1))


def _record(path: Path, number: int, line: str) -> KnowledgeRecord:
    try:
        content = json.loads(line)
        state = KnowledgeState.of(
            [ObjectiveState(str(name), status, bool(always)) for name, status, always in content["objectives"]],
            groundings=content["groundings"],
            components=content["components"],
            measurements=content["measurements"],
        )
        return KnowledgeRecord(float(content["t_s"]), state)
    except (ValueError, KeyError, TypeError, AttributeError, InputError) as error:
        raise InputError(
            f"is damaged: {error}", file=path, place=f"line {number}", remedy="run the mission again"
        ) from None
