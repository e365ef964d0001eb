"""A function of the user's own refuses requests at first; managers ask again."""

import sys
from pathlib import Path

import pytest

from suave_des.managed.node import CustomFunction
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.simulation.mission import Mission
from suave_des.simulation.simulator import Simulator
from tests.helpers.owl_text import individual

MODES = """
f_light:
  ros__parameters:
    type: system
    parts: f_light_node
    modes:
      fd_unground: {f_light_node: inactive}
      fd_dark: {f_light_node: inactive}
      fd_lit: {f_light_node: active.fd_lit}
f_light_node:
  ros__parameters:
    type: node
    modes:
      fd_lit: {ros__parameters: {power_w: 15.0}}
"""
DESIGNS = "".join(
    individual(name, kind, *statements)
    for name, kind, *statements in (
        ("f_light", "Function"),
        (
            *("fd_dark", "FunctionDesign", ("solvesF", ":f_light")),
            *(("hasQAestimation", ":qa_dark"), ("hasQAestimation", ":qa_clear")),
        ),
        ("fd_lit", "FunctionDesign", ("solvesF", ":f_light"), ("hasQAestimation", ":qa_lit")),
        ("qa_clear", "QAvalue", ("isQAtype", ":water_visibility"), ("hasValue", "2.5")),
        ("qa_dark", "QAvalue", ("isQAtype", ":mros:performance"), ("hasValue", "1.0")),
        ("qa_lit", "QAvalue", ("isQAtype", ":mros:performance"), ("hasValue", "0.5")),
    )
)
"""In murky water fd_lit is left; what is better again in clear water waits for a reason to adapt,
such as a recovered thruster.
"""
SCENARIO = """
base: seams2023.yaml
modes_file: modes.yaml
mission: {time_limit_s: 70, functions: {search_pipeline: [f_light]}}
functions: {f_light: {node: 'tests.managing.test_refused_requests:Stubborn', refuses: REFUSED}}
default_modes: {f_light: fd_lit}
signals: {water_visibility: {kind: step, time_s: 20, before: 1.5, after: 3.5}}
latencies: {inference_s: 0.0, mode_change_s: 0.0}
knowledge: {ontologies: [suave.owl]}
"""


class Stubborn(CustomFunction):
    """Refuses each mode as often as its settings say, `refuses: {MODE: TIMES}`."""

    def __init__(self, context):
        super().__init__(context)
        self.left = dict(context.settings["refuses"])

    def accepts(self, mode):
        left = self.left.get(mode.name, 0)
        self.left[mode.name] = max(0, left - 1)
        return left == 0


@pytest.fixture
def stubborn(tmp_path: Path, suave_copy):
    """A scenario whose light refuses some modes at first."""

    def make(refused: str) -> LoadedScenario:
        shipped = load_scenario("seams2023").modes_path.read_text(encoding="utf-8")
        (tmp_path / "modes.yaml").write_text(shipped + MODES, encoding="utf-8")
        suave_copy(DESIGNS)
        path = tmp_path / "mine.yaml"
        path.write_text(SCENARIO.replace("REFUSED", refused), encoding="utf-8")
        return load_scenario(path)

    return make


def times_s(result: MissionResult, event: str, detail: str) -> list[float]:
    """When something was recorded."""
    return [each.t_s for each in result.events if (each.event, each.detail) == (event, detail)]


@pytest.mark.parametrize("times", [1, 3])
def test_metacontrol_asks_at_each_cycle_for_what_a_recovery_made_possible_until_it_is_accepted(
    stubborn, times
):
    simulator = Simulator(stubborn(f"{{fd_dark: {times}}}"))
    found = simulator.run("metacontrol", 1, 1, record=True)
    (recovered_s,) = times_s(found, "component_status", "c_thruster_1 RECOVERED")
    (accepted_s,) = times_s(found, "mode_requested", "f_light -> fd_dark")
    refused_s = times_s(found, "refused", "f_light -> fd_dark")
    assert recovered_s <= refused_s[0] < recovered_s + 2.0
    cycles_s = [refused_s[0] + 2.0 * number for number in range(times + 1)]
    assert [*refused_s, accepted_s] == pytest.approx(cycles_s)


def test_metacontrol_does_not_ask_for_what_it_has_when_another_request_was_refused(stubborn):
    found = Simulator(stubborn("{fd_dark: 3}")).run("metacontrol", 1, 1, record=True)
    assert len(times_s(found, "mode_requested", "f_maintain_motion -> fd_all_thrusters")) == 2


def test_a_behaviour_tree_asks_at_each_tick_though_nothing_else_changes(stubborn):
    mission = Mission(stubborn("{fd_lit: 100}"), "bt")
    mission.advance(12.0)
    assert mission.mode_manager.refusals == 100
    assert mission.mode_manager.current_mode("f_light") == "fd_lit"


def test_a_refused_request_is_no_error_of_a_program_s(stubborn, tmp_path):
    (tmp_path / "program.py").write_text(
        "import json, sys\n"
        "for line in sys.stdin:\n"
        "    print(json.dumps({'modes': {'f_light': 'fd_lit'}}), flush=True)\n"
    )
    manager = f"exec:{sys.executable} {tmp_path / 'program.py'}"
    found = Simulator(stubborn("{fd_lit: 1}")).run(manager, 1, 1, record=True)
    assert len(times_s(found, "refused", "f_light -> fd_lit")) == 1
    assert times_s(found, "mode_requested", "f_light -> fd_lit")[0] == 0.0


def test_a_caller_is_told_whether_the_function_accepts_a_mode(stubborn):
    mission = Mission(stubborn("{fd_lit: 1}"))
    assert [mission.change_mode("f_light", "fd_lit") for _ in range(2)] == [False, True]
