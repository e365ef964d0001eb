"""SUAVE, the self-adaptive underwater vehicle exemplar, as a discrete-event simulation.

Importing the package starts nothing: no Java, no pandas, no matplotlib until they are needed.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

from suave_des import imports as _imports

if _TYPE_CHECKING:
    from suave_des.api import resume_campaign, run_campaign, stream_campaign
    from suave_des.campaign.single import run_mission
    from suave_des.errors import InputError, MissionError
    from suave_des.scenario.loader import load_scenario, with_values
    from suave_des.simulation.mission import Mission

__version__ = "1.0.0"

__all__ = [
    "InputError",
    "Mission",
    "MissionError",
    "load_scenario",
    "resume_campaign",
    "run_campaign",
    "run_mission",
    "stream_campaign",
    "with_values",
]

_HOMES = {
    "InputError": "suave_des.errors",
    "Mission": "suave_des.simulation.mission",
    "MissionError": "suave_des.errors",
    "load_scenario": "suave_des.scenario.loader",
    "resume_campaign": "suave_des.api",
    "run_campaign": "suave_des.api",
    "run_mission": "suave_des.campaign.single",
    "stream_campaign": "suave_des.api",
    "with_values": "suave_des.scenario.loader",
}
"""Where the names are that the package itself has; each module is imported when its name is first used."""


_imports.when_imported("gymnasium", _imports.register_environments)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(_import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
