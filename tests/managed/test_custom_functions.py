"""User-defined functions: named in the scenario or registered by a package, needed by tasks,
switched by modes.
"""

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from suave_des import registry
from suave_des.errors import InputError, MissionError
from suave_des.managed.node import CustomFunction
from suave_des.metrics.result import Event, MissionResult
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.mission import Mission
from suave_des.simulation.simulator import Simulator

MODES = """
f_lights:
  ros__parameters:
    type: system
    parts: f_lights_node
    modes:
      fd_unground: {f_lights_node: inactive}
      fd_dim: {f_lights_node: active.fd_dim}
f_lights_node:
  ros__parameters:
    type: node
    modes:
      fd_dim: {ros__parameters: {power_w: 15.0}}
"""
NEEDED = """
base: seams2023.yaml
modes_file: modes.yaml
mission: {functions: {search_pipeline: [f_lights]}}
default_modes: {f_lights: fd_dim}
"""
NAMED = (
    NEEDED
    + "functions: {f_lights: {node: 'tests.managed.test_custom_functions:Lights', lamps: 2}}\n"
)


class Lights(CustomFunction):
    """Notes what happens to it."""

    def configure(self, mode):
        self.power_w = mode.parameters["power_w"] * self.context.settings.get("lamps", 1)

    def activated(self):
        self.context.log("lights_on", f"{self.power_w:g} W at {self.context.position()[2]:.1f} m")

    def deactivated(self):
        self.context.log("lights_off", "")
        self.context.settings.clear()  # it is this mission's own


@pytest.fixture
def fly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Flies a mission of a scenario given as text."""
    monkeypatch.chdir(tmp_path)
    shipped = load_scenario("seams2023").modes_path.read_text(encoding="utf-8")
    (tmp_path / "modes.yaml").write_text(shipped + MODES, encoding="utf-8")

    def run(text: str, manager: str = "none") -> MissionResult:
        (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
        simulator = Simulator(load_scenario("mine.yaml"))
        first = simulator.run(manager, run=1, seed=1, record=True)
        assert simulator.run(manager, run=1, seed=1, record=True) == first
        return first

    return run


def of_lights(result: MissionResult) -> list[Event]:
    return [event for event in result.events if event.source == "f_lights"]


def test_a_function_is_active_while_the_task_lasts_that_needs_it(fly):
    result = fly(NAMED)
    on, off = of_lights(result)
    assert (on.event, on.detail) == ("lights_on", "30 W at -18.5 m")
    over_s = next(event.t_s for event in result.events if event.event == "task_done")
    assert (off.event, off.t_s) == ("lights_off", over_s + 0.5)


@pytest.mark.parametrize(
    ("manager", "on_by_s"),
    [
        ("none", 0.5),
        ("fixed:fd_spiral_low", 0.5),
        ("fixed:fd_dim", 0.5),
        ("random", 0.5),
        ("threshold", 2.5),  # its first cycle
        ("oracle", 0.0),
        ("bt", 0.6),  # its first tick
        ("bt_extended", 0.6),
    ],
)
def test_a_function_of_the_whole_mission_stays_in_its_default_mode_from_the_start(
    fly, manager, on_by_s
):
    result = fly(NAMED.replace("search_pipeline", "mission_wide"), manager)
    (on,) = of_lights(result)
    assert on.event == "lights_on" and on.t_s <= on_by_s


@pytest.mark.parametrize("manager", ["threshold", "oracle", "bt", "bt_extended"])
def test_managers_that_adapt_leave_a_function_that_they_do_not_know_in_its_default_mode(
    fly, manager
):
    on, off = of_lights(fly(NAMED, manager))
    assert (on.event, off.event) == ("lights_on", "lights_off")


def test_the_caller_finds_a_function_of_the_whole_mission_in_its_default_mode(fly):
    fly(NAMED.replace("search_pipeline", "mission_wide"))
    assert Mission("mine.yaml").mode_manager.current_mode("f_lights") == "fd_dim"


def test_the_mission_itself_stays_the_same(fly):
    assert fly(NAMED).metrics == fly("base: seams2023.yaml\nname: mine\n").metrics


def test_a_package_registers_a_function_under_its_name(fly, monkeypatch):
    point = EntryPoint(
        "f_lights", "tests.managed.test_custom_functions:Lights", registry.FUNCTION_GROUP
    )
    monkeypatch.setattr(
        registry, "entry_points", lambda group: [point] if group == registry.FUNCTION_GROUP else []
    )
    registry._registered.cache_clear()
    try:
        assert [event.event for event in of_lights(fly(NEEDED))] == ["lights_on", "lights_off"]
    finally:
        registry._registered.cache_clear()


@pytest.mark.parametrize(
    ("text", "problem", "remedy"),
    [
        (
            NEEDED,
            "function f_lights has no node",
            "name its class: functions: {f_lights: {node: module:Class}}",
        ),
        (
            NEEDED.replace("[f_lights]", "[f_light]"),
            "there is no function 'f_light'",
            "did you mean",
        ),
        (
            NAMED.replace("Lights'", "Lamps'"),
            "no subclass of CustomFunction named 'Lamps'",
            "suave_des.CustomFunction",
        ),
        (
            NAMED.replace("tests.managed.test_custom_functions:Lights", "x"),
            "no package registers 'x'",
            "module:",
        ),
        (
            NAMED.replace("tests.managed", "nowhere.at_all"),
            "No module named 'nowhere'",
            "must be importable",
        ),
        (NAMED.replace("node: 'tests", "node: '1tests"), "is not a valid name", "letters"),
        (NAMED.replace("node:", "nod:"), "is missing", "add it"),
        (NAMED.replace("{f_lights: {node", "{f_lihgts: {node"), "no function 'f_lihgts'", "f_lig"),
        (
            NEEDED.replace("[f_lights]", "[generate_recharge_path]"),
            "function generate_recharge_path has no node",
            "add battery",
        ),
    ],
)
def test_what_is_missing_is_said(fly, text, problem, remedy):
    with pytest.raises(InputError) as caught:
        fly(text)
    assert problem in caught.value.problem
    assert remedy in str(caught.value.remedy)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("def activate(self): pass", "activate is not a hook, .*did you mean def activated.self."),
        (
            "def activated(self): pass\n    def configured(self, mode): pass",
            "configured is not a hook",
        ),
        (
            "def activated(self): yield self.env.timeout(1.0)",
            "write def activated.self.; only adapt may yield",
        ),
        ("async def activated(self): pass", "write def activated"),
        ("def configure(self): pass", "write def configure.self, mode."),
        ("def __init__(self): pass", "write def __init__.self, context."),
        ("def activated(self): 1 / 0", "s: ZeroDivisionError: division by zero"),
        (
            "def activated(self): self.env.process(self.flicker())\n"
            "    def flicker(self): yield self.env.timeout(0.5); 1 / 0",
            "s: ZeroDivisionError: division by zero",
        ),
        (
            "def activated(self): self.context.bus.subscribe(self.heard)\n    def heard(self, diagnostic): 1 / 0",
            "s: ZeroDivisionError: division by zero",
        ),
        (
            "def __init__(self, context): context.settings['bulbs']",
            "function f_lights: KeyError: 'bulbs'",
        ),
        (
            "def __init__(self, context): pass",
            "function f_lights: .*does not begin with super...__init__.context.",
        ),
        (
            "def activated(self): self.context.sender.send(float('nan'), 0.0, -18.0)",
            "the set-point .nan, 0.0, -18.0.",
        ),
    ],
)
def test_a_function_with_a_wrong_hook_or_that_raises_is_named(fly, tmp_path, body, words):
    module = f"lights_{tmp_path.name}"
    text = f"from suave_des.managed.node import CustomFunction\n\n\nclass Lights(CustomFunction):\n    {body}\n"
    (tmp_path / f"{module}.py").write_text(text, encoding="utf-8")
    with pytest.raises((InputError, MissionError), match=words):
        fly(NAMED.replace("tests.managed.test_custom_functions", module))


def test_a_mode_of_a_function_without_node_is_neither_offered_nor_set(fly):
    fly("base: seams2023.yaml\nmodes_file: modes.yaml\n")
    mission = Mission("mine.yaml", "none", record=True)
    assert mission.mode_manager.available_modes("f_lights") == ()
    assert mission.mode_manager.change_mode("f_lights", "fd_dim") is False
    result = mission.result()
    assert any(
        (event.event, event.detail) == ("refused", "f_lights -> fd_dim") for event in result.events
    )
    assert any("name its class under functions:" in reason for reason in result.remarks)
