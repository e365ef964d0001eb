"""The timeline has a line for each event, so that it can be searched."""

import io
from dataclasses import replace

import pytest

from suave_des.cli.console import PlainConsole, print_timeline
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator


@pytest.mark.parametrize("terminal", [False, True])
def test_each_event_is_one_line_whatever_its_detail_has(terminal: bool) -> None:
    result = Simulator(load_scenario("seams2023")).run("metacontrol", 1, 8, record=True)
    first = replace(result.events[0], detail="first\nsecond\r\nthird")
    file = io.StringIO()
    console = PlainConsole(file=file, width=80, force_terminal=terminal, color_system=None)
    print_timeline(console, replace(result, events=(first, *result.events[1:])))
    lines = file.getvalue().splitlines()
    details = ["first second third", *(event.detail for event in result.events[1:])]
    assert all(line.endswith(detail) for line, detail in zip(lines[3 : 3 + len(details)], details, strict=True))
    assert lines[-1].split()[-2:] == ["300.1", "s"]
