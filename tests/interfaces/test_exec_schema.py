"""The JSON Schema of what suave-des and programs write to each other: every line of a mission fits it."""

import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from suave_des import run_mission
from suave_des.interfaces import exec as programs
from suave_des.metrics.result import MissionMetrics
from tests.helpers.command import EXAMPLES, example_program

RELAY = """
import subprocess, sys
program = subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
with open("lines", "a", buffering=1) as record:
    for message in sys.stdin:
        program.stdin.write(message)
        answer = program.stdout.readline()
        record.write(message + answer)
        print(answer, end="", flush=True)
"""

SUBSCRIBES_TO_ALL = """
import json, sys
for line in sys.stdin:
    answer = {"log": ["taken"], "modes": {}}
    if '"mission_started"' in line:
        answer |= {"protocol": 1, "period_s": 5, "starts_s": 0.5, "depends_on": None,
                   "subscribes_to": ["measured", "component_status", "pose", "distance"]}
    print(json.dumps(answer), flush=True)
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    yield
    programs.end_programs()


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return programs.messages_schema()


def validator(schema: dict[str, Any], definition: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator({"$ref": f"#/$defs/{definition}", "$defs": schema["$defs"]})


def assert_exchange_fits(command: str, scenario: str, schema: dict[str, Any]) -> list[dict[str, Any]]:
    """Run a mission with a program; each message and each answer fits. Return the messages."""
    Path("relay.py").write_text(RELAY)
    run_mission(scenario, f"exec:{sys.executable} relay.py {command}", 1, 8)
    lines = [json.loads(line) for line in Path("lines").read_text().splitlines()]
    messages, answers = lines[::2], lines[1::2]
    whole = jsonschema.Draft202012Validator(schema)
    of = {name: validator(schema, name) for name in ("message", "first_answer", "answer")}
    kinds: set[tuple[str, str | None]] = set()
    for message, answer in zip(messages, answers, strict=True):
        of["message"].validate(message)
        is_first = message["type"] == "mission_started"
        of["first_answer" if is_first else "answer"].validate(answer)
        kind = (message["type"], message.get("kind"))
        if kind not in kinds:  # the whole is any of these definitions
            whole.validate(message)
            whole.validate(answer)
            kinds.add(kind)
    assert messages[0]["type"] == "mission_started" and messages[-1]["type"] == "mission_ended"
    return messages


@pytest.mark.parametrize("language", EXAMPLES)
def test_every_line_of_a_mission_of_the_examples_fits(language: str, schema: dict[str, Any]) -> None:
    messages = assert_exchange_fits(example_program(language), "seams2023", schema)
    assert {"task_requested", "task_cancelled", "adapt"} <= {each["type"] for each in messages}


def test_every_diagnostic_fits(schema: dict[str, Any]) -> None:
    Path("all.py").write_text(SUBSCRIBES_TO_ALL)
    messages = assert_exchange_fits(f"{sys.executable} all.py", "extended", schema)
    kinds = {each["kind"] for each in messages if each["type"] == "diagnostic"}
    assert kinds == set(programs.KINDS)


def test_the_schema_is_one_of_this_version_of_the_protocol(schema: dict[str, Any]) -> None:
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$id"].endswith(f":{programs.PROTOCOL}")
    for name in ("mission_started", "first_answer"):
        assert schema["$defs"][name]["properties"]["protocol"] == {"const": programs.PROTOCOL}


def test_the_schema_has_the_metrics_and_kinds_that_there_are(schema: dict[str, Any]) -> None:
    metrics = schema["$defs"]["mission_ended"]["properties"]["metrics"]
    assert metrics["required"] == [each.name for each in dataclasses.fields(MissionMetrics)]
    assert schema["$defs"]["diagnostic"]["properties"]["kind"]["enum"] == list(programs.KINDS)


@pytest.mark.parametrize(
    ("definition", "line"),
    [
        ("message", {"type": "adapt", "time_s": 1.0}),
        ("message", {"type": "adapt", "time_s": -1.0, "measured": {}}),
        ("message", {"type": "diagnostic", "time_s": 1.0, "kind": "pose", "key": "pose", "value": 1.0}),
        ("answer", {"mode": {}}),
        ("answer", {"modes": {"f_maintain_motion": 1}}),
        ("first_answer", {"period_s": 0.0}),
        ("first_answer", {"protocol": 2}),
    ],
)
def test_a_line_that_is_none_of_the_protocol_does_not_fit(
    definition: str, line: dict[str, Any], schema: dict[str, Any]
) -> None:
    assert not validator(schema, definition).is_valid(line)
