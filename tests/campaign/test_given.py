"""Callers give managers, scenarios and sweeps in the forms that they have at hand."""

import subprocess
import sys

import numpy as np
import pandas
import pytest

from suave_des import load_scenario, run_campaign, run_mission, with_values
from suave_des.campaign.variation import plain
from suave_des.errors import InputError
from suave_des.managing.metacontrol import Metacontrol
from suave_des.managing.simple import NoManager
from suave_des.registry import name_of

FAILURE_S = "thruster_events.0.time_s"


class Mine(NoManager):
    """Does nothing of its own."""


def test_a_class_is_known_by_its_registered_name_or_by_its_place():
    assert [name_of(each) for each in (Metacontrol, "bt", Mine)] == ["metacontrol", "bt", f"{__name__}:Mine"]


@pytest.mark.parametrize("wrong", [int, 3, None], ids=str)
def test_what_is_no_manager_is_refused(wrong):
    with pytest.raises(InputError, match="expected a manager"):
        name_of(wrong)


def test_a_class_inside_a_function_cannot_be_found_by_workers():
    class Inner(NoManager):
        """Cannot be imported."""

    with pytest.raises(InputError, match="top level of a module, script or notebook cell"):
        name_of(Inner)


@pytest.mark.parametrize(
    "values",
    [
        [20.0, 40.0],
        (20.0, 40.0),
        np.array([20.0, 40.0]),
        pandas.Series([20.0, 40.0]),
        range(20, 60, 20),
        np.arange(20, 60, 20),
        (value for value in (20, 40)),
    ],
    ids=lambda values: type(values).__name__,
)
def test_a_sweep_takes_what_has_values(values):
    (given,) = plain({FAILURE_S: values}).values()
    assert given == [20, 40]
    assert {type(value) for value in given} <= {int, float}


def test_arrays_in_the_forms_of_a_sweep_become_lists():
    design = np.array([[1.0, 2.0], [3.0, 4.0]])
    zipped = plain({"zip": {"start.x_m": design[:, 0], "start.y_m": design[:, 1]}})
    assert zipped == {"zip": {"start.x_m": [1.0, 3.0], "start.y_m": [2.0, 4.0]}}
    sample = {"method": "sobol", "points": np.int64(4), "ranges": {"start.x_m": np.array([1.0, 2.0])}}
    assert plain({"sample": sample})["sample"] == {**sample, "points": 4, "ranges": {"start.x_m": [1.0, 2.0]}}


def test_a_loaded_scenario_runs_as_its_file_does():
    loaded = load_scenario("seams2023")
    pandas.testing.assert_frame_equal(
        run_campaign(loaded, "none", runs=2, progress=False),
        run_campaign("seams2023", ["none"], runs=2, progress=False),
    )


def test_the_values_of_a_loaded_scenario_count():
    short = with_values(load_scenario("seams2023"), {"mission.time_limit_s": 50})
    assert run_campaign(short, NoManager, runs=1, progress=False)["search_time_s"].tolist() == [50.0]
    assert run_mission(short, NoManager).metrics.search_time_s == 50.0


def test_files_of_a_loaded_scenario_are_not_replaced_later():
    with pytest.raises(InputError, match="give rules to load_scenario"):
        run_mission(load_scenario("seams2023"), "none", rules=["mine.swrl"])


IN_NOTEBOOK = """
from suave_des import run_campaign
from suave_des.managing.simple import NoManager
SEARCH = "f_generate_search_path"
class Mine(NoManager):
    def task_requested(self, task):
        for function in task.functions:
            self.system.change_mode(function, "fd_spiral_high" if function == SEARCH else "fd_follow_pipeline")

one, two = (run_campaign("seams2023", Mine, runs=3, workers=n, progress=False) for n in (1, 2))
print(one.equals(two), len(two), two["manager"].iloc[0])
"""


def test_a_manager_of_a_notebook_runs_on_several_workers():
    done = subprocess.run(
        [sys.executable, "-"], input=IN_NOTEBOOK, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.stdout == "True 3 __main__:Mine\n", done.stderr


def test_results_print_as_tables():
    mission = run_mission("seams2023", "none")
    assert repr(mission).startswith("seams2023, none, run 1, seed 1\n")
    assert f"search_time_s          {mission.metrics.search_time_s:g}" in repr(mission)
    assert len(mission.events_frame()) == len(mission.events)
    assert mission.trajectory_frame()["z_m"].iloc[0] == mission.trajectory[0].z_m
