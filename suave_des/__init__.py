"""SUAVE, the self-adaptive underwater vehicle exemplar, as a discrete-event simulation.

What users need is here by name, see docs/reference/python-api.md; modules below may change without
notice. Importing the package starts nothing: no Java, no pandas, no matplotlib until they are
needed.
"""

import os as _os
from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

if _os.name == "nt":
    raise ImportError(
        "suave-des runs on Linux and macOS: on Windows use it in WSL, or in the container of its "
        "Containerfile"
    )

if _TYPE_CHECKING:
    from suave_des.api import RecordedMission, resume_campaign, run_campaign, run_mission
    from suave_des.campaign.campaign import train
    from suave_des.errors import InputError, MissionError, SuaveDesError
    from suave_des.estimates import mean_of
    from suave_des.frame import CampaignFrame
    from suave_des.interfaces.gym import PipelineInspection
    from suave_des.interfaces.trees import PyTreesManager
    from suave_des.kb.knowledge_base import KnowledgeBase
    from suave_des.managed.node import CustomFunction, FunctionContext, ProcessNode
    from suave_des.managing.base import ManagingSubsystem
    from suave_des.managing.metacontrol import Metacontrol
    from suave_des.managing.simple import NoManager, Threshold
    from suave_des.metrics.result import MissionResult
    from suave_des.monitor.diagnostics import FAILED, Kind
    from suave_des.reality.missions import read_conditions, read_real, read_targets
    from suave_des.reality.validation import compare_conditions, compare_with_paper, validate
    from suave_des.records.runs import read_runs
    from suave_des.resources import find
    from suave_des.results.compare import compare_folders
    from suave_des.results.figures import draw_folder
    from suave_des.scenario.ensemble import read_ensemble
    from suave_des.scenario.loader import load_scenario, with_values
    from suave_des.simulation.mission import Mission
    from suave_des.simulation.simulator import Simulator

__version__ = "1.0.0"

__all__ = ["Mission", "MissionResult", "RecordedMission", "Simulator", "run_mission"]
__all__ += ["load_scenario", "with_values"]
__all__ += ["CampaignFrame", "read_ensemble", "resume_campaign", "run_campaign"]
__all__ += [
    "CustomFunction",
    "FunctionContext",
    "ManagingSubsystem",
    "Metacontrol",
    "NoManager",
    "ProcessNode",
    "PyTreesManager",
    "Threshold",
]
__all__ += ["FAILED", "Kind", "PipelineInspection", "train"]
__all__ += [
    "compare_conditions",
    "compare_folders",
    "compare_with_paper",
    "draw_folder",
    "mean_of",
    "read_conditions",
    "read_real",
    "read_runs",
    "read_targets",
    "validate",
]
__all__ += ["InputError", "KnowledgeBase", "MissionError", "SuaveDesError", "find"]

_HOMES = {
    name: module
    for module, names in {
        "api": ("RecordedMission", "resume_campaign", "run_campaign", "run_mission"),
        "campaign.campaign": ("train",),
        "scenario.ensemble": ("read_ensemble",),
        "errors": ("InputError", "MissionError", "SuaveDesError"),
        "estimates": ("mean_of",),
        "frame": ("CampaignFrame",),
        "interfaces.gym": ("PipelineInspection",),
        "interfaces.trees": ("PyTreesManager",),
        "kb.knowledge_base": ("KnowledgeBase",),
        "managed.node": ("CustomFunction", "FunctionContext", "ProcessNode"),
        "managing.base": ("ManagingSubsystem",),
        "managing.metacontrol": ("Metacontrol",),
        "managing.simple": ("NoManager", "Threshold"),
        "metrics.result": ("MissionResult",),
        "monitor.diagnostics": ("FAILED", "Kind"),
        "records.runs": ("read_runs",),
        "resources": ("find",),
        "results.compare": ("compare_folders",),
        "results.figures": ("draw_folder",),
        "reality.missions": ("read_conditions", "read_real", "read_targets"),
        "reality.validation": ("compare_conditions", "compare_with_paper", "validate"),
        "scenario.loader": ("load_scenario", "with_values"),
        "simulation.mission": ("Mission",),
        "simulation.simulator": ("Simulator",),
    }.items()
    for name in names
}
"""Modules, each imported when a name that it has is first used."""


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(_import_module(f"suave_des.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
