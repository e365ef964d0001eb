"""The mission as a Gymnasium environment: `gymnasium.make("suave_des/PipelineInspection-v0")`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isfinite
from numbers import Real
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from suave_des.domain import (
    BATTERY_LEVEL,
    FOLLOW_PIPELINE,
    GENERATE_RECHARGE_PATH,
    MISSION_FUNCTIONS,
    THRUSTER_NAMES,
)
from suave_des.errors import InputError, shown
from suave_des.monitor.diagnostics import FAILED
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.scenario.models import AnyDistribution, Exponential, Normal, support
from suave_des.scenario.modes import grounding_modes
from suave_des.simulation.mission import Mission
from suave_des.simulation.simulator import Simulator

Observation = NDArray[np.float32]
NOT_MEASURED = -1.0
DRAWN_SEED_LIMIT = 2**31
_SPREADS = 6.0
"""So many standard deviations are taken for the bounds of a normal distribution that has none."""
REWARD = {"inspected_per_m": 1.0, "searched_per_s": -0.1, "found": 0.0, "adaptation": 0.0}
"""Weights of a step's events: a metre of pipeline that was inspected, a second of search, finding
the pipeline, and an adaptation. A metre earns what 10 s of search cost; a mission gives about -10
to 60."""


class PipelineInspection(gymnasium.Env[Observation, NDArray[np.int64]]):
    """SUAVE's mission; an episode is a mission, a step is one adaptation period.

    Observation: a vector of float32, named by `observation_names`: the values that monitors
    measured last, -1 before the first; for each thruster 1 unless it was reported as failed;
    whether the pipeline is inspected; the distance inspected in m; mission time as a share of the
    limit; for each function with a choice, the index of the mode that was requested last, or -1.

    Action: for each function in `mode_names` the index of a mode. That of a function that the
    current task does not need has no effect. A function with one mode has it as long as it is
    needed.

    An episode terminates with the mission: at the time limit, which belongs to the task, or at the
    end of the path. It is never truncated. `reset(seed=s)` gives the mission of run 1 of a campaign
    with seed s; without a seed one is drawn. `gymnasium.make_vec(..., num_envs=8)` gives many side
    by side (gymnasium's SyncVectorEnv).

    Example:
        >>> environment = PipelineInspection("seams2023", period_s=2.0)
        >>> observation, info = environment.reset(seed=8)
        >>> observation, reward, terminated, truncated, info = environment.step([2, 0])

    Args:
        scenario: path of a scenario file, name of a shipped one, or a Simulator, which several
            environments may share.
        period_s: mission time of a step.
        reward: weights by name in place of those in `REWARD`.
        render_mode: "rgb_array": `render` draws the vehicle's way so far and the pipeline, from
            above.

    Attributes:
        mode_names: functions with a choice, in the order of an action, and their modes in the order
            of its values.

    Raises:
        InputError: something given cannot be used, or an action is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012

    def __init__(
        self,
        scenario: str | Path | Simulator = DEFAULT_SCENARIO,
        period_s: float = 2.0,
        reward: Mapping[str, float] = REWARD,
        render_mode: str | None = None,
    ) -> None:
        if not 0.05 <= period_s < inf:
            raise InputError(f"period_s: {period_s} is out of range", remedy="give 0.05 s or more")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise InputError(
                f"render_mode: there is no {shown(render_mode)}",
                remedy='give "rgb_array", or None; `suave-des replay` shows a mission in a browser',
            )
        _check_weights(reward)
        self._weights = REWARD | dict(reward)
        if not isinstance(scenario, Simulator):
            scenario = Simulator(load_scenario(scenario))
        self._simulator = scenario
        self._period_s = period_s
        self.render_mode = render_mode
        loaded = self._simulator.loaded
        self._limit_s = loaded.scenario.mission.time_limit_s
        self._attributes = sorted(loaded.scenario.signals)
        if loaded.scenario.battery is not None:
            self._attributes.append(BATTERY_LEVEL)
        self.mode_names = _choices(loaded)
        entries = (
            *((name, *_bounds(loaded, name)) for name in self._attributes),
            *((name, 0.0, 1.0) for name in (*THRUSTER_NAMES, "inspects")),
            ("distance_inspected_m", 0.0, 2.0 * sum(self._simulator.path[:, 2].tolist())),
            ("time_share", 0.0, self._simulator.duration_s / self._limit_s),
            *((function, -1.0, len(modes) - 1.0) for function, modes in self.mode_names.items()),
        )
        self.observation_names, low, high = zip(*entries, strict=True)
        self.observation_space = spaces.Box(
            np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32
        )
        self.action_space = spaces.MultiDiscrete([len(modes) for modes in self.mode_names.values()])
        self._mission: Mission | None = None
        self._requested: list[int] = []
        self._needed: frozenset[str] = frozenset()

    def reset(
        self, *, seed: int | None = None, options: dict[str, object] | None = None
    ) -> tuple[Observation, dict[str, object]]:
        """Begin a mission."""
        super().reset(seed=seed)
        self.close()
        drawn = int(self.np_random.integers(DRAWN_SEED_LIMIT)) if seed is None else seed
        self._mission = mission = Mission(self._simulator, seed=drawn)
        self._time_s = 0.0
        self._totals = dict.fromkeys(REWARD, 0.0)
        mission.advance(1e-9)  # the first task is requested at t = 0
        self._task_changed(mission)
        return self._observation(mission), {"seed": drawn, **self._info(mission)}

    def step(
        self, action: Sequence[int] | NDArray[np.int64]
    ) -> tuple[Observation, float, bool, bool, dict[str, object]]:
        """Request the modes of an action, and advance by a period."""
        mission = self._mission
        if mission is None:
            raise InputError("there is no mission", remedy="call reset first")
        chosen = np.asarray(action)
        if not self.action_space.contains(chosen):
            remedy = f"for each function the index of a mode: {self.mode_names}"
            raise InputError(f"action {shown(action)} is not possible", remedy=remedy)
        wanted = chosen.tolist()
        if wanted != self._requested:
            for (function, modes), choice in zip(self.mode_names.items(), wanted, strict=True):
                if function in self._needed:
                    mission.change_mode(function, modes[choice])
            self._requested = wanted
            self._read_modes(mission)
        self._time_s += self._period_s
        if not mission.is_over:
            mission.advance(self._time_s)
        if mission.task is not self._task:
            self._task_changed(mission)
        reward = self._reward(mission)
        return self._observation(mission), reward, mission.is_over, False, self._info(mission)

    def render(self) -> NDArray[np.uint8]:
        """Draw the vehicle's way so far and the pipeline, from above.

        Raises:
            InputError: the environment was made without render_mode="rgb_array", or there is no
                mission.
        """
        if self.render_mode is None or self._mission is None:
            raise InputError(
                "there is nothing to draw",
                remedy='make it with render_mode="rgb_array", and call reset',
            )
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.0, 4.0), dpi=100, layout="constrained")
        axes = figure.add_subplot(aspect="equal", xlabel="x (east), m", ylabel="y (north), m")
        way_m = self._mission.way_m()
        pipeline_m = self._simulator.points
        pose = self._mission.pose
        axes.plot(pipeline_m[:, 0], pipeline_m[:, 1], color="0.6", linewidth=4.0, label="pipeline")
        axes.plot(way_m[:, 0], way_m[:, 1], color="C0", label="vehicle")
        axes.plot(pose.x_m, pose.y_m, "o", color="C0")
        axes.set_title(f"{self._mission.now_s:.0f} s, {self._task.name if self._task else 'over'}")
        axes.legend(loc="best")
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def close(self) -> None:
        """End the mission."""
        if self._mission is not None:
            self._mission.close()
            self._mission = None

    def _read_modes(self, mission: Mission) -> None:
        """Look up the indices of the modes that were requested last."""
        requested = [
            (mission.current_mode(function), modes) for function, modes in self.mode_names.items()
        ]
        self._mode_indices = [
            float(modes.index(mode)) if mode in modes else -1.0 for mode, modes in requested
        ]

    def _task_changed(self, mission: Mission) -> None:
        self._requested = []  # a task brings modes of its own
        self._task = mission.task
        # The way to the recharge station belongs to no task: it may be taken at any time.
        self._needed = frozenset((*mission.functions, GENERATE_RECHARGE_PATH))
        self._inspects = FOLLOW_PIPELINE in mission.functions
        self._read_modes(mission)

    def _reward(self, mission: Mission) -> float:
        """Return what has been earned since the last step."""
        before = self._totals
        found_s = mission.found_s
        self._totals = {
            "searched_per_s": mission.now_s if found_s is None else found_s,
            "inspected_per_m": 0.0 if found_s is None else mission.distance_inspected_m,
            "found": float(found_s is not None),
            "adaptation": mission.mode_manager.adaptations,
        }
        reward = 0.0
        for name, total in self._totals.items():
            reward += self._weights[name] * (total - before[name])
        return float(reward)

    def _observation(self, mission: Mission) -> Observation:
        """Return the monitors' measurements and the state of the mission."""
        values = [mission.measured(name, NOT_MEASURED) for name in self._attributes]
        values += [float(mission.components.get(name) != FAILED) for name in THRUSTER_NAMES]
        share = min(self._time_s, mission.now_s) / self._limit_s
        values += self._inspects, self._totals["inspected_per_m"], share, *self._mode_indices
        return np.array(values, np.float32)

    def _info(self, mission: Mission) -> dict[str, object]:
        """Return mission time and task; at the end the metrics."""
        now = {
            "time_s": min(self._time_s, mission.now_s),
            "task": self._task.name if self._task else "",
        }
        return now | ({"metrics": mission.metrics()} if mission.is_over else {})


def _check_weights(reward: Mapping[str, float]) -> None:
    if not reward.keys() <= REWARD.keys():
        raise InputError(
            f"reward: {shown(dict(reward))} has other keys", remedy=f"give {', '.join(REWARD)}"
        )
    for name, weight in reward.items():
        if not (isinstance(weight, Real) and isfinite(weight)):
            problem = f"reward: {name} is {shown(weight)}"
            raise InputError(problem, remedy="give a finite number")


def _choices(loaded: LoadedScenario) -> dict[str, tuple[str, ...]]:
    """Return the modes of each function that has a choice."""
    functions = [*MISSION_FUNCTIONS]
    if loaded.scenario.battery is not None:
        functions.append(GENERATE_RECHARGE_PATH)
    own = [function for function in loaded.modes.functions if function in functions]
    modes = {function: grounding_modes(loaded.modes.modes(function)) for function in own}
    return {function: known for function, known in modes.items() if len(known) > 1}


def _bounds(loaded: LoadedScenario, attribute: str) -> tuple[float, float]:
    """Return the least and the greatest value that can be observed of a quality attribute."""
    if attribute == BATTERY_LEVEL:
        return NOT_MEASURED, 1.0
    signal = loaded.scenario.signals[attribute]
    keys = "minimum", "maximum", "value", "before", "after"
    stated = [getattr(signal, key) for key in keys if hasattr(signal, key)]
    lows, highs = zip(*map(_span, stated or loaded.tables[attribute][1]), strict=True)
    less, more = _span(signal.noise)
    return min(NOT_MEASURED, min(lows) + less), max(highs) + more


def _span(distribution: AnyDistribution) -> tuple[float, float]:
    low, high = support(distribution)
    if isinstance(distribution, Normal):
        wide = _SPREADS * distribution.std
        return max(low, distribution.mean - wide), min(high, distribution.mean + wide)
    if isinstance(distribution, Exponential):
        return low, low + _SPREADS**2 * distribution.mean
    return low, high


gymnasium.register(
    id="suave_des/PipelineInspection-v0", entry_point=f"{__name__}:PipelineInspection"
)
