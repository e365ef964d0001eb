"""The behaviour tree managers of revision 1.5, and the parts that their tree is made of.

Source: the two trees of kas-lab/suave 1.5.0; suave_extended.xml is the one that recharges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np

from suave_des.domain import (
    BATTERY_LEVEL,
    FOLLOW_PIPELINE,
    GENERATE_RECHARGE_PATH,
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    SURFACE,
    SURFACE_MODE,
    UNGROUND_MODE,
    WATER_VISIBILITY,
)
from suave_des.errors import InputError
from suave_des.managing.base import Dependencies, System
from suave_des.managing.simple import RemembersFailures
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import draw

ON_THE_WAY = "normal"
"""Mode in which the vehicle goes to the recharge station."""
ARRIVED = "inactive"


@lru_cache(maxsize=64)
def least_that_reaches(threshold: float) -> float:
    """Find the least number that is not below a threshold for the exemplar's trees, which compare
    in single precision: a number is rounded to it first.
    """
    rounded = np.float32(threshold)
    midway = (float(rounded) + float(np.nextafter(rounded, np.float32(-np.inf)))) / 2.0
    if np.float32(midway) >= rounded:
        return midway
    return math.nextafter(midway, math.inf)


@dataclass(eq=False)
class Behaviour:
    """A part of a behaviour tree; nothing here takes longer than a tick.

    Attributes:
        kind: "->" (sequence) ticks its children until one fails, "?" (fallback) until one succeeds,
            "=>" (parallel) ticks all; "!" requests a mode, and succeeds; "" is a condition.
        name: for drawings and timelines.
        children: the parts below, in the order in which they are ticked.
        act: what a condition or request does; it returns whether it succeeded.
        succeeded: whether the last tick of the tree succeeded here; None if it did not come here.
    """

    kind: str
    name: str
    children: tuple[Behaviour, ...] = ()
    act: Callable[[], bool] = bool
    succeeded: bool | None = field(default=None, init=False)

    def tick(self) -> bool:
        """Tick; return whether it succeeded."""
        match self.kind:
            case "->":
                succeeded = all(child.tick() for child in self.children)
            case "?":
                succeeded = any(child.tick() for child in self.children)
            case "=>":
                ticked = [child.tick() for child in self.children]
                succeeded = all(ticked)
            case _:
                succeeded = self.act()
        self.succeeded = succeeded
        return succeeded

    def forget(self) -> None:
        """Forget the last tick."""
        self.succeeded = None
        for child in self.children:
            child.forget()

    def drawing(self, first: str = "", further: str = "") -> Iterator[str]:
        """Draw the tree as lines of text."""
        yield f"{first}{self.kind} {self.name}" if self.kind else f"{first}{self.name}"
        for child in self.children:
            is_last = child is self.children[-1]
            yield from child.drawing(
                further + ("└─ " if is_last else "├─ "), further + ("   " if is_last else "│  ")
            )

    def requests(self, held: tuple[str, ...] = ()) -> Iterator[str]:
        """Summarise the last tick: each mode that was requested, with the conditions that held on
        the way to it.
        """
        for child in self.children:
            if child.succeeded is None:
                continue
            if child.kind == "!":
                yield child.name + (f" ({', '.join(held)})" if held else "")
            elif child.children:
                yield from child.requests(held)
            elif child.succeeded and self.kind == "->":
                held = (*held, child.name)


class BehaviourTree(RemembersFailures):
    """bt: recover a failed thruster; search as high as the visibility allows; follow once the
    pipeline is detected. Other functions get their default mode while they are needed.

    Attributes:
        decides_on: functions that get no default mode.
    """

    decides_on: ClassVar[tuple[str, ...]] = (
        MAINTAIN_MOTION,
        GENERATE_SEARCH_PATH,
        SURFACE,
        FOLLOW_PIPELINE,
    )

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self._settings = system.scenario.managers.bt
        self.period_s = self._settings.tick_period_s
        self.starts_s = draw(self._settings.first_tick_s, system.stream("bt/phase"))
        self._logged = ""
        self.root = self.make_tree()

    def make_tree(self) -> Behaviour:
        """Make the tree; called once, before the mission."""
        return Behaviour("=>", "mission", self._branches())

    def adapt(self) -> None:
        """Tick the tree."""
        if not (self.system.recorded and self._settings.records_ticks):
            self.root.tick()
            return
        self.root.forget()
        self.root.tick()
        if (requested := "; ".join(self.root.requests())) != self._logged:
            self._logged = requested
            self.system.log("tick", requested)

    def drawing(self) -> str:
        """Draw the tree as text."""
        return "\n".join(self.root.drawing())

    @property
    def depends_on(self) -> Dependencies:
        """The thresholds between the search modes."""
        thresholds_m = map(least_that_reaches, self._settings.visibility_thresholds_m)
        return {WATER_VISIBILITY: tuple(sorted(thresholds_m))}

    # The branches of the tree, one for each function.

    def _branches(self) -> tuple[Behaviour, ...]:
        surface = self._while_needed(SURFACE, self._set(SURFACE, SURFACE_MODE))
        mode = self.system.scenario.default_modes.get(FOLLOW_PIPELINE, "fd_follow_pipeline")
        follow = self._while_needed(FOLLOW_PIPELINE, self._set(FOLLOW_PIPELINE, mode))
        return (
            self._motion(),
            self._search(),
            *((surface,) if self.system.scenario.leak is not None else ()),
            follow,
            *self._others(),
        )

    def _others(self) -> Iterator[Behaviour]:
        """Make a branch for each further function that has a default mode."""
        scenario = self.system.scenario
        for function in scenario.needed_functions():
            mode = scenario.default_mode(function)
            if function not in self.decides_on and mode is not None:
                yield self._while_needed(function, self._set(function, mode))

    def _motion(self) -> Behaviour:
        failed = Behaviour("", "a thruster has failed", act=lambda: bool(self.failed))
        recover = self._set(MAINTAIN_MOTION, "fd_recover_thrusters")
        choices = (
            Behaviour("->", "recovery", (failed, recover)),
            self._set(MAINTAIN_MOTION, "fd_all_thrusters"),
        )
        return self._while_needed(MAINTAIN_MOTION, Behaviour("?", "thrusters", choices))

    def _search(self) -> Behaviour:
        # An unknown visibility counts as good; below the lowest threshold, the search stays at the
        # lowest altitude.
        pairs = zip(
            self._settings.visibility_thresholds_m, self._settings.search_modes, strict=True
        )
        heights = [
            Behaviour("->", mode, (self._is_clear(least_m), self._set(GENERATE_SEARCH_PATH, mode)))
            for least_m, mode in pairs
        ]
        lowest = self._set(GENERATE_SEARCH_PATH, self._settings.search_modes[-1])
        return self._while_needed(
            GENERATE_SEARCH_PATH, Behaviour("?", "altitude", (*heights, lowest))
        )

    def _while_needed(self, function: str, branch: Behaviour) -> Behaviour:
        needed = Behaviour("", "is needed", act=lambda: function in self.system.functions)
        return Behaviour("->", function, (needed, branch))

    def _is_clear(self, least_m: float) -> Behaviour:
        reaches_m = least_that_reaches(least_m)

        def holds() -> bool:
            visibility_m = self.system.measured(WATER_VISIBILITY)
            return visibility_m is None or visibility_m >= reaches_m

        return Behaviour("", f"visibility is at least {least_m:g} m, or unknown", act=holds)

    def _set(self, function: str, mode: str) -> Behaviour:
        def request() -> bool:
            self.system.change_mode(function, mode)
            return True

        return Behaviour("!", f"{function} = {mode}", act=request)


class ExtendedBehaviourTree(BehaviourTree):
    """bt_extended: the same, but with a low battery the vehicle goes to recharge first."""

    decides_on = (*BehaviourTree.decides_on, GENERATE_RECHARGE_PATH)

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that the way to the station has its modes, if there is a battery."""
        for mode in (ON_THE_WAY, ARRIVED):
            is_there = loaded.modes.get(GENERATE_RECHARGE_PATH, mode) is not None
            if loaded.scenario.battery is not None and not is_there:
                problem = f"{GENERATE_RECHARGE_PATH} has no mode {mode!r}, which it requests"
                raise InputError(problem, place=loaded.modes.source, remedy="add it")

    @property
    def depends_on(self) -> Dependencies:
        """The conditions of bt, and whether the battery is low."""
        limit = least_that_reaches(self._settings.battery_limit)
        return {**super().depends_on, BATTERY_LEVEL: (limit,)}

    def make_tree(self) -> Behaviour:
        """Make the tree; without a battery there is no station to go to."""
        if self.system.scenario.battery is None:
            return super().make_tree()
        # The exemplar's tree has a sequence under a fallback, which ticks its running child again
        # without asking the guard on the level: the sequence goes on to its last step.
        go = (self._is_low(), self._set(GENERATE_RECHARGE_PATH, ON_THE_WAY))
        end = (self._is_on_the_way(), self._set(GENERATE_RECHARGE_PATH, ARRIVED))
        steps = Behaviour("->", "recharge", go), Behaviour("->", "recharged", end)
        recharging = Behaviour("?", GENERATE_RECHARGE_PATH, steps)
        return Behaviour("=>", "mission", (*self._branches(), recharging))

    def _while_needed(self, function: str, branch: Behaviour) -> Behaviour:
        if self.system.scenario.battery is not None and function in (
            GENERATE_SEARCH_PATH,
            FOLLOW_PIPELINE,
        ):
            pause = Behaviour("->", "pause", (self._is_low(), self._set(function, UNGROUND_MODE)))
            branch = Behaviour("?", "unless the battery is low", (pause, branch))
        return super()._while_needed(function, branch)

    def _is_on_the_way(self) -> Behaviour:
        def holds() -> bool:
            return self.system.modes.current_mode(GENERATE_RECHARGE_PATH) == ON_THE_WAY

        return Behaviour("", "is on the way to the station", act=holds)

    def _is_low(self) -> Behaviour:
        limit = least_that_reaches(self._settings.battery_limit)

        def holds() -> bool:
            level = self.system.measured(BATTERY_LEVEL)
            return level is not None and level < limit and SURFACE not in self.system.functions

        return Behaviour("", f"battery is below {self._settings.battery_limit:g}", act=holds)
