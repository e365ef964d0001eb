"""Clusters: missions are counted in regions that a file of shares names; a wrong file is named with its line."""

import math

import pytest

from suave_des.errors import InputError
from suave_des.records.runs import read_runs
from suave_des.resources import shipped_folder
from suave_des.results.real import Share, count, read_targets, targets_beside
from suave_des.results.validation import compare_shares

UNKNOWN = math.nan


@pytest.fixture
def frame(missions):
    return missions(
        {
            "metacontrol": [(120, 50, -19.0), (125, 50, -18.5), (130, 50, -17.0), (75, 60, -16.0), (126, 50, UNKNOWN)],
            "none": [(125, 50, -19.0)],
        }
    )


LATE, THERE = {"search_time_s": [(120, 130)]}, {"detection_x_m": [(-19.5, -18.5)]}


@pytest.mark.parametrize(
    ("share", "counted"),
    [
        ({"where": LATE}, (4, 5)),  # both ends count
        ({"where": LATE | THERE}, (2, 5)),  # an unknown place is in no region, but a run
        ({"of": "detections", "among": LATE, "where": THERE}, (2, 3)),
        ({"where": {"detection_x_m": [(-19.5, -18.9), (-16.1, -15.9)]}}, (2, 5)),  # one of several intervals
    ],
)
def test_missions_are_counted_in_regions(share, counted, frame):
    assert count(Share(manager="metacontrol", name="some", **share), frame) == counted


def test_places_that_come_from_sums_of_steps_are_at_the_interval_end(missions):
    share = Share(manager="none", name="edge", where={"detection_x_m": [(-17.5, -16.0)]})
    assert count(share, missions({"none": [(1, 1, -17.5 - 1e-9), (1, 1, -17.51)]})) == (1, 2)


def test_no_mission_has_no_share(missions):
    share = Share(manager="none", name="any", among={"search_time_s": [(0, 1)]}, where={"search_time_s": [(0, 1)]})
    frame = missions({"none": [(5, 1, 1)]})
    assert count(share, frame) == (0, 0)
    (row,) = compare_shares([share], frame.assign(pipeline_found=math.nan), frame, ["none"]).to_dict("records")
    assert row["published_share"] is None


def test_the_shipped_shares_cover_each_manager_and_the_published_runs_meet_their_targets():
    data = shipped_folder("scenarios/published") / "seams2023_runs.csv"
    published = read_runs(data).frame
    shares = read_targets(targets_beside(data)).shares
    assert {share.manager for share in shares} == {"none", "random", "metacontrol"}
    with_target = [share for share in shares if share.target is not None]
    assert len(with_target) == 4
    for share in with_target:
        low, high = share.target
        counted, n = count(share, published)
        assert low <= counted / n <= high


ENTRY = "shares:\n  - manager: none\n    name: early\n    where: {where}\n"


@pytest.mark.parametrize(
    ("content", "place", "problem"),
    [
        ("share: []\n", "line 1", "unknown key 'share'"),
        ("shares:\n  - manager: none\n    name: early\n", "line 2, shares[0].where", "is missing"),
        (ENTRY.format(where="{}"), "line 4, shares[0].where", ""),
        (ENTRY.format(where="{search_time_s: []}"), "line 4, shares[0].where.search_time_s", ""),
        (ENTRY.format(where="{search_time_s: [[9, 3]]}"), "line 2, shares[0]", ""),
        (ENTRY.format(where="{search_time_s: [[3]]}"), "line 4, shares[0].where.search_time_s[0]", ""),
        (ENTRY.format(where="{search_time_s: [[3, soon]]}"), "line 4, shares[0].where.search_time_s[0]", ""),
        (ENTRY.format(where="{speed: [[3, 4]]}"), "line 4, shares[0].where", ""),
        (ENTRY.format(where="{search_time_s: [[3, 4]]}") + "    target: [0.2, 1.2]\n", "line 5", "between 0 and 1"),
        (ENTRY.format(where="{search_time_s: [[3, 4]]}") + "    of: missions\n", "line 5", "not allowed"),
    ],
)
def test_a_wrong_file_of_shares_is_named_with_its_line(write, content, place, problem):
    path = write("runs.targets.yaml", content)
    with pytest.raises(InputError) as caught:
        read_targets(path)
    assert caught.value.file == str(path)
    assert caught.value.place.startswith(place)
    assert problem in caught.value.problem
