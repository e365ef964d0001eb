"""suave-des validate: what it prints, writes and refuses."""

import json
import shutil
import subprocess
from functools import partial
from pathlib import Path

import pytest

from suave_des.resources import shipped_folder
from tests.helpers import rows_of
from tests.helpers.command import command_here

pytestmark = pytest.mark.usefixtures("few_resamples")
DATA = shipped_folder("scenarios/published") / "seams2023_runs.csv"
HEADER = "manager,search_time_s,distance_inspected_m"


@pytest.fixture
def validate(tmp_path: Path):
    """Runs `suave-des validate ARGUMENTS` in a folder of its own."""
    return partial(command_here, "validate", cwd=tmp_path)


class TestOfThreeMissions:
    @pytest.fixture(scope="class")
    @staticmethod
    def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
        return tmp_path_factory.mktemp("three")

    @pytest.fixture(scope="class")
    @staticmethod
    def ended(folder: Path, few_resamples: None) -> subprocess.CompletedProcess[str]:
        """A validation of three missions of each manager, with its results in `out`."""
        options = ("--runs", "3", "--workers", "1", "--out", "out", "--quiet")
        return command_here("validate", "seams2023", *options, cwd=folder)

    def test_it_succeeds(self, ended):
        assert (ended.returncode, ended.stderr) == (0, "")

    @pytest.mark.parametrize("text", ["targets are met", "cannot be judged: too few missions"])
    def test_it_says_which_targets_are_met(self, ended, text):
        assert text in ended.stdout

    @pytest.mark.usefixtures("ended")
    def test_it_writes_the_files_of_a_campaign_beside_its_own(self, folder):
        assert {path.name for path in (folder / "out").iterdir()} == {
            "campaign.sqlite",
            "runs.csv",
            "summary.csv",
            "manifest.json",
            "validation.csv",
            "validation_pairs.csv",
            "validation_shares.csv",
            "validation_targets.csv",
            "validation.json",
        }

    @pytest.mark.usefixtures("ended")
    def test_it_counts_missions_of_each_manager(self, folder):
        cells = rows_of(folder / "out" / "validation.csv")
        assert [
            (cell["manager"], cell["published_n"], cell["simulated_n"]) for cell in cells[:3]
        ] == [("none", "20", "3"), ("metacontrol", "20", "3"), ("random", "20", "3")]

    @pytest.mark.usefixtures("ended")
    def test_it_notes_where_its_missions_come_from(self, folder):
        sources = json.loads((folder / "out" / "validation.json").read_text())["provenance"]
        assert (sources["scenario"], sources["runs"], sources["data"][0]["file"]) == (
            "seams2023",
            3,
            "shipped/seams2023_runs.csv",
        )

    @pytest.mark.usefixtures("ended")
    def test_the_campaigns_own_file_gives_the_same_tables_without_simulating(self, folder):
        asked = ("validate", "--runs-file", "out/runs.csv", "--out", "recorded")
        assert command_here(*asked, cwd=folder).returncode == 0
        assert not (folder / "recorded" / "runs.csv").exists()
        for name in ("validation.csv", "validation_pairs.csv", "validation_shares.csv"):
            recorded, simulated = (folder / each / name for each in ("recorded", "out"))
            assert recorded.read_bytes() == simulated.read_bytes()


def test_the_published_runs_against_themselves_meet_every_target(validate):
    ended = validate("--runs-file", str(DATA), "--strict")
    assert ended.returncode == 0
    assert "28 of 28 targets are met, 0 are not met." in ended.stdout
    assert "NOT MET" not in ended.stdout


@pytest.mark.parametrize(("options", "status"), [((), 0), (("--strict",), 1)])
def test_a_target_that_is_not_met_is_an_error_only_when_strict(validate, tmp_path, options, status):
    text = (
        DATA.read_text(encoding="utf-8")
        .replace("none,", "x,")
        .replace("random,", "none,")
        .replace("x,", "random,")
    )
    (tmp_path / "swapped.csv").write_text(text, encoding="utf-8")
    ended = validate("--runs-file", "swapped.csv", "--managers", "none,random", *options)
    assert "NOT MET" in ended.stdout
    assert ended.returncode == status


def test_other_data_without_a_file_of_shares_has_no_cluster_targets(validate, tmp_path):
    shutil.copy(DATA, tmp_path / "real.csv")
    ended = validate("--data", "real.csv", "--runs-file", "real.csv", "--managers", "none")
    assert "6 of 6 targets are met" in ended.stdout
    assert "found at" not in ended.stdout


def test_other_data_takes_cluster_targets_from_a_file_of_shares(validate, tmp_path):
    shutil.copy(DATA, tmp_path / "real.csv")
    asked = ("--data", "real.csv", "--runs-file", "real.csv", "--managers", "none")
    ended = validate(*asked, "--targets", str(DATA.with_suffix(".targets.yaml")))
    assert "7 of 7 targets are met" in ended.stdout
    assert "found at" in ended.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ["--data", "missing.csv"],
            "missing.csv: no such file (give a path, or one of the shipped files: planta",
        ),
        (["--data", "unknown.csv"], "there is no manager 'magic'"),
        (
            ["--data", "words.csv"],
            "words.csv: line 2: search_time_s: expected a finite number, at most 1e+12",
        ),
        (["--managers", "nobody"], "has no mission of manager 'nobody'"),
        (["--runs", "0"], "runs: 0 "),
        (["--targets", "missing.yaml"], "missing.yaml: no such file"),
        (["--runs-file", "other.csv"], "other.csv: has no mission of manager 'none'"),
        (
            ["--runs-file", "scenario.csv"],
            "scenario.csv: line 3: has missions of several scenarios",
        ),
        (
            ["--runs-file", "scenario.csv", "--reasoner", "pellet"],
            "--reasoner cannot be used with --runs-file",
        ),
        (["--runs-file", str(DATA), "--out", "full"], "full: the output folder is not empty"),
        (["--runs", "1", "--out", "full"], "full: the output folder is not empty"),
    ],
)
def test_bad_input_is_refused_in_one_line(validate, tmp_path, arguments, told):
    files = {
        "unknown.csv": f"{HEADER}\nmagic,1,2\n",
        "words.csv": f"{HEADER}\nnone,soon,2\n",
        "other.csv": f"{HEADER}\nbt,1,2\n",
        "scenario.csv": f"scenario,{HEADER}\nseams2023,none,1,2\nrelease15,none,1,2\n",
        "full/results.txt": "mine",
    }
    (tmp_path / "full").mkdir()
    for name, content in files.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    ended = validate(*arguments)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("suave-des: ")
    assert told in ended.stderr
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["results.txt"]


CAMPAIGN = """campaign: 1
scenario: seams2023
sweep: {zip: {start.y_m: [2.5, 2.9], thruster_events.0.time_s: [35, 90]}}
"""


def test_a_campaign_file_compares_each_real_run_with_those_of_its_condition(validate, tmp_path):
    (tmp_path / "two.yaml").write_text(CAMPAIGN, encoding="utf-8")
    (tmp_path / "real.csv").write_text(
        f"{HEADER},pipeline_found,block\nnone,180,30,True,1\nnone,190,31,True,1\nnone,301,0,False,2\n",
        encoding="utf-8",
    )
    ended = validate(
        "two.yaml", "--data", "real.csv", "--runs", "2", "--workers", "1", "--out", "out", "--quiet"
    )
    assert ended.returncode == 0
    assert "Condition 2: start.y_m=2.9, thruster_events.0.time_s=90" in ended.stdout
    conditions = rows_of(tmp_path / "out" / "validation_conditions.csv")
    assert [
        (row["metric"], row["condition"], row["real_n"], row["simulated_n"]) for row in conditions
    ] == [
        ("search_time_s", "1", "2", "2"),
        ("search_time_s", "2", "1", "1"),
        ("distance_inspected_m", "1", "2", "2"),
        ("distance_inspected_m", "2", "1", "1"),
    ]
    again = validate(
        "two.yaml", "--data", "real.csv", "--runs-file", "out/runs.csv", "--out", "again"
    )
    assert again.returncode == 0
    same = "validation_conditions.csv"
    assert (tmp_path / "again" / same).read_bytes() == (tmp_path / "out" / same).read_bytes()


def test_a_short_last_block_follows_from_the_runs_of_the_campaign_file(validate, tmp_path):
    campaign = CAMPAIGN.replace("sweep:", "runs: 3\nsweep:")
    (tmp_path / "two.yaml").write_text(campaign, encoding="utf-8")
    (tmp_path / "real.csv").write_text(f"{HEADER}\n" + "none,180,30\n" * 4, encoding="utf-8")
    ended = validate("two.yaml", "--data", "real.csv", "--runs", "1", "--workers", "1", "--quiet")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "they are taken in order, 3, 1 of each manager." in " ".join(ended.stdout.split())


def test_real_missions_of_another_time_limit_are_refused(validate, tmp_path):
    text = f"{HEADER},pipeline_found\nnone,100,30,True\nnone,151,0,False\n"
    (tmp_path / "real.csv").write_text(text, encoding="utf-8")
    ended = validate("--data", "real.csv", "--runs", "1", "--workers", "1", "--quiet")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "missions of none end after 300 s, real missions after 151 s" in ended.stderr


def test_several_files_are_compared_as_one_data_set(validate, tmp_path):
    header, *lines = DATA.read_text(encoding="utf-8").splitlines()
    names = []
    for manager in ("none", "random", "metacontrol"):
        own = [line for line in lines if line.startswith(f"{manager},")]
        (tmp_path / f"{manager}.csv").write_text("\n".join([header, *own]), encoding="utf-8")
        names += ["--data", f"{manager}.csv"]
    assert (
        "24 of 24 targets are met"
        in validate(*names, "--runs-file", str(DATA), "--out", "out").stdout
    )
    data = json.loads((tmp_path / "out" / "validation.json").read_text())["provenance"]["data"]
    assert [each["file"] for each in data] == ["none.csv", "random.csv", "metacontrol.csv"]
