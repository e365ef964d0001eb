"""The timeline fits the terminal; elsewhere each event is one line, so that it can be searched."""

import io
from dataclasses import replace

import pytest

from suave_des.cli.console import PlainConsole, print_timeline
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator


@pytest.fixture(scope="module")
def result() -> MissionResult:
    return Simulator(load_scenario("seams2023")).run("metacontrol", 1, 8, record=True)


def printed(result: MissionResult, width: int, *, terminal: bool) -> list[str]:
    file = io.StringIO()
    print_timeline(PlainConsole(file=file, width=width, force_terminal=terminal, color_system=None), result)
    return file.getvalue().splitlines()


def words(text: str) -> list[str]:
    return text.split()


@pytest.mark.parametrize("width", [80, 100, 132])
def test_on_a_terminal_no_line_is_wider_than_it(result: MissionResult, width: int) -> None:
    assert max(map(len, printed(result, width, terminal=True))) <= width


def test_what_does_not_fit_has_its_detail_in_indented_lines_and_nothing_is_lost(result: MissionResult) -> None:
    narrow, whole = printed(result, 80, terminal=True), printed(result, 80, terminal=False)
    assert words(" ".join(narrow)) == words(" ".join(whole))
    first = next(index for index, line in enumerate(narrow) if "fd_spiral_high -> fd_spiral_medium:" in line)
    assert narrow[first - 1] == "   14.64  metacontrol         adaptation"
    assert narrow[first].startswith(" " * 12 + "f_generate_search_path: fd_spiral_high -> fd_spiral_medium:")
    assert narrow[first + 1].startswith(" " * 12)


def test_elsewhere_each_event_is_one_line(result: MissionResult) -> None:
    lines = printed(result, 120, terminal=False)
    details = [event.detail for event in result.events]
    assert all(line.endswith(detail) for line, detail in zip(lines[3 : 3 + len(details)], details, strict=True))
    assert max(map(len, lines)) > 120


def test_in_a_very_narrow_terminal_it_still_says_everything(result: MissionResult) -> None:
    assert words(" ".join(printed(result, 30, terminal=True)))[-2:] == ["300.1", "s"]


def test_a_detail_of_several_lines_keeps_to_its_columns(result: MissionResult) -> None:
    event = replace(result.events[0], detail="first\nsecond\r\nthird")
    told = replace(result, events=(event, *result.events[1:]))
    assert printed(told, 120, terminal=False)[3].endswith("first second third")
    assert len(printed(told, 120, terminal=False)) == len(printed(result, 120, terminal=False))
