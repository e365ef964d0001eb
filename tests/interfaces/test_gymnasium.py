"""The Gymnasium environment."""

import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from suave_des import InputError, PipelineInspection, load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers.command import python

NAME = "suave_des/PipelineInspection-v0"


def play(environment: gymnasium.Env, action: object, seed: int) -> tuple[list, float, dict]:
    observation, info = environment.reset(seed=seed)
    seen, total, is_over = [observation], 0.0, False
    while not is_over:
        observation, reward, is_over, _, info = environment.step(action)
        seen.append(observation)
        total += reward
    return seen, total, info


@pytest.mark.parametrize("scenario", ["seams2023", "release15"])
def test_it_passes_gymnasiums_own_checker_without_a_warning(scenario):
    environment = gymnasium.make(NAME, scenario=scenario).unwrapped
    assert isinstance(environment, PipelineInspection)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment)


def test_the_snippet_of_the_guide_works_when_it_is_copied_alone():
    page = Path(__file__).parents[2] / "docs" / "guides" / "other-programs.md"
    snippet = (
        page.read_text()
        .partition("## Gymnasium")[2]
        .partition("```python\n")[2]
        .partition("```")[0]
    )
    done = python("-c", snippet)
    assert done.returncode == 0 and done.stdout.splitlines()[-1] == "47.4 87.0", done.stderr


def test_an_episode_is_the_mission_of_its_seed(simulator):
    environment = gymnasium.make(NAME, scenario=simulator)
    _, _, info = play(environment, [0, 0], seed=7)
    expected = simulator.run("none", 1, 7).metrics
    found = info["metrics"]
    assert (found.search_time_s, found.distance_inspected_m) == (
        expected.search_time_s,
        expected.distance_inspected_m,
    )


def test_an_observation_has_what_monitors_measured(simulator):
    environment = gymnasium.make(NAME, scenario=simulator)
    names = environment.unwrapped.observation_names
    seen, _, info = play(environment, [2, 0], seed=3)
    last = dict(zip(names, seen[-1].tolist(), strict=True))
    assert last["distance_inspected_m"] == pytest.approx(info["metrics"].distance_inspected_m)
    assert last["c_thruster_1"] == 0.0 and last["c_thruster_2"] == 1.0
    first = dict(zip(names, seen[0].tolist(), strict=True))
    assert first["water_visibility"] == -1.0 and first["time_share"] == 0.0
    high = [
        dict(zip(names, each.tolist(), strict=True))["f_generate_search_path"]
        for each in seen[1:20]
    ]
    assert set(high) == {2.0}


def test_an_action_that_stays_the_same_is_requested_again_for_the_next_task(simulator):
    # there maintain_motion ends and begins with each task
    made = Simulator(load_scenario("release15"))
    environment = gymnasium.make(NAME, scenario=made)
    names = environment.unwrapped.observation_names
    seen, _, info = play(environment, [2, 1], seed=1)
    inspecting = [
        named
        for each in seen
        if (named := dict(zip(names, each.tolist(), strict=True)))["inspects"]
    ]
    assert info["metrics"].pipeline_found
    assert {named["f_maintain_motion"] for named in inspecting[1:]} == {1.0}


def test_the_reward_adds_up_to_what_it_weighs(simulator):
    weights = {"inspected_per_m": 2.0, "searched_per_s": -0.5, "found": 10.0, "adaptation": -3.0}
    environment = gymnasium.make(NAME, scenario=simulator, reward=weights)
    actions = np.random.default_rng(1).integers(0, [3, 2], (200, 2))
    environment.reset(seed=5)
    total = 0.0
    for action in actions:
        _, reward, is_over, _, info = environment.step(action)
        total += reward
        if is_over:
            break
    metrics = info["metrics"]
    expected = (
        2.0 * metrics.distance_inspected_m
        - 0.5 * metrics.search_time_s
        + 10.0 * metrics.pipeline_found
    )
    assert metrics.pipeline_found and metrics.adaptations > 5
    assert total == pytest.approx(expected - 3.0 * metrics.adaptations)


@pytest.mark.parametrize(
    "action", [[3, 0], [0, 2], [-1, 0], [0], [0, 0, 0], 1, [0.5, 0], "no", None]
)
def test_actions_out_of_range_are_refused(simulator, action):
    environment = gymnasium.make(NAME, scenario=simulator).unwrapped
    environment.reset(seed=1)
    with pytest.raises(InputError, match="action"):
        environment.step(action)


def test_observations_are_within_the_bounds_of_the_scenario(simulator):
    environment = gymnasium.make(NAME, scenario=simulator)
    names = environment.unwrapped.observation_names
    space = environment.observation_space
    bounds = dict(zip(names, zip(space.low, space.high, strict=True), strict=True))
    assert bounds["c_thruster_1"] == (0.0, 1.0)
    assert bounds["distance_inspected_m"][1] < 250.0 and bounds["time_share"][1] < 1.01
    seen, _, _ = play(environment, [1, 0], seed=2)
    assert all(environment.observation_space.contains(each) for each in seen)


@pytest.mark.parametrize(
    ("signal", "low", "high"),
    [
        ({"kind": "step", "time_s": 5.0, "before": -4.0, "after": 2.0}, -4.0, 2.0),
        (
            {
                "kind": "constant",
                "value": 2.0,
                "noise": {"distribution": "normal", "mean": 0.0, "std": 0.5},
            },
            -1.0,
            5.0,
        ),
        (
            {
                "kind": "constant",
                "value": {"distribution": "uniform", "minimum": 1.0, "maximum": 6.0},
            },
            -1.0,
            6.0,
        ),
        (
            {
                "kind": "constant",
                "value": 0.0,
                "noise": {"distribution": "exponential", "mean": 0.1},
            },
            -1.0,
            3.6,
        ),
    ],
)
def test_bounds_follow_from_what_the_scenario_says_of_a_signal(signal, low, high):
    made = Simulator(with_values(load_scenario("seams2023"), {"signals.water_visibility": signal}))
    space = gymnasium.make(NAME, scenario=made).observation_space
    assert (space.low[0], space.high[0]) == pytest.approx((low, high))


def test_it_draws_the_way_so_far(simulator):
    environment = gymnasium.make(NAME, scenario=simulator, render_mode="rgb_array").unwrapped
    environment.reset(seed=1)
    before = environment.render()
    for _ in range(20):
        environment.step([1, 0])
    after = environment.render()
    assert before.shape == after.shape == (400, 600, 3) and before.dtype == np.uint8
    assert (before != after).any()


def test_gymnasium_makes_it_by_its_module_without_an_import_before():
    name = f"suave_des.interfaces.gym:{NAME}"
    program = f"import gymnasium\nprint(type(gymnasium.make({name!r}).unwrapped).__name__)"
    done = python("-W", "error", "-c", program)
    assert (done.stdout, done.stderr) == ("PipelineInspection\n", "")
