"""The behaviour tree managers of revision 1.5 (facts: kas-lab/suave, revision 1.5)."""

from collections.abc import Callable, Collection
from functools import partial
from typing import ClassVar

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
from suave_des.managing import behaviours
from suave_des.managing.base import Dependencies, FunctionsManager, ManagedSystem
from suave_des.managing.behaviours import Behaviour, Condition, Fallback, Parallel, Sequence, SetMode
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind


class BehaviourTree(FunctionsManager):
    """bt: recover a failed thruster; search as high as the visibility allows; follow once the pipeline is detected.

    Attributes:
        root: of the tree.
    """

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self._settings = system.scenario.managers.bt
        self.period_s = self._settings.tick_period_s
        self.starts_s = system.stream("bt/phase").uniform(0.0, self.period_s)
        self._failed: set[str] = set()
        self._logged = ""
        self.root = self.make_tree()

    def make_tree(self) -> Behaviour:
        """Make the tree; called once, before the mission."""
        return Parallel("mission", self._branches())

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Remember failed thrusters."""
        if diagnostic.value == FAILED:
            self._failed.add(diagnostic.key)
        else:
            self._failed.discard(diagnostic.key)

    def adapt(self) -> None:
        """Tick the tree."""
        if not (self.system.recorded and self._settings.records_ticks):
            self.root.tick()
            return
        behaviours.tick(self.root)
        if (requested := behaviours.last_tick(self.root)) != self._logged:
            self._logged = requested
            self.system.log("tick", requested)

    def drawing(self) -> str:
        """Draw the tree as text."""
        return behaviours.drawing(self.root)

    @property
    def depends_on(self) -> Dependencies:
        """The thresholds between the search modes."""
        return {WATER_VISIBILITY: tuple(sorted(self._settings.visibility_thresholds_m))}

    # The branches of the tree, one for each function.

    def _branches(self) -> tuple[Behaviour, ...]:
        surface = (self._surface(),) if self.system.scenario.leak is not None else ()
        return self._motion(), self._search(), *surface, self._follow()

    def _motion(self) -> Behaviour:
        failed = Condition("a thruster has failed", holds=lambda: bool(self._failed))
        recover = self._set(MAINTAIN_MOTION, "fd_recover_thrusters")
        choices = (Sequence("recovery", (failed, recover)), self._set(MAINTAIN_MOTION, "fd_all_thrusters"))
        return self._while_needed(MAINTAIN_MOTION, Fallback("thrusters", choices))

    def _search(self) -> Behaviour:
        # An unknown visibility counts as good; below the lowest threshold, the search stays at the lowest altitude.
        pairs = zip(self._settings.visibility_thresholds_m, self._settings.search_modes, strict=True)
        heights = [
            Sequence(mode, (self._is_clear(least_m), self._set(GENERATE_SEARCH_PATH, mode))) for least_m, mode in pairs
        ]
        lowest = self._set(GENERATE_SEARCH_PATH, self._settings.search_modes[-1])
        return self._while_needed(GENERATE_SEARCH_PATH, Fallback("altitude", (*heights, lowest)))

    def _surface(self) -> Behaviour:
        return self._while_needed(SURFACE, self._set(SURFACE, SURFACE_MODE))

    def _follow(self) -> Behaviour:
        mode = self.system.scenario.default_modes.get(FOLLOW_PIPELINE, "fd_follow_pipeline")
        return self._while_needed(FOLLOW_PIPELINE, self._set(FOLLOW_PIPELINE, mode))

    def _while_needed(self, function: str, branch: Behaviour) -> Behaviour:
        return Sequence(function, (Condition("is needed", holds=self._needs(function)), branch))

    def _needs(self, function: str) -> Callable[[], bool]:
        return lambda: function in self.functions

    def _is_clear(self, least_m: float) -> Behaviour:
        def holds() -> bool:
            visibility_m = self.system.measured(WATER_VISIBILITY)
            return visibility_m is None or visibility_m >= least_m

        return Condition(f"visibility is at least {least_m:g} m, or unknown", holds=holds)

    def _set(self, function: str, mode: str) -> Behaviour:
        return SetMode(f"{function} = {mode}", request=partial(self.system.change_mode, function, mode))


class ExtendedBehaviourTree(BehaviourTree):
    """bt_extended: the same, but with a low battery the vehicle goes to recharge first."""

    @property
    def depends_on(self) -> Dependencies:
        """The conditions of bt, and whether the battery is low."""
        return {**super().depends_on, BATTERY_LEVEL: (self._settings.battery_limit,)}

    def make_tree(self) -> Behaviour:
        """Make the tree; without a battery there is no station to go to."""
        if self.system.scenario.battery is None:
            return super().make_tree()
        # Once under way, the vehicle continues until the level has risen: the station recharges the battery at once.
        go = Sequence("low", (self._is_low(), self._set(GENERATE_RECHARGE_PATH, "normal")))
        recharge = Fallback(GENERATE_RECHARGE_PATH, (go, self._set(GENERATE_RECHARGE_PATH, UNGROUND_MODE)))
        return Parallel("mission", (*self._branches(), recharge))

    def _while_needed(self, function: str, branch: Behaviour) -> Behaviour:
        if self.system.scenario.battery is not None and function in (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE):
            pause = Sequence("pause", (self._is_low(), self._set(function, UNGROUND_MODE)))
            branch = Fallback("unless the battery is low", (pause, branch))
        return super()._while_needed(function, branch)

    def _is_low(self) -> Behaviour:
        def holds() -> bool:
            level = self.system.measured(BATTERY_LEVEL)
            return level is not None and level < self._settings.battery_limit and SURFACE not in self.functions

        return Condition(f"battery is below {self._settings.battery_limit:g}", holds=holds)
