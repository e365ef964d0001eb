"""Managers that learn: only in training; what a class keeps otherwise is found out."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from suave_des import InputError, NoManager, Simulator, load_scenario, run_campaign, run_mission
from suave_des.campaign.campaign import train
from suave_des.learned import Learned, read_file
from tests.helpers import AWKWARD, OUTSIDE
from tests.helpers.command import suave_des_command

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"


@pytest.fixture
def learner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.syspath_prepend(EXAMPLES)
    monkeypatch.chdir(tmp_path)
    return "learner:Learner"


def test_training_gives_the_same_file_each_time(learner, tmp_path):
    for name in ("one.json", "other.json"):
        train("seams2023", learner, 12, tmp_path / name)
    one = (tmp_path / "one.json").read_bytes()
    assert one == (tmp_path / "other.json").read_bytes()
    content = json.loads(one)
    assert sum(missions for missions, _ in content["learned"].values()) == content["missions"] == 12
    assert "learner.py" in content["inputs_sha256"]


@pytest.mark.usefixtures("quick_workers")
def test_a_frozen_policy_gives_the_same_rows_for_any_number_of_workers(learner):
    train("seams2023", learner, 9, "policy.json")
    options = {learner: {"learned": "policy.json"}}
    one, two = (
        run_campaign("seams2023", [learner], 12, workers=workers, manager_options=options)
        for workers in (1, 2)
    )
    assert one.equals(two) and "remarks" not in one.attrs


@pytest.mark.parametrize(("runs", "seen"), [(4, 4), (12, 9)])
@pytest.mark.parametrize("given", ["option", "sweep"])
def test_a_campaign_on_missions_of_the_training_says_so(learner, given, runs, seen):
    train("seams2023", learner, 9, "policy.json", seed=1)
    train("seams2023", learner, 2, "other.json", seed=8)
    files = {"option": {"manager_options": {learner: {"learned": "policy.json"}}}}
    files["sweep"] = {"sweep": {f"managers.{learner}.learned": ["other.json", "policy.json"]}}
    with pytest.warns(UserWarning, match=f"runs 1 to {seen} are missions that it was trained on"):
        run_campaign("seams2023", [learner], runs, **files[given])
    assert "remarks" not in run_campaign("seams2023", [learner], 1, seed=2, **files[given]).attrs


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"suave_des_learned": 2, "learned": {}}'])
def test_another_file_is_no_policy(learner, content):
    Path("policy.json").write_text(content)
    with pytest.raises(InputError) as refused:
        run_campaign(
            "seams2023", [learner], 1, manager_options={learner: {"learned": "policy.json"}}
        )
    assert refused.value.file == "policy.json"


@pytest.mark.parametrize("change", [{"missions": "x"}, {"missions": 0}, {"seed": 1.5}])
def test_a_training_result_with_a_value_of_another_type_is_no_policy(change, tmp_path):
    result = Learned("mine:M", "seams2023", 0, 3, {}, {"q": 1.0})
    path = tmp_path / "policy.json"
    path.write_text(json.dumps({**json.loads(result.text()), **change}))
    with pytest.raises(InputError) as refused:
        read_file(path)
    assert refused.value.file == str(path)


def test_a_manager_that_learns_nothing_leaves_no_policy(tmp_path):
    with pytest.raises(InputError):
        train("seams2023", "none", 1, tmp_path / "policy.json")
    assert not (tmp_path / "policy.json").exists()


@pytest.mark.parametrize("learned", [{1: 2.0}, {"arms": ({3: 1},)}, (deep := {})])
def test_what_json_would_change_is_no_training_result(learned):
    deep["deep"] = deep
    with pytest.raises(InputError):
        Learned("mine", "seams2023", 1, 1, {}, learned).text()


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.usefixtures("quick_workers")
def test_a_class_that_keeps_something_from_mission_to_mission_is_found_out(workers):
    with pytest.warns(UserWarning, match="gave another row"):
        frame = run_campaign("seams2023", [f"{AWKWARD}:Remembers"], 24, workers=workers)
    assert any("number of workers" in remark for remark in frame.attrs["remarks"])


@pytest.mark.parametrize(
    ("manager", "runs"),
    [(f"{AWKWARD}:RaisesInHalf", 1), (f"{AWKWARD}:SavesCharge", 2), (f"{OUTSIDE}:Deliberate", 20)],
)
def test_a_class_that_keeps_nothing_is_not_accused_of_it(manager, runs):
    """Nor of names that nothing measures, where it reads what there may be."""
    assert "remarks" not in run_campaign("seams2023", [manager], runs).attrs


class Swaps(NoManager):
    def task_requested(self, task):
        self.system.change_mode("fd_spiral_high", "f_generate_search_path")


def test_swapped_arguments_of_change_mode_are_told():
    (remark,) = Simulator(load_scenario("seams2023")).run(Swaps, 1, 1).remarks
    called = "change_mode('fd_spiral_high', 'f_generate_search_path')"
    assert remark == f"{called} has its arguments swapped (function, then mode)"


@pytest.mark.parametrize(
    ("manager", "workers", "words", "remedy"),
    [
        (
            "Misspells",
            1,
            "f_generate_search_path has no mode 'fd_spiral_hihg' .did you mean",
            "fd_spiral_high)",
        ),
        *(
            (
                "ReadsNothing",
                workers,
                r"measured\('visibility'\) is always None",
                "battery_level, water_visibility)",
            )
            for workers in (1, 2)
        ),
    ],
)
@pytest.mark.usefixtures("quick_workers")
def test_a_name_that_there_is_not_is_reported_once(manager, workers, words, remedy, tmp_path):
    with pytest.warns(UserWarning, match=words):
        run_campaign(
            "seams2023", [f"{AWKWARD}:{manager}"], 6, workers=workers, out=tmp_path / "out"
        )
    (remark,) = json.loads((tmp_path / "out" / "manifest.json").read_text())["remarks"]
    assert "did you mean" in remark and remark.endswith(remedy)


def test_a_name_that_nothing_measures_in_the_second_run_alone_is_reported_too():
    manager = f"{AWKWARD}:ReadsNothingAtTimes"
    has_remark = {
        seed: [bool(run_mission("seams2023", manager, run, seed).remarks) for run in (1, 2)]
        for seed in range(9)
    }
    seed = next(seed for seed, runs in has_remark.items() if runs == [False, True])
    with pytest.warns(UserWarning, match=r"measured\('visibility'\)"):
        run_campaign("seams2023", [manager], 2, seed)


def installed(package: Path, where: Path) -> Path:
    """Build a package's wheel and unpack it, which is what pip does; a virtual environment need not
    have pip.
    """
    build = "import sys; from hatchling.build import build_wheel; print(build_wheel(sys.argv[1]))"
    command = [sys.executable, "-c", build, str(where)]
    done = subprocess.run(command, cwd=package, check=True, capture_output=True, text=True)
    with zipfile.ZipFile(where / done.stdout.split()[-1]) as wheel:
        wheel.extractall(where)
    return where


def test_a_package_registers_its_manager_by_name(tmp_path):
    (tmp_path / "there").mkdir()
    there = {"PYTHONPATH": str(installed(EXAMPLES / "suave-cautious", tmp_path / "there"))}
    margin = ("--manager-option", "margin_m=0.25")
    asked = ("--managers", "cautious", "--runs", "2", "--workers", "1", "--out", "out", *margin)
    done = suave_des_command("campaign", "seams2023", *asked, cwd=tmp_path, **there)
    assert done.returncode == 0, done.stderr
    assert "cautious" in done.stdout
    inputs = json.loads((tmp_path / "out" / "manifest.json").read_text())["inputs_sha256"]
    assert "suave_cautious/__init__.py" in inputs
    done = suave_des_command(
        "campaign", "--resume", "out", "--runs", "3", "--workers", "1", cwd=tmp_path, **there
    )
    assert done.returncode == 0, done.stderr  # what a package registers is installed on purpose


def test_an_entry_point_that_does_not_import_is_bad_input(tmp_path):
    info = tmp_path / "broken-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1\n")
    (info / "entry_points.txt").write_text(
        "[suave_des.managers]\nbroken = no_such_module_at_all:Manager\n"
    )
    done = suave_des_command(
        "run", "seams2023", "--manager", "broken", cwd=tmp_path, PYTHONPATH=str(tmp_path)
    )
    assert (
        done.returncode == 2
        and "no_such_module_at_all" in done.stderr
        and "Traceback" not in done.stderr
    )


@pytest.mark.slow
def test_the_example_learns_a_policy_that_beats_bt_on_missions_that_it_has_not_seen(learner):
    from scipy import stats

    train("seams2023", learner, 300, "policy.json")
    options = {learner: {"learned": "policy.json"}}
    frame = run_campaign("seams2023", ["bt", learner], 200, seed=1, manager_options=options)
    wide = frame.pivot(index="run", columns="manager", values="search_time_s")
    gain_s = wide["bt"] - wide[learner]
    interval = stats.bootstrap(
        (gain_s,), lambda values, axis: values.mean(axis=axis), rng=1
    ).confidence_interval
    print(f"{gain_s.mean():.1f} s sooner, 95% interval {interval.low:.1f} to {interval.high:.1f}")
    assert interval.low > 10.0
