"""The BlueROV2 (standard configuration, six thrusters) as the exemplar's simulator describes it (kas-lab/suave)."""

import numpy as np

from suave_des.vehicle.model import Thruster, VehicleModel

_H = float(np.sqrt(0.5))

BLUEROV2 = VehicleModel(
    mass_kg=10.0,
    inertia_kg_m2=(0.099, 0.178, 0.269),
    displaced_volume_m3=0.457 * 0.338 * 0.065,
    water_density_kg_per_m3=998.0,
    centre_of_buoyancy_m=0.049,
    quadratic_drag=(33.732, 54.16, 73.225, 3.992, 3.992, 3.992),
    thrust_limit_n=50.0,
    thrusters=(
        Thruster(position_m=(0.14, -0.092, 0.0), direction=(-_H, -_H, 0.0)),
        Thruster(position_m=(0.14, 0.092, 0.0), direction=(-_H, _H, 0.0)),
        Thruster(position_m=(-0.15, -0.092, 0.0), direction=(_H, -_H, 0.0)),
        Thruster(position_m=(-0.15, 0.092, 0.0), direction=(_H, _H, 0.0)),
        Thruster(position_m=(0.0, -0.109, 0.077), direction=(0.0, 0.0, -1.0)),
        Thruster(position_m=(0.0, 0.109, 0.077), direction=(0.0, 0.0, -1.0)),
    ),
)
