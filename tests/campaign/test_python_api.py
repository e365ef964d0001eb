"""What `suave_des` offers to scripts and notebooks."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import suave_des
from suave_des import load_scenario, run_campaign, run_mission, with_values
from suave_des.campaign.campaign import CampaignInterrupted
from suave_des.campaign.variation import plain
from suave_des.managing.metacontrol import Metacontrol
from suave_des.managing.simple import NoManager
from suave_des.records.store import Store
from suave_des.registry import name_of
from suave_des.scenario.loader import LoadedScenario
from tests.helpers import AWKWARD


@pytest.fixture
def interrupted_after(monkeypatch: pytest.MonkeyPatch):
    """Makes Ctrl-C come when so many missions are kept."""

    def after(missions: int) -> None:
        real = Store.append

        def append(store: Store, finished: object) -> None:
            real(store, finished)  # type: ignore[arg-type]
            if store.count() == missions:
                raise KeyboardInterrupt

        monkeypatch.setattr(Store, "append", append)

    return after


def test_names_are_there():
    assert set(suave_des.__all__) <= set(dir(suave_des))


@pytest.fixture(scope="module")
def frame() -> suave_des.CampaignFrame:
    return suave_des.run_campaign("seams2023", ["random", "none"], runs=3, seed=1)


class TestRunCampaign:
    def test_a_row_is_a_mission(self, frame):
        assert list(frame["manager"]) == ["random"] * 3 + ["none"] * 3

    def test_managers_are_categories_in_the_order_given(self, frame):
        assert list(frame["manager"].cat.categories) == ["random", "none"]

    def test_times_are_floats_as_lengths_are(self, frame):
        kinds = {str(kind) for name, kind in frame.dtypes.items() if name.endswith(("_s", "_m"))}
        assert kinds == {"float64"}

    @pytest.mark.parametrize(
        ("name", "kind"),
        [
            ("scenario", "category"),
            ("run", "int64"),
            ("seed", "int64"),
            ("pipeline_found", "bool"),
            ("adaptations", "int64"),
        ],
    )
    def test_every_column_has_a_type(self, frame, name, kind):
        assert str(frame[name].dtype) == kind

    def test_a_reaction_that_did_not_come_is_missing(self, frame):
        assert frame["mean_reaction_time_s"].isna().any()

    def test_it_is_what_runs_csv_says(self, scenario, tmp_path):
        frame = suave_des.run_campaign(scenario, ["none"], 4, 1, out=tmp_path / "out")
        read = pandas.read_csv(tmp_path / "out" / "runs.csv")
        pandas.testing.assert_frame_equal(frame, read, check_dtype=False, check_categorical=False)

    def test_attrs_tell_the_rest_as_plain_values(self, tmp_path):
        with pytest.warns(
            UserWarning,
            match=rf"\d of 6 missions failed, see attrs\['failures'\]: manager {AWKWARD}:",
        ) as told:
            frame = suave_des.run_campaign(
                "seams2023",
                [f"{AWKWARD}:RaisesInHalf"],
                runs=3,
                out=tmp_path / "out",
                sweep={"visibility.period_s": [40, 80]},
            )
        assert Path(told[0].filename).name == Path(__file__).name
        manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
        for name in ("missions", "failures"):
            assert frame.attrs[name] == manifest[name]
        assert frame.attrs["missions"]["done"] == len(frame)
        with (tmp_path / "out" / "summary.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert [list(row) for row in rows] == [list(told) for told in frame.attrs["summary"]]
        assert [row["n"] for row in rows] == [str(told["n"]) for told in frame.attrs["summary"]]
        assert (frame.attrs["folder"], frame.attrs["interrupted"]) == (str(tmp_path / "out"), False)
        json.dumps(frame.attrs)  # or pandas could not keep them in a Parquet file
        pandas.concat([frame, frame])

    def test_without_any_row_the_types_are_the_same(self, scenario):
        with pytest.warns(UserWarning, match="1 of 1 missions failed"):
            nothing = suave_des.run_campaign(scenario, [f"{AWKWARD}:RaisesAlways"], 1)
        some = suave_des.run_campaign(scenario, ["none"], 1)
        assert len(nothing) == 0
        assert [str(kind) for kind in nothing.dtypes] == [str(kind) for kind in some.dtypes]

    def test_ctrl_c_at_a_prompt_gives_what_is_there(
        self, scenario, tmp_path, interrupted_after, monkeypatch
    ):
        monkeypatch.setattr(sys, "ps1", ">>> ", raising=False)
        for out in (None, tmp_path / "out"):
            interrupted_after(7)
            with pytest.warns(UserWarning, match="interrupted; 7 of 20 missions are done"):
                frame = suave_des.run_campaign(scenario, ["none"], 20, 1, out=out)
            assert (len(frame), frame.attrs["interrupted"]) == (7, True)
            monkeypatch.undo()
            monkeypatch.setattr(sys, "ps1", ">>> ", raising=False)
        assert len(suave_des.resume_campaign(tmp_path / "out")) == 20

    def test_ctrl_c_in_a_script_stops_the_script(self, scenario, interrupted_after):
        interrupted_after(7)
        with pytest.raises(CampaignInterrupted) as stopped:
            suave_des.run_campaign(scenario, ["none"], 20, 1)
        assert len(stopped.value.result.frame()) == 7


def test_numbers_may_be_of_numpy(scenario):
    found = suave_des.run_campaign(scenario, "none", runs=np.int64(2), seed=np.uint8(3))
    assert len(found) == 2


def test_a_mission_draws_itself():
    mission = suave_des.run_mission("seams2023", "none", run=1, seed=8)
    assert [len(mission.figure(kind).axes) for kind in ("map", "timeline")] == [3, 3]


FAILURE_S = "thruster_events.0.time_s"


class Mine(NoManager):
    """Does nothing of its own."""


def test_a_class_is_known_by_its_registered_name_or_by_its_place():
    assert [name_of(each) for each in (Metacontrol, "bt", Mine)] == [
        "metacontrol",
        "bt",
        f"{__name__}:Mine",
    ]


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


def test_a_loaded_scenario_runs_as_its_file_does():
    asked = {"runs": 2, "progress": False}
    of_file = run_campaign("seams2023", ["none"], **asked)
    pandas.testing.assert_frame_equal(
        run_campaign(load_scenario("seams2023"), "none", **asked), of_file
    )


@pytest.fixture
def short() -> LoadedScenario:
    return with_values(load_scenario("seams2023"), {"mission.time_limit_s": 50})


def test_a_campaign_has_the_values_of_a_loaded_scenario(short):
    found = run_campaign(short, NoManager, runs=1, progress=False)
    assert found["search_time_s"].tolist() == [50.0]


def test_a_mission_has_the_values_of_a_loaded_scenario(short):
    assert run_mission(short, NoManager).metrics.search_time_s == 50.0


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
        [sys.executable, "-"],
        input=IN_NOTEBOOK,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout == "True 3 __main__:Mine\n", done.stderr
