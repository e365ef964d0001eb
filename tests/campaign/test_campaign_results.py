"""What a campaign's files say, and that they say the same each time."""

import json
from pathlib import Path

import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.records.missions import read_missions
from suave_des.records.runs import exemplar_names
from tests.helpers import rows_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("campaign") / "out"
    run_campaign("seams2023", ["none", "random"], 6, 3, out=out)
    return out


MANAGERS = ["none", "random", "metacontrol"]


@pytest.fixture(scope="module")
def larger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The campaign with one manager more."""
    out = tmp_path_factory.mktemp("larger") / "out"
    run_campaign("seams2023", MANAGERS, 6, 3, 1, out)
    return out


@pytest.mark.usefixtures("quick_workers")
def test_equal_campaigns_give_equal_bytes_on_any_number_of_workers(larger, tmp_path):
    run_campaign("seams2023", MANAGERS, 6, 3, 2, tmp_path / "two")
    for file in ("runs.csv", "summary.csv"):
        assert (tmp_path / "two" / file).read_bytes() == (larger / file).read_bytes()


@pytest.mark.parametrize("file", ["runs.csv", "summary.csv"])
def test_a_manager_more_changes_no_other_row(folder, larger, file):
    assert (larger / file).read_bytes().startswith((folder / file).read_bytes())


def test_the_manifest_has_the_shipped_ontologies_that_were_reasoned_with(larger):
    inputs = json.loads((larger / "manifest.json").read_text())["inputs_sha256"]
    assert {"shipped/ontology/suave.owl", "shipped/ontology/tomasys.owl"} <= inputs.keys()


def test_summary_follows_from_runs(folder):
    rows = rows_of(folder / "runs.csv")
    summary = rows_of(folder / "summary.csv")
    assert [row["manager"] for row in summary] == ["none", "random"]
    for line in summary:
        for metric in ("search_time_s", "distance_inspected_m"):
            values = [float(row[metric]) for row in rows if row["manager"] == line["manager"]]
            mean = sum(values) / 6
            std = (sum((value - mean) ** 2 for value in values) / 5) ** 0.5
            # Student's t, 5 degrees of freedom, 97.5%: any statistics table
            half = 2.570582 * std / 6**0.5
            assert line["n"] == "6"
            assert float(line[f"{metric}_mean"]) == pytest.approx(mean, abs=1e-5)
            assert float(line[f"{metric}_std"]) == pytest.approx(std, abs=1e-5)
            assert float(line[f"{metric}_median"]) == pytest.approx(
                sum(sorted(values)[2:4]) / 2, abs=1e-5
            )
            assert float(line[f"{metric}_ci95_low"]) == pytest.approx(mean - half, abs=1e-3)
            assert float(line[f"{metric}_ci95_high"]) == pytest.approx(mean + half, abs=1e-3)


def test_intervals_are_over_draws_of_consecutive_runs(tmp_path):
    drawn = {"start.y_m": {"distribution": "uniform", "minimum": 0.5, "maximum": 4.5}}
    out = tmp_path / "out"
    run_campaign("seams2023", ["none"], 10, 1, out=out, runs_per_draw=5, perturbations=drawn)
    values = [float(row["search_time_s"]) for row in rows_of(out / "runs.csv")]
    means = sum(values[:5]) / 5, sum(values[5:]) / 5
    (summary,) = rows_of(out / "summary.csv")
    # Two draws: Student's t with one degree of freedom, 97.5%: 12.7062; the standard error of two
    # means is half their distance.
    half = 12.7062 * abs(means[0] - means[1]) / 2
    assert float(summary["search_time_s_ci95_low"]) == pytest.approx(
        sum(means) / 2 - half, rel=1e-4
    )
    assert float(summary["search_time_s_ci95_high"]) == pytest.approx(
        sum(means) / 2 + half, rel=1e-4
    )


class TestSuaveFormat:
    def test_revision_2023(self, tmp_path):
        scenario = tmp_path / "short.yaml"
        scenario.write_text("base: seams2023.yaml\nmission: {time_limit_s: 150}\n")
        run_campaign(scenario, ["none", "random"], 4, 1, out=tmp_path / "out", suave_format=True)
        folder = tmp_path / "out" / "suave"
        names = ["none_time_constrained.csv", "random_time_constrained.csv"]
        assert sorted(path.name for path in folder.iterdir()) == names
        theirs = [row for name in names for row in rows_of(folder / name)]
        ours = rows_of(tmp_path / "out" / "runs.csv")
        assert list(theirs[0]) == [
            *(
                "mission_name",
                "datetime",
                "initial pos (x,y)",
                "time budget (s)",
                "time search (s)",
            ),
            "distance inspected (m)",
        ]
        assert theirs[0]["mission_name"] == "time constrained none"
        assert theirs[4]["mission_name"] == "time constrained random"
        # or the next lines show nothing
        assert {row["pipeline_found"] for row in ours} == {
            "True",
            "False",
        }
        for their, our in zip(theirs, ours, strict=True):
            found = our["pipeline_found"] == "True"
            assert their["time search (s)"] == (
                f"{float(our['search_time_s']):.0f}" if found else "-1"
            )
            assert their["distance inspected (m)"] == our["distance_inspected_m"]
            assert their["time budget (s)"] == "150"
        x_m, y_m = float(ours[0]["initial_x_m"]), float(ours[0]["initial_y_m"])
        assert theirs[0]["initial pos (x,y)"] == f"({x_m:.1f}, {round(y_m, 2)})"
        stamps = [row["datetime"] for row in theirs]
        assert stamps[0] == "Jan-01-2000-00-00-01"
        assert len(set(stamps)) == 8

    def test_a_later_campaign_without_it_leaves_none_of_an_earlier_one(self, tmp_path):
        run_campaign("release15", ["none"], 1, 1, out=tmp_path / "out", suave_format=True)
        run_campaign(
            "release15", ["bt"], 1, 1, out=tmp_path / "out", suave_format=True, overwrite=True
        )
        assert [path.name for path in (tmp_path / "out" / "suave").iterdir()] == ["bt_suave.csv"]
        run_campaign("release15", ["bt"], 1, 1, out=tmp_path / "out", overwrite=True)
        assert not (tmp_path / "out" / "suave").exists()

    def test_the_extended_mission_is_named_as_the_exemplars_runner_names_it(self, tmp_path):
        managers = ["none", "bt", "bt_extended"]
        run_campaign("extended", managers, 1, 1, out=tmp_path / "out", suave_format=True)
        folder = tmp_path / "out" / "suave"
        names = {path.name: rows_of(path)[0]["mission name"] for path in sorted(folder.iterdir())}
        assert names == {
            "bt_suave.csv": "suave bt",
            "bt_suave_extended.csv": "suave_extended bt",
            "none_suave_extended.csv": "suave_extended none",
        }
        assert sorted(read_missions([folder]).frame["manager"]) == sorted(managers)

    def test_managers_that_differ_in_signs_that_no_file_name_has_get_files_of_their_own(self):
        names = dict(exemplar_names(["a:B", "a/B", "a_B"], "1.5", has_battery=False))
        assert names == {
            "a_B_suave": "suave a:B",
            "a_B_suave_2": "suave a/B",
            "a_B_suave_3": "suave a_B",
        }

    def test_revision_1_5_writes_the_duration_where_runs_csv_has_the_limit(self, tmp_path):
        scenario = tmp_path / "short.yaml"
        scenario.write_text("base: release15.yaml\nmission: {time_limit_s: 20}\n")
        run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out", suave_format=True)
        theirs = rows_of(tmp_path / "out" / "suave" / "none_suave.csv")
        assert list(theirs[0]) == [
            *(
                "mission name",
                "datetime",
                "initial pos (x,y)",
                "mission duration (s)",
                "pipeline found",
            ),
            *("time searching pipeline (s)", "distance inspected (m)", "mean reaction time (s)"),
            "run_idx",
        ]
        assert [row["run_idx"] for row in theirs] == ["1", "2"]
        assert (theirs[0]["mission name"], theirs[1]["datetime"]) == (
            "suave none",
            "01-Jan-2000-00-00-02",
        )
        assert (theirs[0]["pipeline found"], theirs[0]["mean reaction time (s)"]) == (
            "False",
            "0.0",
        )
        ours = rows_of(tmp_path / "out" / "runs.csv")
        assert [(row["pipeline_found"], row["search_time_s"]) for row in ours] == [
            ("False", "20.0")
        ] * 2
        assert all(float(row["mission_duration_s"]) > 20 for row in ours)
        whole = [str(int(float(row["mission_duration_s"]))) for row in ours]
        for column in ("mission duration (s)", "time searching pipeline (s)"):
            assert [row[column] for row in theirs] == whole
