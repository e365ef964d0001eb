"""A tree of py_trees that never ends a tick ends its mission with an error, and not the campaign."""

import csv
from pathlib import Path

import pytest

from tests.helpers.command import command_here

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

class NeverReturns(py_trees.behaviour.Behaviour):
    def update(self):
        while True:
            pass

class Forever(PyTreesManager):
    def make_tree(self):
        return TicksForever("looks around")

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


def test_a_tick_that_does_not_end_ends_its_mission_only(tmp_path: Path) -> None:
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
        "3 of 4 missions failed; the others are kept",
    ):
        assert words in said
    with (tmp_path / "out" / "runs.csv").open(newline="") as file:
        assert [row["manager"] for row in csv.DictReader(file)] == ["none"]


def test_a_single_mission_ends_with_the_error(tmp_path: Path) -> None:
    (tmp_path / "trees.py").write_text(TREES)
    ended = command_here("run", "seams2023", "--manager", "trees:Forever", cwd=tmp_path)
    assert ended.returncode == 3
    assert "a tick of the tree does not end" in " ".join(ended.stderr.split())
