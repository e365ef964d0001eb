"""Behaviour trees: their parts, how they are drawn, their ticks in the timeline, and trees of
py_trees.
"""

import csv
from itertools import pairwise

import pytest
from typer.testing import CliRunner

from suave_des.cli.main import app
from suave_des.managing.bt import Behaviour
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers.command import command_here

py_trees = pytest.importorskip("py_trees")

from suave_des.interfaces.trees import PyTreesManager  # noqa: E402

SEARCH, FOLLOW = "f_generate_search_path", "f_follow_pipeline"


class Mine(PyTreesManager):
    """The tree bt without the recovery of thrusters, made of py_trees."""

    def make_tree(self):
        search = py_trees.composites.Selector("search", memory=False)
        for mode, least_m in (("high", 3.25), ("medium", 2.25), ("low", -1.0)):
            branch = py_trees.composites.Sequence(mode, memory=False)
            clear = self.condition(
                f"visibility {least_m:g} m", lambda least_m=least_m: self.visibility_m() >= least_m
            )
            branch.add_children([clear, self.set_mode(SEARCH, f"fd_spiral_{mode}")])
            search.add_child(branch)
        root = py_trees.composites.Selector("mission", memory=False)
        root.add_children([self.set_mode(FOLLOW, "fd_follow_pipeline"), search])
        return root

    def visibility_m(self):
        measured = self.system.measured("water_visibility")
        return 9.0 if measured is None else measured


class Unfinished(PyTreesManager):
    """Has no tree."""


def flown(manager: str, **values: object) -> MissionResult:
    settings = {path.replace("__", "."): value for path, value in values.items()}
    loaded = with_values(load_scenario("release15"), {"thruster_events": [], **settings})
    return Simulator(loaded).run(manager, run=1, seed=1, record=True)


def ticked(*outcomes: bool) -> tuple[list[str], list[Behaviour]]:
    seen: list[str] = []
    conditions = [
        Behaviour(
            "",
            str(place),
            act=lambda place=place, outcome=outcome: seen.append(str(place)) or outcome,
        )
        for place, outcome in enumerate(outcomes)
    ]
    return seen, conditions


@pytest.mark.parametrize(
    ("kind", "outcomes", "visited", "succeeds"),
    [
        ("->", (True, True), "01", True),
        ("->", (False, True), "0", False),
        ("?", (False, True, True), "01", True),
        ("?", (False, False), "01", False),
        ("=>", (False, True), "01", False),
        ("=>", (True, True), "01", True),
    ],
)
def test_parts_tick_their_children_as_far_as_they_must(kind, outcomes, visited, succeeds):
    seen, conditions = ticked(*outcomes)
    assert Behaviour(kind, "part", tuple(conditions)).tick() is succeeds
    assert "".join(seen) == visited


def test_a_drawing_has_a_line_for_each_part():
    clear, mode = (
        Behaviour("", "clear", act=lambda: True),
        Behaviour("!", "f = fd_a", act=lambda: True),
    )
    tree = Behaviour("?", "root", (Behaviour("->", "first", (clear, mode)), Behaviour("", "else")))
    expected = ["? root", "├─ -> first", "│  ├─ clear", "│  └─ ! f = fd_a", "└─ else"]
    assert list(tree.drawing()) == expected
    tree.tick()
    assert list(tree.requests()) == ["f = fd_a (clear)"]


@pytest.mark.parametrize(
    ("manager", "scenario"), [("bt", "release15"), ("bt_extended", "extended")]
)
def test_the_command_draws_the_tree_of_a_manager(manager, scenario):
    shown = CliRunner().invoke(app, ["tree", manager, scenario]).output
    assert "visibility is at least 3.25 m, or unknown" in shown
    assert ("battery is below 0.25" in shown) is (manager == "bt_extended")


@pytest.fixture(scope="module")
def ours() -> MissionResult:
    """A mission with the tree bt."""
    return flown("bt")


@pytest.fixture(scope="module")
def noted() -> MissionResult:
    """The same one, with its ticks in the timeline."""
    return flown("bt", managers__bt__records_ticks=True)


def test_ticks_in_the_timeline_change_nothing_else_of_it(ours, noted):
    assert [event for event in noted.events if event.event != "tick"] == list(ours.events)


def test_a_tick_in_the_timeline_has_the_mode_with_its_conditions(noted):
    first = next(event for event in noted.events if event.event == "tick")
    conditions = "is needed, visibility is at least 3.25 m"
    assert f"f_generate_search_path = fd_spiral_high ({conditions}" in first.detail


def test_of_ticks_with_the_same_outcome_the_first_is_in_the_timeline(noted):
    ticks = [event for event in noted.events if event.event == "tick"]
    assert len(ticks) > 1
    assert all(earlier.detail != later.detail for earlier, later in pairwise(ticks))


@pytest.fixture(scope="module")
def mine() -> MissionResult:
    """A mission with the tree that is made of py_trees."""
    return flown(f"{__name__}:Mine")


def test_a_tree_of_py_trees_decides_as_the_same_tree_of_ours(mine, ours):
    modes = [
        [
            event.detail
            for event in result.events
            if event.event == "mode_set" and "motion" not in event.detail
        ]
        for result in (mine, ours)
    ]
    assert modes[0] == modes[1]


def test_ticks_of_a_tree_of_py_trees_are_in_the_timeline(mine):
    assert any(
        event.event == "tick" and "fd_spiral_high success" in event.detail for event in mine.events
    )


def test_a_manager_that_makes_no_tree_is_told_what_to_do():
    with pytest.raises(Exception, match="return the root of your tree from make_tree"):
        flown(f"{__name__}:Unfinished")


pytest.importorskip("py_trees")

TREES = """
import py_trees
from py_trees.common import Status
from suave_des.interfaces.trees import PyTreesManager

class TicksForever(py_trees.behaviour.Behaviour):
    def tick(self):
        while True:
            self.status = Status.RUNNING
            yield self

    def update(self):
        return self.status

class Forever(PyTreesManager):
    def make_tree(self):
        return TicksForever("looks around")

class NeverReturns(py_trees.behaviour.Behaviour):
    def update(self):
        while True:
            pass

class Stuck(PyTreesManager):
    def make_tree(self):
        return NeverReturns("looks around")

class ItsOwnAncestor(PyTreesManager):
    def make_tree(self):
        root = py_trees.composites.Sequence("root", memory=False)
        root.add_child(self.condition("always", lambda: True))
        root.children.append(root)
        return root
"""


def test_a_tick_that_does_not_end_ends_its_mission_only(tmp_path):
    (tmp_path / "trees.py").write_text(TREES)
    names = "none,trees:Forever,trees:Stuck,trees:ItsOwnAncestor"
    options = ("--runs", "1", "--workers", "1", "--time-out", "2", "--quiet", "--out", "out")
    ended = command_here("campaign", "seams2023", "--managers", names, *options, cwd=tmp_path)
    assert ended.returncode == 3
    said = " ".join(ended.stderr.split())
    for words in (
        "a tick of the tree does not end: 100,000 behaviours so far, the last one 'looks around'",
        "not done after 2 s (time-out), in update (trees.py, line ",
        "RecursionError",
        "3 of 4 missions failed, see manifest.json",
    ):
        assert words in said
    with (tmp_path / "out" / "runs.csv").open(newline="") as file:
        assert [row["manager"] for row in csv.DictReader(file)] == ["none"]


def test_a_single_mission_ends_with_the_error(tmp_path):
    (tmp_path / "trees.py").write_text(TREES)
    ended = command_here("run", "seams2023", "--manager", "trees:Forever", cwd=tmp_path)
    assert ended.returncode == 3
    assert "a tick of the tree does not end" in " ".join(ended.stderr.split())
