"""Facts of the exemplar that several packages share: the depth of the water, and the mission's
functions and tasks.
"""

from dataclasses import dataclass

SEA_BED_Z_M = -20.0
"""The sea bed is the plane of this height in the world frame (z up)."""
SURFACE_Z_M = 0.0
THRUSTER_NAMES = tuple(f"c_thruster_{number}" for number in range(1, 7))
"""The vehicle's thrusters 1 to 6, as the ontology and diagnostics name them."""

MAINTAIN_MOTION = "f_maintain_motion"
GENERATE_SEARCH_PATH = "f_generate_search_path"
FOLLOW_PIPELINE = "f_follow_pipeline"
GENERATE_RECHARGE_PATH = "generate_recharge_path"
SURFACE, SURFACE_MODE = "f_surface", "fd_surface"
"""What a leak demands, and how it is done unless a managing subsystem has another design for it."""
MOVING_FUNCTIONS = (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE, GENERATE_RECHARGE_PATH, SURFACE)
MISSION_FUNCTIONS = (MAINTAIN_MOTION, GENERATE_SEARCH_PATH, FOLLOW_PIPELINE)
"""Functions that the mission's two tasks need, so that a modes file must have them."""

DEFAULT_MODE, UNGROUND_MODE = "__DEFAULT__", "fd_unground"
"""The mode that a function's node starts with, and the one that a cancelled task sets; no function
designs.
"""

MANAGER_GROUP = "suave_des.managers"

WATER_VISIBILITY, BATTERY_LEVEL = "water_visibility", "battery_level"
"""Quality attributes that the exemplar's monitors measure."""


@dataclass(frozen=True, slots=True)
class Task:
    """A task of the mission, with the functions that it needs."""

    name: str
    functions: tuple[str, ...]
