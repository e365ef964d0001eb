"""Pipeline detection: the event of the first sight, which the flight finds."""

import math
from dataclasses import dataclass

import simpy

from suave_des.clock import exactly_at
from suave_des.events import Log, PipelineDetected


@dataclass(eq=False)
class PipelineDetector:
    """Says when, and where, a point of the pipeline is seen for the first time.

    The exemplar checks at each pose message, the flight each row of the vehicle's track.

    Attributes:
        detected: the event of the first sight; its value is the index of the point seen.
        first_point: index of the point seen, once detected.
        detected_s: mission time of the first sight; inf before.
    """

    env: simpy.Environment
    log: Log
    first_point: int | None = None
    detected_s: float = math.inf

    def __post_init__(self) -> None:
        self.detected: simpy.Event = self.env.event()

    def detect_at(self, t_s: float, point: int) -> None:
        """Have a point detected at mission time t."""

        def detect(_: simpy.Event) -> None:
            self.first_point, self.detected_s = point, t_s
            self.log("detection", PipelineDetected(point))
            self.detected.succeed(point)

        exactly_at(self.env, t_s).callbacks.append(detect)
