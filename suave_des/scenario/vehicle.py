"""A vehicle as data: body, thrusters and camera; values with their sources: scenarios/vehicles."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field, field_validator

from suave_des.scenario.quantities import FARTHEST_M, Strict, Within, wrong

Positive = Annotated[float, Field(strict=True), Within(gt=0, le=1e6)]
Offset = Annotated[float, Field(strict=True), Within(-FARTHEST_M, FARTHEST_M, unit="m")]
Component = Annotated[float, Field(strict=True), Within(-1.0, 1.0)]
_UNIT_TOLERANCE = 1e-3


class Camera(Strict):
    """The camera, which looks straight down."""

    field_of_view_deg: Annotated[float, Field(strict=True), Within(gt=0, lt=180, unit="degrees")]
    """Full angle of view, in x and in y alike; the search spaces the turns of its spiral by it, too."""

    @property
    def tangent(self) -> float:
        """Half the width of the view at a distance of 1 m."""
        return math.tan(math.radians(self.field_of_view_deg) / 2.0)


class ThrusterDescription(Strict):
    """One thruster, in the body frame (x forward, y left, z up, origin at the centre of mass)."""

    position_m: tuple[Offset, Offset, Offset]
    """Where it is."""
    direction: tuple[Component, Component, Component]
    """Unit vector of its force at positive command."""

    @field_validator("direction", mode="after")
    @classmethod
    def _is_a_unit_vector(cls, value: Any) -> Any:
        length = math.hypot(*value)
        if abs(length - 1.0) > _UNIT_TOLERANCE:
            raise wrong(f"{list(value)} has length {length:.4g}", "give a vector of length 1")
        return value


class VehicleDescription(Strict):
    """The vehicle's body, thrusters and camera."""

    name: str
    """Name, for people."""
    mass_kg: Positive
    """Mass."""
    inertia_kg_m2: tuple[Positive, Positive, Positive]
    """Principal moments of inertia Ixx, Iyy, Izz."""
    displaced_volume_m3: Positive
    """Volume of water that the submerged body displaces."""
    water_density_kg_per_m3: Positive
    """Density of the water."""
    centre_of_buoyancy_m: Offset
    """Height above the centre of mass at which buoyancy acts."""
    quadratic_drag: tuple[Positive, Positive, Positive, Positive, Positive, Positive]
    """Coefficients c of the drag -c |v| v: surge, sway, heave (N s^2/m^2), roll, pitch, yaw (N m s^2)."""
    thrust_limit_n: Positive
    """Greatest thrust of each thruster, in both directions."""
    thrusters: Annotated[tuple[ThrusterDescription, ...], Field(min_length=6, max_length=6)]
    """The six thrusters, in the order of their numbers."""
    camera: Camera
    """The camera."""
