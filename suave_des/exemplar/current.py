"""The current of the exemplar's main branch: a node of its own, and a switch of the runner."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from suave_des.errors import shown
from suave_des.exemplar.files import Parameter
from suave_des.exemplar.keys import KEYS, PATHS, RUNNER, WATER_CURRENT, WAVE


def with_wave(
    given: Mapping[str, Parameter],
    parameters: Sequence[Parameter],
    has_runner: bool,
    notes: list[str],
) -> dict[str, Parameter]:
    """Leave out the switch of HEAD's current, and the current where it is off.

    Raises:
        InputError: it is on, but cannot be read: a mission without this current, or with a part of
            it, is another one.
    """
    wave = {path: each for path, each in given.items() if path.startswith(f"{WAVE}.")}
    switch = given.get(WAVE)
    if _is_on(switch, has_runner):
        _check_wave(wave, switch, parameters)
        notes += [f"{each.place}: read as {path}" for path, each in wave.items()]
        return {path: each for path, each in given.items() if path != WAVE}
    why = f"not imported: {RUNNER}.enable_water_current is not true"
    notes += [f"{each.place}: {why}" for each in wave.values()]
    return {path: each for path, each in given.items() if not path.startswith(WAVE)}


def _is_on(switch: Parameter | None, has_runner: bool) -> bool:
    """Whether the current is on; without a switch, where no runner could switch it on."""
    if switch is None:
        return not has_runner
    if not isinstance(switch.value, bool):
        raise switch.error(f"{shown(switch.value)} is not a boolean", "write true or false")
    return switch.value


def _check_wave(
    wave: Collection[str], switch: Parameter | None, parameters: Sequence[Parameter]
) -> None:
    """Raise an InputError if the current has a key that is not known, or none at all."""
    unread = [
        each
        for each in parameters
        if each.node == WATER_CURRENT and (each.node, each.name) not in PATHS
    ]
    if switch is not None and not wave:
        unread.append(switch)
    if unread:
        known = ", ".join(key.name for key in KEYS if key.node == WATER_CURRENT and key.path)
        problem = f"the current cannot be read: known keys of {WATER_CURRENT} are {known}"
        remedy = f"leave it out, with its switch, and give {WAVE} in the scenario"
        raise unread[0].error(problem, remedy)
