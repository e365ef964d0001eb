"""What interfaces refuse before a mission begins, or while its caller advances it: what is given, and
what is said.
"""

import math
import shlex
import sys
from collections.abc import Callable

import gymnasium
import pytest

from suave_des import InputError, Mission, PipelineInspection, run_campaign

SEARCH = "f_generate_search_path"
PROGRAM = f"exec:{shlex.quote(sys.executable)} -c pass"


def with_program(name: str, **settings: object) -> object:
    """Fly a mission under a program."""
    return run_campaign("seams2023", [name], runs=1, manager_options={name: settings})


def environment(**options: object) -> object:
    """Make the environment of Gymnasium."""
    return gymnasium.make("suave_des/PipelineInspection-v0", **options)


def on_a_cluster(**options: object) -> object:
    """Run a campaign of one mission with a scheduler."""
    return run_campaign("seams2023", ["none"], 1, 1, scheduler="tcp://127.0.0.1:8786", **options)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: with_program("exec:"), "write exec:COMMAND"),
        (lambda: with_program("exec:./no_such_program"), "cannot be run: No such file"),
        (lambda: with_program("exec:'unclosed"), "close the quotes"),
        (
            lambda: with_program(PROGRAM, real_thinking=-1),
            "real_thinking: -1 is out of range",
        ),
        (lambda: environment(period_s=0.0), "period_s"),
        (lambda: environment(period_s=float("nan")), "period_s"),
        (lambda: environment(reward={"speed": 1.0}), "reward"),
        (lambda: environment(scenario="no_such_scenario"), "no such file"),
        (lambda: PipelineInspection(render_mode="human"), "render_mode: there is no 'human'"),
        (lambda: PipelineInspection(reward={"found": math.inf}), r"reward: found is \.inf"),
        (lambda: PipelineInspection(reward={"found": "10"}), "reward: found is '10'"),
        (
            lambda: Mission("seams2023").change_mode("f_search", "fd_spiral_high"),
            "there is no function 'f_search'",
        ),
        (
            lambda: Mission("seams2023").change_mode(SEARCH, "fd_spiral_hihg"),
            "did you mean 'fd_spiral_high'",
        ),
        (
            lambda: Mission("seams2023").change_mode("generate_recharge_path", "normal"),
            "there is no function 'generate_recharge_path'",
        ),
        (
            lambda: Mission("seams2023", "none").change_mode(SEARCH, "fd_spiral_high"),
            "has a manager",
        ),
        (lambda: on_a_cluster(workers=2), r"workers: 2 cannot be used with a scheduler"),
    ],
)
def test_of_a_call(call: Callable[[], object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        call()
