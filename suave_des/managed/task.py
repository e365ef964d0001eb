"""Tasks of the mission, and the names of the functions that they need."""

from __future__ import annotations

from dataclasses import dataclass

from suave_des.domain import FOLLOW_PIPELINE as FOLLOW
from suave_des.domain import GENERATE_RECHARGE_PATH as RECHARGE
from suave_des.domain import GENERATE_SEARCH_PATH as SEARCH
from suave_des.domain import MAINTAIN_MOTION as MAINTAIN_MOTION

__all__ = ["FOLLOW", "MAINTAIN_MOTION", "RECHARGE", "SEARCH", "Task"]


@dataclass(frozen=True, slots=True)
class Task:
    """A task of the mission, with the functions that it needs."""

    name: str
    functions: tuple[str, ...]
