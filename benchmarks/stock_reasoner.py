"""Measure inferences as one would write them with stock libraries: owlready2's sync_reasoner_pellet
at each period.

Written as a user of owlready2 would who knows it: a fresh world for each inference, because what
Pellet inferred before is never retracted. It starts a Java machine for each inference, which is
what sync_reasoner_pellet does. A mission would spend all its time so: the rest of it takes
milliseconds.

    python benchmarks/stock_reasoner.py [INFERENCES]

prints what so many inferences take, 10 by default, as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import owlready2

from suave_des.domain import (
    FOLLOW_PIPELINE,
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    WATER_VISIBILITY,
)
from suave_des.knowledge.pellet.in_process import java_executable
from suave_des.monitor.diagnostics import FAILED, RECOVERED
from suave_des.resources import shipped_folder

TIME_LIMIT_S = 300.0
REASONING_PERIOD_S = 2.0
SEARCH, INSPECT = ((MAINTAIN_MOTION, task) for task in (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE))
SEARCHING_HIGH = {MAINTAIN_MOTION: "fd_all_thrusters", GENERATE_SEARCH_PATH: "fd_spiral_high"}
INSPECTING = {MAINTAIN_MOTION: "fd_all_thrusters", FOLLOW_PIPELINE: "fd_follow_pipeline"}

_TOMASYS = "http://metacontrol.org/tomasys#"
_PERFORMANCE = "performance"


@dataclass(frozen=True)
class MissionState:
    """What a managing subsystem knows at a reasoning step.

    Attributes:
        functions: that the task requires.
        visibility_m: measured last.
        thruster: status of thruster 1; none: nothing was reported.
        designs: in use, by function.
    """

    functions: tuple[str, ...]
    visibility_m: float
    thruster: str | None = None
    designs: Mapping[str, str] = field(default_factory=dict)


STATES = (
    MissionState(SEARCH, 3.5),
    MissionState(SEARCH, 3.0, None, SEARCHING_HIGH),
    MissionState(SEARCH, 2.0, FAILED, SEARCHING_HIGH),
    MissionState(INSPECT, 1.5, RECOVERED, INSPECTING),
)
"""States that a mission passes through, of all kinds that take the reasoner differently long."""


class StockReasoner:
    """SUAVE's ontologies, in a folder, with stock Pellet."""

    def __init__(self, folder: Path) -> None:
        owlready2.JAVA_EXE = str(java_executable())
        owlready2.onto_path.append(str(folder))
        self._folder = folder

    def plan(self, state: MissionState) -> dict[str, str]:
        """Choose the function design to ground for each objective that is to be adapted."""
        world = owlready2.World()
        suave = world.get_ontology((self._folder / "suave.owl").as_uri()).load()
        terms = world.get_namespace(_TOMASYS)
        self._assert(state, suave, terms)
        owlready2.sync_reasoner_pellet(
            world, infer_property_values=True, infer_data_property_values=True, debug=0
        )
        chosen = dict(self._choose(state, suave, terms))
        world.close()
        return chosen

    @staticmethod
    def _assert(state: MissionState, suave: Any, terms: Any) -> None:
        measured = terms.QAvalue("obs_water_visibility", namespace=suave)
        measured.isQAtype = suave.water_visibility
        measured.hasValue = state.visibility_m
        if state.thruster is not None:
            suave.c_thruster_1.c_status = state.thruster
        for function in state.functions:
            objective = terms.Objective(f"o_{function}", namespace=suave)
            objective.typeF = suave[function]
            design = state.designs.get(function)
            if design is None:
                objective.o_status = "UNGROUNDED"
                continue
            grounding = terms.FunctionGrounding(f"fg_{design}", namespace=suave)
            grounding.typeFD = suave[design]
            grounding.solvesO = objective
            if "spiral" in design:
                grounding.hasQAvalue.append(measured)

    @staticmethod
    def _choose(state: MissionState, suave: Any, terms: Any) -> Iterator[tuple[str, str]]:
        for function in state.functions:
            objective = suave[f"o_{function}"]
            # revision 2023: adapted when the water gets clearer, too
            improvable = "search" in function
            if objective.o_status is None and True not in objective.o_updatable and not improvable:
                continue
            candidates = {}
            for design in terms.FunctionDesign.instances():
                expected = {
                    value.isQAtype.name: float(value.hasValue) for value in design.hasQAestimation
                }
                visible = state.visibility_m >= expected.get(WATER_VISIBILITY, 0.0)
                if (
                    design.solvesF is suave[function]
                    and design.fd_realisability is not False
                    and visible
                ):
                    candidates[design.name] = expected.get(_PERFORMANCE, 0.001)
            if candidates:
                yield function, max(candidates, key=lambda name: candidates[name])


def figures(inferences: int) -> Mapping[str, float]:
    """Time inferences, and extrapolate to a whole mission, which would take some minutes."""
    reasoner = StockReasoner(shipped_folder("ontology"))
    began_s = time.perf_counter()
    for number in range(inferences):
        reasoner.plan(STATES[number % len(STATES)])
    inference_s = (time.perf_counter() - began_s) / inferences
    whole = TIME_LIMIT_S / REASONING_PERIOD_S
    return {
        "inferences_measured": inferences,
        "inference_s": inference_s,
        "inferences_a_mission": whole,
        "mission_s": whole * inference_s,
    }


if __name__ == "__main__":
    print(json.dumps(figures(int(sys.argv[1]) if len(sys.argv) > 1 else 10), indent=2))
