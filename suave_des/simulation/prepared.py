"""The parts that all missions of one scenario share."""

from collections.abc import Mapping
from functools import cached_property, lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from suave_des.chance import Distributions
from suave_des.compiling import Array
from suave_des.managed.follow import InspectionPath
from suave_des.managing.learned import read_learned
from suave_des.registry import manager_class
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.physical import VehicleDescription
from suave_des.simulation.functions import custom_functions
from suave_des.vehicle.model import Thruster, VehicleModel
from suave_des.world.pipeline import sample_points, there_and_back

if TYPE_CHECKING:  # owlready2 is loaded only when it is needed
    from suave_des.knowledge.deliberation import Deliberation


class PreparedScenario:
    """A scenario with the parts that its missions share; see `Simulator` for the arguments."""

    def __init__(
        self,
        loaded: LoadedScenario,
        runs_per_draw: Mapping[str, int] = MappingProxyType({}),
        training: dict[str, dict[str, Any]] | None = None,
    ) -> None:
        self.loaded, self.training = loaded, training
        self.runs_per_draw = dict(runs_per_draw)
        scenario = loaded.scenario
        self.distributions = Distributions(scenario)
        self.points = sample_points(scenario.pipeline.vertices_m, scenario.pipeline.points_per_piece)
        self.path = InspectionPath.along(there_and_back(self.points), scenario.revision.follow.altitude_m)
        self.detection_points = self.points + np.array([0.0, 0.0, scenario.revision.monitors.detected_point_height_m])
        self.duration_s = scenario.mission.time_limit_s + scenario.revision.coordinator.limit_check_period_s
        self.custom_functions = custom_functions(loaded)
        self.vehicle_model = vehicle_model(scenario.vehicle)
        self.view_tangent = scenario.vehicle.camera.tangent
        self.spare_tracks: list[Array] = []  # to allocate one for each mission would fragment memory
        self._learned: dict[str, Mapping[str, Any]] = {}
        self._manager_files: dict[str, Mapping[str, Path]] = {}

    @cached_property
    def knowledge(self) -> "Deliberation":
        """The scenario's knowledge base with its reasoner, opened and checked on first use."""
        from suave_des.scenario_knowledge import open_knowledge

        return open_knowledge(self.loaded)

    def learned(self, manager: str) -> Mapping[str, Any]:
        """Return a manager's training result: in training a mutable one, otherwise the content of its file, if any.

        Raises:
            InputError: the file cannot be read, or has something else in it.
        """
        if self.training is not None:
            return self.training.setdefault(manager, {})
        if manager not in self._learned:
            name = self.loaded.manager_settings(manager).get("learned")
            path = None if name is None else self.loaded.manager_file(manager, str(name))
            self._learned[manager] = {} if path is None else read_learned(path)
        return self._learned[manager]

    def manager_files(self, manager: str) -> Mapping[str, Path]:
        """Find the files that a manager declares, by their names as given.

        Raises:
            InputError: one is not there.
        """
        if manager not in self._manager_files:
            self._manager_files[manager] = dict(self.loaded.declared_files(manager, manager_class(manager)))
        return self._manager_files[manager]


@lru_cache(maxsize=64)
def vehicle_model(description: VehicleDescription) -> VehicleModel:
    """Return a vehicle's constants; equal descriptions give the same object, which is the key of cached matrices."""
    return VehicleModel(
        mass_kg=description.mass_kg,
        inertia_kg_m2=description.inertia_kg_m2,
        displaced_volume_m3=description.displaced_volume_m3,
        water_density_kg_per_m3=description.water_density_kg_per_m3,
        centre_of_buoyancy_m=description.centre_of_buoyancy_m,
        quadratic_drag=description.quadratic_drag,
        thrust_limit_n=description.thrust_limit_n,
        thrusters=tuple(Thruster(each.position_m, each.direction) for each in description.thrusters),
    )
