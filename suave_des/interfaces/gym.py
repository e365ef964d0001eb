"""The mission as a Gymnasium environment, `gymnasium.make("suave_des/PipelineInspection-v0")`, and its vector form."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Final

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

from suave_des.domain import (
    BATTERY_LEVEL,
    FOLLOW_PIPELINE,
    GENERATE_RECHARGE_PATH,
    MISSION_FUNCTIONS,
    THRUSTER_NAMES,
    THRUSTERS,
)
from suave_des.errors import InputError
from suave_des.interfaces.mission import CALLER, CallerManages
from suave_des.managing.base import ManagedSystem
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.modes import grounding_modes
from suave_des.simulation.simulator import Simulator

Observation = NDArray[np.float32]
NOT_MEASURED: Final = -1.0
_GREATEST: Final = 1e6
"""Bound of measured values and distances, for libraries that need one."""
SEED_LIMIT: Final = 2**31


@dataclass(frozen=True)
class Reward:
    """The reward of a step: a weighted sum over its events.

    By default a metre of pipeline earns what 10 s of search cost; a mission then gives about -10 to 60.

    Attributes:
        inspected_per_m: for each metre that was inspected.
        searched_per_s: for each second of search.
        found: for finding the pipeline.
        adaptation: for each adaptation.
    """

    inspected_per_m: float = 1.0
    searched_per_s: float = -0.1
    found: float = 0.0
    adaptation: float = 0.0


class _Observing(CallerManages):
    """Keeps track of which thrusters work."""

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.works = [1.0] * THRUSTERS

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Take a component's status."""
        if diagnostic.key in THRUSTER_NAMES:
            self.works[THRUSTER_NAMES.index(diagnostic.key)] = float(diagnostic.value != FAILED)


class _Episodes:
    """Successive missions as numbers: the part that the environment and its vector form share."""

    def __init__(
        self,
        scenario: str | Path | Simulator = DEFAULT_SCENARIO,
        period_s: float = 2.0,
        reward: Reward | dict[str, float] | None = None,
    ) -> None:
        if not 0.05 <= period_s < inf:
            raise InputError(f"period_s: {period_s} is out of range", remedy="give 0.05 s or more")
        try:
            self.weights = Reward(**(reward or {})) if not isinstance(reward, Reward) else reward
        except TypeError as error:
            raise InputError(f"reward: {error}", remedy=f"give {', '.join(Reward.__dataclass_fields__)}") from None
        self.simulator = scenario if isinstance(scenario, Simulator) else Simulator(load_scenario(scenario))
        self.period_s = period_s
        loaded = self.simulator.loaded
        self.limit_s = loaded.scenario.mission.time_limit_s
        has_battery = loaded.scenario.battery is not None
        self.attributes = (*sorted(loaded.scenario.signals), *((BATTERY_LEVEL,) if has_battery else ()))
        self.choices = {
            function: modes
            for function in loaded.modes.functions
            if (function in MISSION_FUNCTIONS or (function == GENERATE_RECHARGE_PATH and has_battery))
            and len(modes := grounding_modes(loaded.modes.modes(function))) > 1
        }
        entries = (
            *((name, -_GREATEST, _GREATEST) for name in self.attributes),
            *((name, 0.0, 1.0) for name in (*THRUSTER_NAMES, "inspects")),
            ("distance_inspected_m", 0.0, _GREATEST),
            ("time_share", 0.0, 2.0),
            *((function, -1.0, len(modes) - 1.0) for function, modes in self.choices.items()),
        )
        self.names, low, high = zip(*entries, strict=True)
        self.observation_space = spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)
        self.action_space = spaces.MultiDiscrete([len(modes) for modes in self.choices.values()])
        self.indices: list[tuple[str, dict[str | None, float]]] = [
            (function, {mode: float(n) for n, mode in enumerate(modes)}) for function, modes in self.choices.items()
        ]


class _Episode:
    """One mission as numbers: that of a seed, which is run 1 of a campaign with it."""

    def __init__(self, of: _Episodes, seed: int) -> None:
        self._of = of
        self._run = run = of.simulator.start(CALLER, 1, seed, manager_type=_Observing)
        self._system, self._modes = run.system, run.modes
        assert isinstance(run.manager, _Observing)
        self._works = run.manager.works
        self._t_s = self._now_s = self._searched_s = self._distance_m = 0.0
        self._requested: Sequence[int] = ()
        self._adaptations, self._found, self._has_inspected, self._is_over = 0, False, False, False
        run.advance(1e-9)  # the first task is requested at t = 0
        self._task_changed()

    def step(self, action: Sequence[int]) -> tuple[float, bool]:
        """Request modes, and advance by a period; return the reward, and whether the mission is over."""
        run = self._run
        if action != self._requested:
            self._request(action)
        self._t_s += self._of.period_s
        run.advance(self._t_s)
        self._now_s, self._is_over = run.env.now, run.is_over
        if run.task is not self._task:
            self._task_changed()
        return self._reward(), self._is_over

    def _request(self, action: Sequence[int]) -> None:
        for (function, modes), choice in zip(self._of.choices.items(), action, strict=True):
            if not 0 <= choice < len(modes):
                remedy = f"0 to {len(modes) - 1}: {', '.join(modes)}"
                raise InputError(f"action {choice} for {function} is out of range", remedy=remedy)
            if function in self._needed:
                self._modes.change_mode(function, modes[choice])
        self._requested = action
        self._read_modes()

    def _read_modes(self) -> None:
        current_mode = self._modes.current_mode
        self._mode_indices = [index.get(current_mode(function), -1.0) for function, index in self._of.indices]

    def _task_changed(self) -> None:
        self._requested = ()  # a task brings modes of its own
        self._task = task = self._run.task
        functions = task.functions if task is not None else ()
        # The way to the recharge station belongs to no task: it may be taken at any time.
        self._needed = frozenset((*self._system.lasting_functions, GENERATE_RECHARGE_PATH, *functions))
        self._inspects = FOLLOW_PIPELINE in functions
        self._has_inspected |= self._inspects
        self._read_modes()

    def _reward(self) -> float:
        weights, found_s = self._of.weights, self._run.found_s
        searched_s = self._now_s if found_s is None else found_s
        reward = weights.searched_per_s * (searched_s - self._searched_s)
        self._searched_s = searched_s
        if self._has_inspected:
            distance_m = self._system.distance_inspected_m()
            reward += weights.inspected_per_m * (distance_m - self._distance_m)
            self._distance_m = distance_m
        if found_s is not None and not self._found:
            reward, self._found = reward + weights.found, True
        if weights.adaptation:
            adaptations = self._modes.adaptations
            reward += weights.adaptation * (adaptations - self._adaptations)
            self._adaptations = adaptations
        return float(reward)

    def observation(self) -> Observation:
        """Return the monitors' measurements and the state of the mission."""
        of, measured = self._of, self._system.measured
        values = [NOT_MEASURED if (value := measured(name)) is None else value for name in of.attributes]
        values += self._works
        values += self._inspects, self._distance_m, self._now_s / of.limit_s
        values += self._mode_indices
        return np.array(values, np.float32)

    def info(self) -> dict[str, Any]:
        """Mission time and task; at the end the metrics."""
        info: dict[str, Any] = {"time_s": self._now_s, "task": self._task.name if self._task else ""}
        if self._is_over:
            info["metrics"] = self._run.metrics()
        return info

    def close(self) -> None:
        """Give the mission's memory to the next one."""
        self._of.simulator.give_back(self._run)


class PipelineInspection(gymnasium.Env[Observation, NDArray[np.int64]]):
    """SUAVE's mission; an episode is a mission, a step is one adaptation period.

    Observation: a vector of float32, named by `observation_names`: the values that monitors measured last, -1 before
    the first; for each thruster 1 unless it was reported as failed; whether the pipeline is inspected; the distance
    inspected in m; mission time as a share of the limit; for each function with a choice, the index of the mode that
    was requested last, or -1.

    Action: for each function in `mode_names` the index of a mode. That of a function that the current task does not
    need has no effect. A function with one mode has it as long as it is needed.

    An episode terminates with the mission: at the time limit, which belongs to the task, or at the end of the path. It
    is never truncated. `reset(seed=s)` gives the mission of run 1 of a campaign with seed s; without a seed one is
    drawn.

    Example:
        >>> environment = gymnasium.make("suave_des/PipelineInspection-v0", scenario="seams2023", period_s=2.0)
        >>> observation, info = environment.reset(seed=8)
        >>> observation, reward, terminated, truncated, info = environment.step([2, 0])

    Args:
        scenario: path of a scenario file, name of a shipped one, or a Simulator.
        period_s: mission time of a step.
        reward: weights, see `Reward`.
        render_mode: none; a mission is drawn by `suave-des run --out` and `suave-des figure`.

    Raises:
        InputError: something given cannot be used, or an action is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(
        self,
        scenario: str | Path | Simulator = DEFAULT_SCENARIO,
        period_s: float = 2.0,
        reward: Reward | dict[str, float] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self._episodes = _Episodes(scenario, period_s, reward)
        self.observation_space, self.action_space = self._episodes.observation_space, self._episodes.action_space
        self.render_mode = render_mode
        self._episode: _Episode | None = None

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the observation's entries."""
        return self._episodes.names

    @property
    def mode_names(self) -> dict[str, tuple[str, ...]]:
        """Functions with a choice, in the order of an action, and their modes in the order of its values."""
        return dict(self._episodes.choices)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a mission."""
        super().reset(seed=seed)
        self.close()
        drawn = int(self.np_random.integers(SEED_LIMIT)) if seed is None else seed
        self._episode = _Episode(self._episodes, drawn)
        return self._episode.observation(), {"seed": drawn, **self._episode.info()}

    def step(self, action: Sequence[int] | NDArray[np.int64]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Request the modes of an action, and advance by a period."""
        episode = self._episode
        if episode is None:
            raise InputError("there is no mission", remedy="call reset first")
        reward, is_over = episode.step(_numbers(action, len(self._episodes.choices)))
        return episode.observation(), reward, is_over, False, episode.info()

    def close(self) -> None:
        """End the mission."""
        if self._episode is not None:
            self._episode.close()
            self._episode = None


def _numbers(action: Any, count: int) -> list[int]:
    """An action as plain numbers."""
    rows = np.asarray(action)
    if rows.shape != (count,) or rows.dtype.kind not in "iu":
        raise InputError(f"action {action!r} is not {count} whole numbers", remedy="see action_space")
    numbers: list[int] = rows.tolist()
    return numbers


class PipelineInspectionVector(VectorEnv[Observation, NDArray[np.int64], NDArray[Any]]):
    """Many missions side by side in one process, which share what does not change between them.

    As of `PipelineInspection`, with an array row for each mission. A mission that is over is followed by the next one
    in the step after (`AutoresetMode.NEXT_STEP`); its metrics are in `infos["metrics"]`.

    Example:
        >>> environments = gymnasium.make_vec("suave_des/PipelineInspection-v0", num_envs=8)
        >>> observations, infos = environments.reset(seed=1)
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        scenario: str | Path | Simulator = DEFAULT_SCENARIO,
        period_s: float = 2.0,
        reward: Reward | dict[str, float] | None = None,
        render_mode: str | None = None,
    ) -> None:
        if num_envs < 1:
            raise InputError(f"num_envs: {num_envs} is out of range", remedy="give 1 or more")
        self.num_envs, self.render_mode = num_envs, render_mode
        self._of = of = _Episodes(scenario, period_s, reward)
        self.single_observation_space, self.single_action_space = of.observation_space, of.action_space
        self.observation_space = gymnasium.vector.utils.batch_space(of.observation_space, num_envs)
        self.action_space = gymnasium.vector.utils.batch_space(of.action_space, num_envs)
        self._all: list[_Episode] = []
        self._is_over = np.zeros(num_envs, np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin all missions: those of seed, seed + 1 and so on."""
        super().reset(seed=seed if isinstance(seed, int) else None)
        self.close_extras()
        numbers = range(self.num_envs)
        seeds = list(seed) if isinstance(seed, list) else [None if seed is None else seed + n for n in numbers]
        self._all = [_Episode(self._of, self._drawn() if one is None else one) for one in seeds]
        self._is_over[:] = False
        return self._observations(), {}

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Request the modes of all actions, and advance each mission by a period."""
        rewards, over, infos = np.zeros(self.num_envs), np.zeros(self.num_envs, np.bool_), dict[str, Any]()
        rows = np.asarray(actions)
        if rows.shape != (self.num_envs, len(self._of.choices)) or rows.dtype.kind not in "iu":
            raise InputError(
                f"actions of shape {rows.shape} and type {rows.dtype}", remedy=f"see action_space: {self.action_space}"
            )
        for n, action in enumerate(rows.tolist()):
            if self._is_over[n]:
                self._all[n].close()
                self._all[n] = _Episode(self._of, self._drawn())
                continue
            rewards[n], over[n] = self._all[n].step(action)
            if over[n]:
                infos = self._add_info(infos, self._all[n].info(), n)
        self._is_over = over
        return self._observations(), rewards, over, np.zeros(self.num_envs, np.bool_), infos

    def close_extras(self, **_: Any) -> None:
        """End all missions."""
        for episode in self._all:
            episode.close()
        self._all = []

    def _drawn(self) -> int:
        return int(self.np_random.integers(SEED_LIMIT))

    def _observations(self) -> Observation:
        return np.stack([episode.observation() for episode in self._all])
