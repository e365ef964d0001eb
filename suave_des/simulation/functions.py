"""The functions of a scenario that have a node, and the classes of those that the exemplar does not have."""

from __future__ import annotations

from typing import TYPE_CHECKING

from suave_des.domain import GENERATE_RECHARGE_PATH, MISSION_FUNCTIONS, SURFACE
from suave_des.errors import did_you_mean
from suave_des.registry import FUNCTION_GROUP, function_class, registered_functions
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Scenario

if TYPE_CHECKING:  # or a process that only hands out missions would load the vehicle
    from suave_des.managed.custom import CustomFunction


def built_in_functions(scenario: Scenario) -> tuple[str, ...]:
    """List the functions that the exemplar has, in a mission of this scenario."""
    recharge = () if scenario.battery is None else (GENERATE_RECHARGE_PATH,)
    return *MISSION_FUNCTIONS, *recharge, *(() if scenario.leak is None else (SURFACE,))


def custom_functions(loaded: LoadedScenario) -> dict[str, type[CustomFunction]]:
    """Find the classes of a scenario's further functions, by the name of the function.

    They are named under `functions:`; one that a package registers under the function's own name needs no entry.

    Raises:
        InputError: a function that the mission needs has no node, or a class cannot be used.
    """
    scenario, registered = loaded.scenario, registered_functions()
    built_in = built_in_functions(scenario)
    types = {name: name for name in loaded.modes.functions if name in registered and name not in built_in}
    types |= {name: settings.node for name, settings in scenario.functions.items()}
    for name in scenario.needed_functions():
        if name not in built_in and name not in types:
            if name == GENERATE_RECHARGE_PATH:
                raise loaded.layer.error(f"{name} needs a battery", ("mission", "functions"), "add battery: {}")
            remedy = (
                f"name its class: functions: {{{name}: {{node: module:Class}}}}, or install a package that registers "
                f"it (entry point group {FUNCTION_GROUP})"
            )
            if registered:
                remedy += f"; {did_you_mean(name, registered, 'registered')}"
            raise loaded.layer.error(f"function {name} has no node", ("mission", "functions"), remedy)
    return {name: function_class(name, node) for name, node in types.items()}
