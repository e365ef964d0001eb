"""Missions of several sources are put together, and what readers should know of them is noted."""

import json
from contextlib import closing
from pathlib import Path

import pandas
import pytest

from suave_des.records.missions import SHARING, missions_in, missions_of
from suave_des.records.store import MANIFEST_FILE, RUNS_FILE, STORE_FILE, Store

HEAD = "scenario,manager,search_time_s,distance_inspected_m,run,seed"
WHOLE = {"planned": 1, "left_out": 0, "failed": 0}
"""Numbers of missions, as the manifest of a campaign that has all of them says."""
EXEMPLARS = 'mission_name,datetime,"initial pos (x,y)",time budget (s),time search (s),distance inspected (m)'


def campaign(folder: Path, *rows: str, header: str = HEAD, **manifest: object) -> Path:
    """Make the folder of a campaign, without its store."""
    folder.mkdir()
    (folder / RUNS_FILE).write_text("\n".join([header, *rows]) + "\n")
    if manifest:
        (folder / MANIFEST_FILE).write_text(json.dumps(manifest))
    return folder


def exemplars(folder: Path, **files: str) -> Path:
    """Make a folder of the exemplar's files, each with a mission of a manager."""
    folder.mkdir()
    for name, manager in files.items():
        row = f'time constrained {manager},Feb-04-2023-00-56-36,"(-17.0, 2.57)",300,100,20'
        (folder / f"{name}.csv").write_text(f"{EXEMPLARS}\n{row}\n")
    return folder


def test_missions_have_the_name_of_their_folder_as_source(tmp_path):
    one = campaign(tmp_path / "one", "sea,none,100,2,1,1")
    other = campaign(tmp_path / "other", "sea,none,90,2,1,2")
    assert missions_in([one, other]).frame["source"].to_list() == ["one", "other"]


def test_folders_of_the_same_name_are_told_apart_by_those_above(tmp_path):
    folders = []
    for place in ("one", "other"):
        (tmp_path / place).mkdir()
        folders.append(campaign(tmp_path / place / "out", "sea,none,100,2,1,1"))
    assert missions_in(folders).frame["source"].to_list() == ["one/out", "other/out"]


def test_a_mission_at_another_swept_value_is_another(tmp_path):
    rows = ("sea,none,100,2,1,1,40", "sea,none,90,2,1,1,80")
    folder = campaign(tmp_path / "one", *rows, header=f"{HEAD},period_s")
    assert missions_in(folder).swept == ("period_s",)


def test_the_manifest_says_what_is_swept_where_there_is_one(tmp_path):
    header = f"{HEAD},period_s,depth_m"
    manifest = {"missions": WHOLE, "sweep": {"grid": {"depth_m": [1, 2]}}}
    folder = campaign(tmp_path / "one", "sea,none,100,2,1,1,40,1", header=header, **manifest)
    assert missions_in(folder).swept == ("depth_m",)


@pytest.mark.parametrize(("perturbations", "sharing"), [({"start.x_m": {}}, 5), ({}, 1)])
def test_runs_share_draws_where_something_is_drawn(tmp_path, perturbations, sharing):
    manifest = {"runs_per_draw": 5, "perturbations": perturbations}
    folder = campaign(tmp_path / "one", "sea,none,100,2,1,1", **manifest)
    assert missions_in(folder).frame[SHARING].to_list() == [sharing]


def test_missions_that_a_campaign_lacks_are_noted(tmp_path):
    missions = {"planned": 5, "left_out": 3, "failed": 1}
    folder = campaign(tmp_path / "one", "sea,none,100,2,1,1", missions=missions)
    (note,) = missions_in(folder).notes
    assert "of 5 missions 3 are missing and 1 failed" in note


def test_nothing_is_noted_of_one_that_is_whole(tmp_path):
    folder = campaign(tmp_path / "one", "sea,none,100,2,1,1", missions=WHOLE)
    assert missions_in(folder).notes == ()


def test_a_campaign_with_its_store_can_be_run_again(tmp_path):
    folder = campaign(tmp_path / "one", "sea,none,100,2,1,1")
    assert missions_in(folder).folders == {}
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({"identity": "one"})
    assert missions_in(folder).folders == {"one": folder}


def test_the_exemplars_missions_are_in_the_papers_order(tmp_path):
    folder = exemplars(tmp_path / "real", a="metacontrol", b="bt", c="none")
    assert missions_in(folder).frame["manager"].to_list() == ["none", "metacontrol", "bt"]


def test_files_of_the_exemplar_that_are_no_results_are_left_out_with_a_note(tmp_path):
    folder = exemplars(tmp_path / "real", a="none")
    (folder / "statistics.csv").write_text("mean,std\n1,2\n")
    found = missions_in(folder)
    assert len(found.frame) == 1
    assert found.notes == (
        f"{folder / 'statistics.csv'} is left out: it has no columns of missions",
    )


def test_a_single_file_is_read_with_the_manifest_beside_it(tmp_path):
    header = f"{HEAD},period_s"
    manifest = {"missions": WHOLE, "sweep": {"grid": {"period_s": [40]}}}
    folder = campaign(tmp_path / "one", "sea,none,100,2,1,1,40", header=header, **manifest)
    assert missions_in(folder / RUNS_FILE).swept == ("period_s",)


# Data frames.

FRAME = pandas.DataFrame(
    {"manager": ["none"], "search_time_s": [100], "distance_inspected_m": [2.0]}
)


def test_a_frame_knows_how_many_runs_share_draws():
    frame = FRAME.copy()
    frame.attrs[SHARING] = 5
    assert missions_of(frame).frame[SHARING].to_list() == [5]


def test_a_frame_is_left_as_it_is():
    before = FRAME.copy()
    missions_of(FRAME)
    pandas.testing.assert_frame_equal(before, FRAME)
