"""Managers made of a user-defined tree of py_trees (extra bt)."""

from __future__ import annotations

from collections.abc import Callable

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from suave_des.managing.base import ManagingSubsystem, System

MAX_TICKED = 100_000
"""A tick that goes through more behaviours than this is assumed never to end."""


class PyTreesManager(ManagingSubsystem):
    """Base of managers that tick a tree of py_trees; derive from it, and make the tree.

    The setting `tick_period_s` (0.1 s) under managers: is the period. Each tick whose outcome
    differs from that of the one before is in the timeline of a recorded mission.

    Example:
        >>> class Mine(PyTreesManager):
        ...     def make_tree(self):
        ...         root = py_trees.composites.Selector("search", memory=False)
        ...         clear = self.condition("clear", lambda: (self.system.measured("water_visibility") or 0) > 3.25)
        ...         high = py_trees.composites.Sequence("high", memory=False)
        ...         high.add_children([clear, self.set_mode("f_generate_search_path", "fd_spiral_high")])
        ...         root.add_children([high, self.set_mode("f_generate_search_path", "fd_spiral_low")])
        ...         return root
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = float(system.settings.get("tick_period_s", 0.1))
        self.starts_s = system.first_tick_s("py_trees", self.period_s)
        self.root = self.make_tree()
        self._logged = ""

    def make_tree(self) -> Behaviour:
        """Make the tree; called once, before the mission."""
        raise NotImplementedError(
            "derive from PyTreesManager, and return the root of your tree from make_tree"
        )

    def condition(self, name: str, holds: Callable[[], bool]) -> Behaviour:
        """Make a behaviour that succeeds while a condition holds."""
        return _Leaf(name, holds)

    def set_mode(self, function: str, mode: str) -> Behaviour:
        """Make a behaviour that requests a mode and succeeds; it fails while no task needs the
        function.
        """
        system = self.system
        return _Leaf(
            f"{function} = {mode}",
            lambda: function in system.functions and system.change_mode(function, mode),
        )

    def adapt(self) -> None:
        """Tick the tree.

        Raises:
            RuntimeError: the tick does not end.
        """
        for ticked_before, behaviour in enumerate(self.root.tick()):
            if ticked_before >= MAX_TICKED:
                problem = f"a tick of the tree does not end: {MAX_TICKED:,} behaviours so far"
                raise RuntimeError(f"{problem}, the last one {behaviour.name!r}")
        if self.system.recorded and (ticked := _ticked(self.root)) != self._logged:
            self._logged = ticked
            self.system.log("tick", ticked)

    def drawing(self) -> str:
        """Draw the tree as text."""
        text: str = py_trees.display.unicode_tree(self.root)
        return text.rstrip("\n")


def _ticked(behaviour: Behaviour) -> str:
    """Name a behaviour, its status, and in brackets those below it that were ticked."""
    below = "; ".join(_ticked(each) for each in behaviour.children if each.status != Status.INVALID)
    return f"{behaviour.name} {behaviour.status.name.lower()}{f' ({below})' if below else ''}"


class _Leaf(Behaviour):
    """Succeeds if a function returns True."""

    def __init__(self, name: str, act: Callable[[], bool]) -> None:
        super().__init__(name)
        self._act = act

    def update(self) -> Status:
        return Status.SUCCESS if self._act() else Status.FAILURE
