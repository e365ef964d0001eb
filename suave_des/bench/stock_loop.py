"""Stand-in: the mission as one would write it in SimPy with stock owlready2, asking Pellet at each reasoning period.

Written as a user of these libraries would who knows them: a fresh world for each inference, because what Pellet
inferred before is never retracted; a vehicle that is a point with a limited speed; and no more than the paper's search,
inspection, monitors and planning need. It starts a Java machine for each inference, which is what owlready2's
sync_reasoner_pellet does.

As a program it runs the beginning of a mission, which its argument gives in seconds, and prints what that took as JSON.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Generator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import owlready2
import simpy

from suave_des.knowledge.java import java_executable
from suave_des.resources import shipped_folder

TIME_LIMIT_S = 300.0
REASONING_PERIOD_S = 2.0
SPEED_M_PER_S = 0.3
FAILURE_S, RECOVERY_TAKES_S = 35.0, 10.0
START_M, PIPELINE_X_M, PIPELINE_LENGTH_M = (-17.0, 2.57), -15.0, 50.0
ALTITUDES_M = {"fd_spiral_low": 1.0, "fd_spiral_medium": 2.0, "fd_spiral_high": 3.0}
TASKS = (("f_maintain_motion", "f_generate_search_path"), ("f_maintain_motion", "f_follow_pipeline"))

_TOMASYS = "http://metacontrol.org/tomasys#"
_PERFORMANCE = "performance"
Process = Generator[simpy.Event, None, None]


@dataclass
class Known:
    """What the managing subsystem has been told, and what it has set."""

    functions: tuple[str, ...] = ()
    visibility_m: float = 3.75
    thruster: str | None = None
    designs: dict[str, str] = field(default_factory=dict)


class Reasoner:
    """SUAVE's ontologies with stock Pellet."""

    def __init__(self, folder: Path) -> None:
        owlready2.JAVA_EXE = str(java_executable())
        owlready2.onto_path.append(str(folder))
        self.folder = folder

    def plan(self, known: Known) -> dict[str, str]:
        """The function design to ground for each objective that is to be adapted."""
        world = owlready2.World()
        suave = world.get_ontology((self.folder / "suave.owl").as_uri()).load()
        terms = world.get_namespace(_TOMASYS)
        self._assert(known, suave, terms)
        owlready2.sync_reasoner_pellet(world, infer_property_values=True, infer_data_property_values=True, debug=0)
        chosen = dict(self._choose(known, suave, terms))
        world.close()
        return chosen

    @staticmethod
    def _assert(known: Known, suave: Any, terms: Any) -> None:
        measured = terms.QAvalue("obs_water_visibility", namespace=suave)
        measured.isQAtype = suave.water_visibility
        measured.hasValue = round(known.visibility_m, 3)
        if known.thruster is not None:
            suave.c_thruster_1.c_status = known.thruster
        for function in known.functions:
            objective = terms.Objective(f"o_{function}", namespace=suave)
            objective.typeF = suave[function]
            design = known.designs.get(function)
            if design is None:
                objective.o_status = "UNGROUNDED"
                continue
            grounding = terms.FunctionGrounding(f"fg_{design}", namespace=suave)
            grounding.typeFD = suave[design]
            grounding.solvesO = objective
            if "spiral" in design:
                grounding.hasQAvalue.append(measured)

    @staticmethod
    def _choose(known: Known, suave: Any, terms: Any) -> Generator[tuple[str, str], None, None]:
        for function in known.functions:
            objective = suave[f"o_{function}"]
            improvable = "search" in function  # revision 2023: adapted when the water gets clearer, too
            if objective.o_status is None and True not in objective.o_updatable and not improvable:
                continue
            candidates = {}
            for design in terms.FunctionDesign.instances():
                expected = {value.isQAtype.name: float(value.hasValue) for value in design.hasQAestimation}
                visible = known.visibility_m >= expected.get("water_visibility", 0.0)
                if design.solvesF is suave[function] and design.fd_realisability is not False and visible:
                    candidates[design.name] = expected.get(_PERFORMANCE, 0.001)
            if candidates:
                yield function, max(candidates, key=lambda name: candidates[name])


class Mission:
    """A mission of the paper: search the pipeline, then inspect it."""

    def __init__(self, reasoner: Reasoner) -> None:
        self.env = simpy.Environment()
        self.reasoner = reasoner
        self.known = Known()
        self.position_m = START_M
        self.found_s: float | None = None
        self.inspected_m = 0.0
        self.inferences = 0
        self.reasoning_s = 0.0
        for process in (self._sea, self._thruster, self._coordinator, self._vehicle, self._metacontrol):
            self.env.process(process())

    def run(self, until_s: float) -> None:
        """Run until a mission time."""
        self.env.run(until=until_s)

    def _sea(self) -> Process:
        while True:
            self.known.visibility_m = 1.25 * math.cos(2 * math.pi * self.env.now / 80.0) + 2.5
            yield self.env.timeout(1.0)

    def _thruster(self) -> Process:
        yield self.env.timeout(FAILURE_S)
        self.known.thruster = "FALSE"
        while self.known.designs.get("f_maintain_motion") != "fd_recover_thrusters":
            yield self.env.timeout(1.0)
        yield self.env.timeout(RECOVERY_TAKES_S)
        self.known.thruster = "RECOVERED"

    def _coordinator(self) -> Process:
        self.known.functions = TASKS[0]
        while self.found_s is None:
            yield self.env.timeout(1.0)
        self.known.functions = TASKS[1]

    def _vehicle(self) -> Process:
        """A point on a spiral that gets wider with the camera's view, then along the pipeline."""
        angle, radius_m = 0.0, 0.0
        while True:
            yield self.env.timeout(1.0)
            design = self.known.designs.get("f_generate_search_path")
            if self.found_s is not None:
                if "f_follow_pipeline" in self.known.designs:
                    self.inspected_m = min(PIPELINE_LENGTH_M, self.inspected_m + SPEED_M_PER_S)
            elif design is not None:
                view_m = ALTITUDES_M[design] * math.tan(math.radians(30))
                turn = min(0.1, SPEED_M_PER_S / max(radius_m, 0.1))
                angle, radius_m = angle + turn, radius_m + 2 * view_m * turn / (2 * math.pi)
                x_m, y_m = START_M[0] + radius_m * math.cos(angle), START_M[1] + radius_m * math.sin(angle)
                self.position_m = (x_m, y_m)
                in_view = x_m <= PIPELINE_X_M + view_m and abs(y_m) <= view_m
                if in_view and ALTITUDES_M[design] <= self.known.visibility_m:
                    self.found_s = self.env.now

    def _metacontrol(self) -> Process:
        while True:
            began_s = time.perf_counter()
            designs = self.reasoner.plan(self.known)
            self.reasoning_s += time.perf_counter() - began_s
            self.inferences += 1
            self.known.designs.update(designs)
            if self.known.thruster == "RECOVERED":
                self.known.thruster = None
            yield self.env.timeout(REASONING_PERIOD_S)


def figures(until_s: float) -> Mapping[str, float]:
    """What the beginning of a mission takes, and from that a whole one: a whole mission would take some minutes."""
    began_s = time.perf_counter()
    mission = Mission(Reasoner(shipped_folder("ontology")))
    mission.run(until_s)
    took_s = time.perf_counter() - began_s
    inference_s = mission.reasoning_s / mission.inferences
    whole = math.ceil(TIME_LIMIT_S / REASONING_PERIOD_S)
    others_s = (took_s - mission.reasoning_s) * TIME_LIMIT_S / until_s
    return {
        "inferences_measured": mission.inferences,
        "inference_s": inference_s,
        "inferences_a_mission": whole,
        "mission_s": whole * inference_s + others_s,
    }


if __name__ == "__main__":
    print(json.dumps(figures(float(sys.argv[1]))))
