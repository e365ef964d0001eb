"""Tasks of the mission, and the names of the functions that they need."""

from __future__ import annotations

from dataclasses import dataclass

MAINTAIN_MOTION = "f_maintain_motion"
SEARCH = "f_generate_search_path"
FOLLOW = "f_follow_pipeline"
RECHARGE = "generate_recharge_path"


@dataclass(frozen=True, slots=True)
class Task:
    """A task of the mission, with the functions that it needs."""

    name: str
    functions: tuple[str, ...]
