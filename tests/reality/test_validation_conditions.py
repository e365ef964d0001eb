"""Real missions of known conditions are compared with simulated ones of their own, and counted in
regions.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

import pandas
import pytest
from scipy import stats

from suave_des.campaign.variation import Sweep
from suave_des.errors import InputError
from suave_des.reality.missions import Share, Targets, conditions_of, numbered, read_real
from suave_des.reality.validation import (
    balanced,
    compare_conditions,
    compare_shares,
    over_conditions,
    validate,
)
from suave_des.records.runs import read_runs
from suave_des.resources import shipped_folder
from suave_des.scenario.yamlfile import read_yaml, validated

Write = Callable[[str, str], Path]
OWN = "manager,search_time_s,distance_inspected_m"
FAILURE = "thruster_events.0.time_s"
CONDITIONS = conditions_of(Sweep(zip={"start.y_m": [2.455, 2.8, 2.8], FAILURE: [146.4, 91.2, 30]}))


def frame(**columns: list) -> pandas.DataFrame:
    return pandas.DataFrame(columns)


def missions(manager: str, by_condition: dict[int, list[float]]) -> pandas.DataFrame:
    rows = [
        (manager, value, 1.0, number) for number, values in by_condition.items() for value in values
    ]
    made = pandas.DataFrame(
        rows, columns=["manager", "search_time_s", "distance_inspected_m", "condition"]
    )
    return made.assign(
        detection_x_m=float("nan"), pipeline_found=True, mean_reaction_time_s=float("nan")
    )


def test_a_mission_is_of_the_condition_whose_rounded_values_its_columns_have():
    runs = frame(**{"start.y_m": [2.8, 2.46, 2.8], FAILURE: [30.0, 146.39, 91.19]})
    assert numbered(runs, CONDITIONS)["condition"].tolist() == [3, 1, 2]


@pytest.mark.parametrize("column", ["condition", "block"])
def test_a_column_may_give_the_number(column):
    assert numbered(frame(**{column: [3, 1]}), CONDITIONS)["condition"].tolist() == [3, 1]


@pytest.mark.parametrize(
    ("columns", "row"),
    [
        ({"start.y_m": [2.455, 3.9]}, "1"),
        ({"start.y_m": [2.8]}, "0"),
        ({"block": [1, 4]}, "1"),
        ({"block": [0]}, "0"),
        ({"block": [1.5]}, "0"),
        ({"block": ["one"]}, "0"),
    ],
)
def test_a_mission_without_one_condition_is_named(columns, row):
    with pytest.raises(InputError) as error:
        numbered(frame(**columns), CONDITIONS)
    assert error.value.place == row


def in_order(*numbers: int, starts: Sequence[float] = ()) -> pandas.DataFrame:
    """Missions of managers, so many of each; or of one that began at these places."""
    if starts:
        return frame(manager=["none"] * len(starts), initial_y_m=list(starts))
    names = [
        name for name, number in zip(["none", "bt"], numbers, strict=False) for _ in range(number)
    ]
    return frame(manager=names)


def test_in_order_each_manager_has_as_many_missions_of_each_condition():
    found = numbered(in_order(3, 6), CONDITIONS)["condition"].tolist()
    assert found == [1, 2, 3, 1, 1, 2, 2, 3, 3]


def test_a_short_last_block_follows_from_how_many_are_in_a_row():
    found = numbered(in_order(12), CONDITIONS, runs_each=5)["condition"].tolist()
    assert found == [1] * 5 + [2] * 5 + [3] * 2


def test_a_short_last_block_follows_from_where_missions_began():
    # Where missions begin is 0.4 m from the start, and differs by 0.35 m from condition to
    # condition but for the last, whose start is that of the second.
    conditions = CONDITIONS.assign(**{"start.y_m": [2.4, 2.8, 2.4]})
    starts = [2.8] * 5 + [3.2] * 5 + [2.8] * 2
    found = numbered(in_order(starts=starts), conditions)["condition"].tolist()
    assert found == [1] * 5 + [2] * 5 + [3] * 2


EXEMPLARS = (
    'mission name,"initial pos (x,y)",mission duration (s),pipeline found,time searching pipeline (s),'
    "distance inspected (m),mean reaction time (s)"
)


def of_exemplar(name: str, start_y_m: float, search_time_s: int = 50) -> str:
    return f'{name},"(-17.0, {start_y_m})",300,True,{search_time_s},12.5,0.5'


def begun_at(write: Write, *starts_y_m: float) -> list[int]:
    """Conditions of missions in the exemplar's own file, of three that differ by 0.4 m."""
    conditions = conditions_of(Sweep(zip={"start.y_m": [2.2, 2.6, 3.0]}))
    rows = [of_exemplar("suave bt", at) for at in starts_y_m]
    real = read_real([write("bt.csv", "\n".join([EXEMPLARS, *rows]))], conditions)
    return real.frame["condition"].tolist()


def test_starts_in_the_exemplars_own_files_may_all_be_apart(write):
    assert begun_at(write, 2.55, 2.95, 3.35) == [1, 2, 3]


def files_of_kinds(write: Write, *names: str) -> list[Path]:
    """The exemplar's own files, each of a mission of a kind and a manager."""
    return [
        write(f"{number}.csv", "\n".join([EXEMPLARS, of_exemplar(name, 2.5)]))
        for number, name in enumerate(names)
    ]


def test_managers_of_the_exemplars_two_kinds_of_missions_are_pooled(write):
    files = files_of_kinds(write, "suave bt", "suave_extended random")
    assert read_real(files).managers == ("bt", "random")


def test_files_of_several_managers_are_one_data_set(write):
    paths = [
        write(f"{name}.csv", f"{OWN},block\n{name},20,1,1\n{name},30,1,3\n")
        for name in ("bt", "none")
    ]
    real = read_real(paths, CONDITIONS)
    assert list(real.managers) == ["bt", "none"]
    assert real.frame["condition"].tolist() == [1, 3, 1, 3]
    assert "block" not in real.frame
    assert [note.split()[0] for note in real.notes] == ["Condition"] * 3


def test_missions_without_a_condition_are_taken_in_order(write):
    real = read_real([write("bt.csv", f"{OWN}\nbt,20,1\nbt,30,1\nbt,40,1\n")], CONDITIONS)
    assert real.frame["condition"].tolist() == [1, 2, 3]


def test_that_missions_are_taken_in_order_is_noted(write):
    real = read_real([write("bt.csv", f"{OWN}\nbt,20,1\nbt,30,1\nbt,40,1\n")], CONDITIONS)
    assert "taken in order" in real.notes[0]


def test_simulated_missions_are_taken_in_the_real_ones_proportions():
    real = missions("bt", {1: [1.0] * 2, 2: [1.0]})
    simulated = missions("bt", {1: [1.0] * 5, 2: [1.0] * 9, 3: [1.0]})
    assert balanced(real, simulated, ["bt"])["condition"].value_counts().to_dict() == {1: 4, 2: 2}


def test_a_condition_keeps_a_mission_where_fewer_are_simulated_than_real():
    real = missions("bt", {1: [1.0] * 4, 2: [1.0]})
    simulated = missions("bt", {1: [1.0] * 2, 2: [1.0] * 3})
    assert balanced(real, simulated, ["bt"])["condition"].value_counts().to_dict() == {1: 2, 2: 1}


def test_what_differs_between_conditions_is_not_taken_for_chance():
    real, simulated = (
        missions("bt", {1: [50, 52, 54], 2: [120, 121, 122]}),
        missions("bt", {1: [55], 2: [119]}),
    )
    compared = compare_conditions(real, simulated, ["bt"], ["search_time_s"])
    told = compared[["condition", "real_median", "difference_of_medians"]].to_numpy().tolist()
    assert told == [[1, 52, 3], [2, 121, -2]]
    assert over_conditions(compared)[["manager", "difference"]].to_numpy().tolist() == [
        ["bt", 2.5],
        ["all", 2.5],
    ]


def test_spread_within_conditions_is_compared_where_both_sides_have_some():
    real, simulated = (
        missions("bt", {1: [50, 52], 2: [120]}),
        missions("bt", {1: [50, 54], 2: [119, 130]}),
    )
    found = over_conditions(compare_conditions(real, simulated, ["bt"], ["search_time_s"]))
    assert found["std_ratio"].tolist() == pytest.approx([2.0, 2.0])


@pytest.mark.parametrize(("limit", "met"), [(2.5, True), (2.4, False)])
def test_a_file_of_targets_may_limit_differences_within_conditions(write, limit, met):
    path = write(
        "real.targets.yaml",
        f"conditions: {{search_time_s: {{median_difference: {limit}, std_ratio: 2}}}}\n",
    )
    real = missions("bt", {1: [50, 52, 54], 2: [120, 121, 122]})
    simulated = missions("bt", {1: [55, 55, 55], 2: [119, 119, 119]})
    found = validate(real, simulated, ["bt"], limits=validated(read_yaml(path), Targets).conditions)
    targets = found.targets.set_index("kind")["met"]
    assert targets["condition_median"] is met
    assert targets["condition_std"]
    assert len(found.conditions) == 4


def test_missions_that_never_found_the_pipeline_do_not_differ_by_the_number_written_for_them():
    real = missions("bt", {1: [50.0, 60.0, 251.0] * 30}).assign(
        pipeline_found=[True, True, False] * 30
    )
    simulated = missions("bt", {1: [50.0, 60.0, 250.0] * 30}).assign(
        pipeline_found=[True, True, False] * 30
    )
    found = validate(real, simulated, ["bt"])
    assert found.not_found_s == 250.0
    assert found.cells.loc[0, "ks_p"] == 1.0
    assert found.cells.loc[0, "published_mean"] == pytest.approx(120.0)


def test_a_find_after_the_limit_still_counts_as_sooner_than_none():
    real = missions("bt", {1: [255.0, 251.0]}).assign(pipeline_found=[True, False])
    assert validate(real, real, ["bt"]).not_found_s == 255.0


def lost(times_s: Sequence[float], end_s: float, **columns: float) -> pandas.DataFrame:
    """Missions of which the last never found the pipeline, and ended at that time."""
    frame = missions("bt", {1: [*times_s, end_s]}).assign(**columns)
    return frame.assign(pipeline_found=[True] * len(times_s) + [False])


def test_missions_that_ended_early_are_compared_under_the_limit_that_a_column_has():
    simulated = lost([50.0], 300.0)
    found = validate(lost([50.0], 75.0, time_limit_s=300.0), simulated, ["bt"])
    assert found.not_found_s == 300.0
    assert found.cells.loc[0, "difference_of_means"] == 0.0


def test_a_mission_that_ended_early_counts_as_one_that_never_found_the_pipeline():
    real = missions("bt", {1: [60.0, 75.0, 75.0, 300.0]})
    real = real.assign(pipeline_found=[True, False, False, False])
    found = validate(real, real, ["bt"])
    assert found.not_found_s == 300.0


def test_the_share_that_found_the_pipeline_is_compared():
    real = missions("bt", {1: [50.0] * 4}).assign(pipeline_found=[True, True, True, False])
    (share,) = validate(real, real.assign(pipeline_found=True), ["bt"]).shares.to_dict("records")
    assert (share["name"], share["published_share"], share["simulated_share"]) == (
        "pipeline found",
        0.75,
        1.0,
    )


def test_reaction_times_are_compared_of_the_missions_that_have_one():
    real = missions("bt", {1: [50.0] * 4}).assign(
        mean_reaction_time_s=[1.0, 2.0, 3.0, float("nan")]
    )
    found = validate(real, real, ["bt"])
    reaction = found.cells.set_index("metric").loc["mean_reaction_time_s"]
    assert reaction[["published_n", "published_mean"]].tolist() == [3, 2.0]


UNKNOWN = math.nan


@pytest.fixture
def few(missions):
    return missions(
        {
            "metacontrol": [
                (120, 50, -19.0),
                (125, 50, -18.5),
                (130, 50, -17.0),
                (75, 60, -16.0),
                (126, 50, UNKNOWN),
            ],
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
        (
            {"where": {"detection_x_m": [(-19.5, -18.9), (-16.1, -15.9)]}},
            (2, 5),
        ),  # one of several intervals
    ],
)
def test_missions_are_counted_in_regions(share, counted, few):
    assert Share(manager="metacontrol", name="some", **share).count(few) == counted


def test_places_that_come_from_sums_of_steps_are_at_the_interval_end(missions):
    share = Share(manager="none", name="edge", where={"detection_x_m": [(-17.5, -16.0)]})
    assert share.count(missions({"none": [(1, 1, -17.5 - 1e-9), (1, 1, -17.51)]})) == (1, 2)


def test_no_mission_has_no_share(missions):
    share = Share(
        manager="none",
        name="any",
        among={"search_time_s": [(0, 1)]},
        where={"search_time_s": [(0, 1)]},
    )
    few = missions({"none": [(5, 1, 1)]})
    assert share.count(few) == (0, 0)
    (row,) = compare_shares([share], few.assign(pipeline_found=math.nan), few, ["none"]).to_dict(
        "records"
    )
    assert row["published_share"] is None


PUBLISHED = shipped_folder("scenarios/published") / "seams2023_runs.csv"


def shipped_shares() -> tuple[Share, ...]:
    return validated(read_yaml(PUBLISHED.with_suffix(".targets.yaml")), Targets).shares


def test_the_shipped_shares_cover_each_manager():
    assert {share.manager for share in shipped_shares()} == {"none", "random", "metacontrol"}


def test_the_published_runs_meet_the_targets_of_the_shipped_shares():
    published = read_runs(PUBLISHED).frame
    with_target = [share for share in shipped_shares() if share.target is not None]
    assert len(with_target) == 4
    for share in with_target:
        low, high = share.target
        counted, n = share.count(published)
        assert low <= counted / n <= high


ENTRY = "shares:\n  - manager: none\n    name: early\n    where: {where}\n"


@pytest.mark.parametrize(
    ("content", "place", "problem"),
    [
        ("share: []\n", "line 1", "unknown key 'share'"),
        ("shares:\n  - manager: none\n    name: early\n", "line 2, shares[0].where", "is missing"),
        (ENTRY.format(where="{}"), "line 4, shares[0].where", ""),
        (ENTRY.format(where="{search_time_s: []}"), "line 4, shares[0].where.search_time_s", ""),
        (
            ENTRY.format(where="{search_time_s: [[9, 3]]}"),
            "line 4, shares[0].where.search_time_s[0]",
            "above the end",
        ),
        (
            ENTRY.format(where="{search_time_s: [[3]]}"),
            "line 4, shares[0].where.search_time_s[0]",
            "",
        ),
        (
            ENTRY.format(where="{search_time_s: [[3, soon]]}"),
            "line 4, shares[0].where.search_time_s[0]",
            "",
        ),
        (ENTRY.format(where="{speed: [[3, 4]]}"), "line 4, shares[0].where", ""),
        (
            ENTRY.format(where="{search_time_s: [[3, 4]]}") + "    target: [0.2, 1.2]\n",
            "line 5",
            "between 0 and 1",
        ),
        (
            ENTRY.format(where="{search_time_s: [[3, 4]]}") + "    of: missions\n",
            "line 5",
            "not allowed",
        ),
    ],
)
def test_a_wrong_file_of_shares_is_named_with_its_line(write, content, place, problem):
    path = write("runs.targets.yaml", content)
    with pytest.raises(InputError) as caught:
        validated(read_yaml(path), Targets)
    assert caught.value.file == str(path)
    assert caught.value.place.startswith(place)
    assert problem in caught.value.problem


class TestIntervalsOverConditions:
    """Real missions differ by 40 s between conditions and by 2 s within; simulated ones take 1, 2,
    or 6 s more."""

    REAL: ClassVar = {1: [50.0, 52.0], 2: [90.0, 92.0], 3: [130.0, 132.0]}
    SIMULATED: ClassVar = {1: [51.0, 53.0], 2: [92.0, 94.0], 3: [136.0, 138.0]}

    @pytest.fixture
    def cell(self, few_resamples):
        found = validate(missions("bt", self.REAL), missions("bt", self.SIMULATED), ["bt"])
        return found.cells.set_index("metric").loc["search_time_s"]

    def test_a_difference_of_means_has_the_t_interval_over_the_conditions(self, cell):
        tested = stats.ttest_1samp([1.0, 2.0, 6.0], 0.0).confidence_interval(0.95)
        ends = [cell[f"difference_of_means_ci95_{end}"] for end in ("low", "high")]
        assert ends == pytest.approx(list(tested))

    def test_a_real_mean_has_the_t_interval_over_the_conditions(self, cell):
        low, high = stats.t.interval(0.95, 2, 91.0, stats.sem([51.0, 91.0, 131.0]))
        ends = [cell[f"published_mean_ci95_{end}"] for end in ("low", "high")]
        assert ends == pytest.approx([low, high])

    def test_of_one_condition_missions_are_independent(self, few_resamples):
        real = missions("bt", {1: [50.0, 52.0, 57.0]})
        found = validate(real, missions("bt", {1: [51.0, 53.0, 55.0]}), ["bt"])
        expected = stats.t.interval(0.95, 2, 53.0, stats.sem([50.0, 52.0, 57.0]))
        ends = found.cells.loc[0, ["published_mean_ci95_low", "published_mean_ci95_high"]]
        assert ends.tolist() == pytest.approx(expected)


def test_a_validation_says_which_of_its_figures_are_over_conditions(few_resamples):
    real = missions("bt", {1: [50.0, 52.0], 2: [90.0, 92.0]})
    text = " ".join(validate(real, real, ["bt"]).remarks("real"))
    assert "are over the conditions (Student's t)" in text
    assert "The tests (KS, AD, Mann-Whitney) and intervals of standard deviations" in text
    assert "take missions as independent" in text


def test_a_validation_without_conditions_says_nothing_of_them(few_resamples):
    alone = missions("bt", {1: [50.0, 52.0], 2: [90.0, 92.0]}).drop(columns="condition")
    assert "independent" not in " ".join(validate(alone, alone, ["bt"]).remarks("real"))


# What is said of missions that cannot be used.


def columns(**values: list[object]) -> Callable[[Write], object]:
    return lambda write: numbered(frame(**values), CONDITIONS)


def turned(write: Write) -> object:
    conditions = CONDITIONS.assign(**{"start.y_m": [2.4, 2.8, 3.2]})
    return numbered(in_order(starts=[3.2, 3.2, 2.8, 2.8, 2.4, 2.4]), conditions)


def of_two_kinds(write: Write) -> object:
    return read_real(files_of_kinds(write, "suave bt", "suave random", "suave_extended random"))


def files(first: str, second: str) -> Callable[[Write], object]:
    return lambda write: read_real([write("a.csv", first), write("b.csv", second)], CONDITIONS)


def ended(real: pandas.DataFrame, simulated: pandas.DataFrame) -> Callable[[Write], object]:
    return lambda write: validate(real, simulated, ["bt"])


def unknown_manager(write: Write) -> object:
    return read_real([write("runs.csv", f"{OWN}\nnone,1,2\n")]).choose(["nonw"])


BT, NONE = f"{OWN}\nbt,20,1\n", f"{OWN}\nnone,20,1\n"
BT_IN_BLOCK_1 = f"{OWN},block\nbt,20,1,1\n"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (columns(**{"start.y_m": [2.455, 3.9]}), "that have start.y_m=3.9: none"),
        (columns(**{"start.y_m": [2.8]}), "that have start.y_m=2.8: 2, 3"),
        (columns(block=[1, 4]), "block: there is no condition 4"),
        (columns(block=[0]), "block: there is no condition 0"),
        (columns(block=[1.5]), "block: there is no condition 1.5"),
        (columns(block=["one"]), "block: there is no condition one"),
        (
            lambda write: numbered(in_order(5), CONDITIONS),
            "5 missions of manager none, which 3 conditions do not share evenly",
        ),
        (
            lambda write: numbered(in_order(12), CONDITIONS),
            "12 missions of manager none, which may be 4 or 5 in a row of each of 3 conditions",
        ),
        (
            lambda write: numbered(in_order(2), CONDITIONS),
            "2 missions of manager none, which 3 conditions do not share evenly",
        ),
        (turned, "do not begin where the 3 conditions have their starts"),
        (
            lambda write: begun_at(write, 3.35, 2.95, 2.55),
            "do not begin where the 3 conditions have their starts",
        ),
        (of_two_kinds, "random has missions of suave and of suave_extended"),
        (files(BT, BT), "b.csv: has the same content as "),
        (files(BT_IN_BLOCK_1, NONE), "b.csv: line 2: block: there is no condition nan"),
        (files(BT, NONE), "has 1 mission of manager bt, which 3 conditions do not share"),
        (
            files(BT_IN_BLOCK_1, f"{OWN},block\n\nnone,20,1,7\n"),
            "b.csv: line 3: block: there is no condition 7",
        ),
        (
            ended(lost([50.0], 151.0), lost([50.0], 250.0)),
            "bt end after 250 s, real missions after 151 s",
        ),
        (
            ended(missions("bt", {1: [280.0, 50.0]}), lost([50.0], 250.0)),
            "bt end after 250 s, real missions after 280 s",
        ),
        (
            ended(
                missions("bt", {1: [50.0]}).assign(time_limit_s=150),
                missions("bt", {1: [50.0]}).assign(mission_duration_s=250.2),
            ),
            "bt end after 250 s, real missions after 150 s",
        ),
        (
            ended(
                missions("bt", {1: [50.0, 60.0]}).assign(time_limit_s=[150, 250]),
                lost([50.0], 250.0),
            ),
            "there are time limits of 150 and of 250 s",
        ),
        (unknown_manager, "no mission of manager 'nonw'"),
    ],
)
def test_what_cannot_be_used_is_refused(write, given, said):
    with pytest.raises(InputError) as caught:
        given(write)
    assert said in str(caught.value)
