"""Missions are read from every kind of file in which they come; a file that is wrong is named with
its line.
"""

import math

import pandas
import pytest

from suave_des.errors import InputError
from suave_des.records.runs import Runs, read_runs

OWN = "manager,search_time_s,distance_inspected_m"


@pytest.fixture
def of_a_campaign(write) -> pandas.DataFrame:
    rows = "sea,none,120,3.5,-17.5\nsea,none,300,0,\n"
    return read_runs(write("runs.csv", f"scenario,{OWN},detection_x_m\n{rows}")).frame


def test_a_campaigns_places_of_detection_are_read(of_a_campaign):
    assert of_a_campaign["detection_x_m"].fillna("none").tolist() == [-17.5, "none"]


def test_a_campaigns_scenario_is_read(of_a_campaign):
    assert of_a_campaign["scenario"].tolist() == ["sea", "sea"]


def test_missions_have_the_numbers_of_their_lines(of_a_campaign):
    assert of_a_campaign.index.tolist() == [2, 3]


@pytest.mark.parametrize(
    "content",
    [f"{OWN}\n\nnone,120,3\n\n", f"\ufeff{OWN}\nnone,120,3\n"],
    ids=["blank lines", "a byte order mark"],
)
def test_what_programs_add_does_no_harm(write, content):
    assert len(read_runs(write("runs.csv", content)).frame) == 1


def test_managers_are_chosen_of_those_that_are_there(write):
    runs = read_runs(write("runs.csv", f"{OWN}\nnone,1,2\nbt,1,2\n"))
    assert runs.choose(["none"]) == ("none",)


def test_a_file_of_one_scenario_may_be_simulated(write):
    read_runs(write("runs.csv", f"scenario,{OWN}\nsea,none,1,2\n")).check_simulated()


def test_further_columns_are_numbers_where_all_their_values_are(write):
    path = write("runs.csv", f"{OWN},period,mode\nnone,120,3,40,low\nnone,130,3,80.5,7\n")
    frame = read_runs(path, ["period", "mode"]).frame
    assert frame["period"].tolist() == [40.0, 80.5]
    assert frame["mode"].tolist() == ["low", "7"]


HEADER_2023 = 'mission_name,datetime,"initial pos (x,y)",time budget (s),time search (s),distance inspected (m)'
HEADER_1_5 = (
    'mission name,datetime,"initial pos (x,y)",mission duration (s),pipeline found,time searching pipeline (s),'
    "distance inspected (m),mean reaction time (s)"
)
OF_2023 = 'time constrained {},Feb-04-2023-00-56-36,"(-17.0, 2.57)",300,{},{}'
OF_1_5 = 'suave {},01-Jul-2025-00-43-53,"(-17.0, 2.57)",250,{},{},{},{}'


AVERAGES = pytest.mark.parametrize(
    ("rows", "averages"),
    [
        (["Mean,,,,,87.0,40.25,0.5", "Std,,,,,0.0,0.0,0.0"], (3, 4)),
        (["AVERAGE,,,,,87.0,40.25", ",,,,,,,", "STD,,,,,0.0,0.0"], (3, 5)),
        ([",,,AVERAGE,,87", "std:,1"], (3, 4)),
    ],
)


@pytest.fixture
def with_averages(write, rows) -> Runs:
    lines = [HEADER_1_5, OF_1_5.format("bt", True, 87, 40.25, 0.5), *rows]
    return read_runs(write("results.csv", "\n".join(lines)))


@AVERAGES
def test_averages_of_the_exemplars_files_are_no_missions(with_averages, averages):
    assert len(with_averages.frame) == 1


@AVERAGES
def test_their_lines_are_noted(with_averages, averages):
    lines = ", ".join(map(str, averages))
    (file,) = with_averages.files
    assert with_averages.notes == (f"{file}: lines {lines} left out: averages, not missions",)


def test_files_of_the_exemplar_that_were_put_together_are_read(write):
    rows = [OF_2023.format("none", 204, 27.1), "", HEADER_2023, OF_2023.format("random", -1, 0.0)]
    runs = read_runs(write("results.csv", "\n".join([HEADER_2023, *rows])))
    assert runs.frame["manager"].tolist() == ["none", "random"]
    assert runs.frame["search_time_s"].tolist() == [204.0, 300.0]
    assert runs.frame["pipeline_found"].tolist() == [1.0, 0.0]
    assert runs.frame.index.tolist() == [2, 5]


@pytest.mark.parametrize(
    ("indices", "runs", "seeds"),
    [((4, 7), [4, 7], ["suave", "suave"]), ((4, 4), [], ["", ""])],
    ids=["each once", "one twice"],
)
def test_run_idx_numbers_the_exemplars_missions_if_each_has_a_number_of_its_own(
    write, indices, runs, seeds
):
    rows = [f"{OF_1_5.format('bt', True, 87, 40.25, 0.5)},{index}" for index in indices]
    frame = read_runs(write("results.csv", "\n".join([f"{HEADER_1_5},run_idx", *rows]))).frame
    assert (frame["run"].dropna().tolist(), frame["seed"].tolist()) == (runs, seeds)


def test_an_error_below_a_repeated_header_names_its_own_line(write):
    path = write(
        "results.csv",
        "\n".join([HEADER_1_5, HEADER_1_5, OF_1_5.format("bt", "perhaps", 44, 47.6, 0.05)]),
    )
    with pytest.raises(InputError) as caught:
        read_runs(path)
    assert caught.value.place == "line 3"


def test_the_behaviour_tree_of_the_extended_mission_is_the_manager_of_that_name_here(write):
    rows = [
        OF_1_5.replace("suave", "suave_extended").format(name, True, 44, 47.6, 0.05)
        for name in ("bt", "none")
    ]
    runs = read_runs(
        write(
            "results.csv", "\n".join([HEADER_1_5, *rows, OF_1_5.format("bt", True, 44, 47.6, 0.05)])
        )
    )
    assert runs.frame["manager"].tolist() == ["bt_extended", "none", "bt"]


@pytest.mark.parametrize(
    ("header", "rows", "found"),
    [
        (f"{OWN},pipeline_found", ["none,251,0,False", "none,20,1,true"], [False, True]),
        (f"{OWN},time_limit_s", ["none,300,0,300", "none,299,1,300"], [False, True]),
        (OWN, ["none,300,0"], [None]),
    ],
)
def test_whether_the_pipeline_was_found_is_read_or_follows_from_the_time_limit(
    write, header, rows, found
):
    frame = read_runs(write("runs.csv", "\n".join([header, *rows]))).frame
    assert [None if math.isnan(value) else value for value in frame["pipeline_found"]] == found


@pytest.mark.parametrize(
    ("scenario", "is_known"), [(None, [False, True, False]), ("sea", [True, True, False])]
)
def test_a_reaction_time_of_zero_is_none_unless_a_campaign_wrote_it(write, scenario, is_known):
    rows = ["none,20,1,0.0", "none,20,1,1.5", "none,20,1,"]
    if scenario is not None:
        rows = [f"{scenario},{row}" for row in rows]
    header = (
        f"{OWN},mean_reaction_time_s"
        if scenario is None
        else f"scenario,{OWN},mean_reaction_time_s"
    )
    times = read_runs(write("runs.csv", "\n".join([header, *rows]))).frame["mean_reaction_time_s"]
    assert times.notna().tolist() == is_known


IN_NO_SWEEP = pytest.mark.parametrize("number", ["1" * 400, "1e400", "-" + "9" * 30])


@IN_NO_SWEEP
def test_a_number_that_no_sweep_has_may_name_a_column(write, number):
    frame = read_runs(write("runs.csv", f"{OWN},{number}\nnone,120,3,1\n")).frame
    assert frame[number].tolist() == [1]


@IN_NO_SWEEP
def test_in_a_further_column_it_is_text_or_a_number(write, number):
    frame = read_runs(write("runs.csv", f"{OWN},depth\nnone,120,3,{number}\n")).frame
    assert frame["depth"].tolist() in ([number], [float(number)])


@IN_NO_SWEEP
def test_as_a_metric_it_is_refused_with_its_line(write, number):
    with pytest.raises(InputError) as caught:
        read_runs(write("runs.csv", f"{OWN},adaptations\nnone,120,3,{number}\n"))
    assert caught.value.place == "line 2"
