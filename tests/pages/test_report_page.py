"""The report, opened in a browser as a reader would."""

import json
import shutil

import pandas
import pytest

from suave_des.pages.report import PAGE_LIMIT_BYTES, report_page
from suave_des.results.style import line, looks
from tests.helpers.browser import DESKTOP, PHONE, opened

pytest.importorskip("plotly")
MARKUP = "<b>mine</b>$x$</script><img/src=x/onerror=alert(1)>"


@pytest.fixture(scope="module")
def report(campaign):
    file = campaign / "report.html"
    file.write_text(report_page([campaign], runs=3), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def opened_report(report, browser):
    """The report in a window, for those who only look or undo what they choose: drawing takes
    seconds.
    """
    with opened(browser, report) as found:
        yield ready(found)


@pytest.fixture(scope="module")
def on_a_phone(report, browser):
    """The report on a phone with a dark theme, for those who only look."""
    with opened(browser, report, PHONE, theme="dark") as found:
        yield ready(found)


def ready(found):
    found.wait_until("document.body.dataset.ready === 'true'")
    return found


def traces(found, chart):
    return found.value(f"document.getElementById('{chart}').data.map(each => each.name)")


@pytest.mark.parametrize("window", ["opened_report", "on_a_phone"])
class TestWindow:
    def test_it_opens_without_complaint(self, window, request):
        assert request.getfixturevalue(window).complaints == []

    def test_it_opens_without_request(self, window, request, report):
        assert request.getfixturevalue(window).outside(report) == []

    def test_it_is_not_wider(self, window, request):
        width = {"opened_report": DESKTOP, "on_a_phone": PHONE}[window][0]
        found = request.getfixturevalue(window)
        assert found.value("document.documentElement.scrollWidth") <= width

    def test_it_has_the_theme_of_the_browser(self, window, request):
        theme = {"opened_report": "light", "on_a_phone": "dark"}[window]
        found = request.getfixturevalue(window)
        assert found.value("document.documentElement.dataset.theme") == theme

    @pytest.mark.parametrize(
        "chart", ["ecdf", "spread", "paired", "where", "runs", "run-time", "run-map"]
    )
    def test_each_chart_is_drawn(self, window, chart, request):
        paths = f"document.querySelectorAll('#{chart} svg path').length"
        assert request.getfixturevalue(window).value(paths) > 3


OVERLAP = """(() => {
  const box = name => document.querySelector(name).getBoundingClientRect();
  const [legend, title, side] = [box('#run-legend'), box('#run-time .xtitle'), box('#run-time .ytitle')];
  return { overlap: legend.top < title.bottom, left: side.top - box('#run-time').top };
})()"""


def test_on_a_phone_the_timeline_s_legend_stands_clear_of_its_title(on_a_phone):
    assert not on_a_phone.value(OVERLAP)["overlap"]


def test_on_a_phone_the_title_of_the_timeline_s_axis_is_whole(on_a_phone):
    assert on_a_phone.value(OVERLAP)["left"] >= 0


@pytest.fixture
def legend(opened_report):
    return opened_report.value(
        "[...document.querySelectorAll('#run-legend span')].map(each => each.textContent)"
    )


def test_the_timeline_names_its_marks_as_a_replay_does(legend):
    assert legend[0] == "▼adaptation"
    assert legend[legend.index("altitude in") - 1] == "┄visibility"


def test_the_timeline_names_its_modes_as_a_replay_does(legend):
    assert "━fd_spiral_low" in legend
    assert "━fd_follow_pipeline" in legend


@pytest.mark.parametrize("manager", ["none", "bt"])
def test_it_says_first_what_follows_for_each_manager(opened_report, manager):
    assert manager in opened_report.page.text_content("#conclusion")


def test_it_says_last_how_it_was_made(opened_report):
    assert "SHA-256" in opened_report.page.text_content("#how")


def test_it_says_of_how_many_missions_it_is(opened_report):
    assert opened_report.page.text_content("#count") == "16 missions"


def test_a_manager_has_the_colour_that_it_has_in_figures(opened_report):
    for number, name in enumerate(("none", "bt"), start=1):
        chip = f"#managers button:nth-child({number}) i"
        shown = opened_report.page.evaluate(
            f"getComputedStyle(document.querySelector('{chip}')).backgroundColor"
        )
        assert shown == "rgb({}, {}, {})".format(*bytes.fromhex(line(*looks([name]))["color"][1:]))


@pytest.fixture
def choices(opened_report):
    """The page of the report, whose choices are afterwards as they were."""
    page = opened_report.page
    before = {choice: page.input_value(f"#{choice}") for choice in ("metric", "found")}
    yield page
    for choice, value in before.items():
        if page.input_value(f"#{choice}") != value:
            page.select_option(f"#{choice}", value)


FIRST_MANAGER = "#managers button:first-child"


def test_a_manager_can_be_left_out_for_a_while(opened_report):
    page, seen = opened_report.page, []
    for _ in range(2):
        seen.append((traces(opened_report, "ecdf"), page.text_content("#count")))
        page.click(FIRST_MANAGER)
    assert seen == [(["none", "bt"], "16 missions"), (["bt"], "8 missions")]
    assert (traces(opened_report, "ecdf"), page.text_content("#count")) == seen[0]


def test_a_metric_can_be_chosen(choices):
    choices.select_option("#metric", "distance_inspected_m")
    assert "distance" in choices.text_content("#ecdf-title")


def test_runs_can_be_chosen(choices):
    choices.select_option("#found", "0")
    assert choices.text_content("#count") != "16 missions"


@pytest.fixture(scope="module")
def clicked(opened_report, campaign):
    """The report after a click on a mission, and the mission's row."""
    rows = pandas.read_csv(campaign / "runs.csv")
    opened_report.page.evaluate(
        "document.getElementById('runs').emit('plotly_click', {points: [{customdata: 9}]})"
    )
    return opened_report, rows[(rows.manager == "bt") & (rows.run == 2)].iloc[0]


class TestClickOnAMission:
    def test_shows_its_numbers(self, clicked):
        found, row = clicked
        selected = found.page.text_content("#run-table tr[aria-selected=true]")
        assert f"{row.search_time_s:g}" in selected

    def test_chooses_its_run(self, clicked):
        found, _ = clicked
        assert found.page.input_value("#run-number") == "2"

    def test_shows_the_command_that_replays_it(self, clicked):
        found, _ = clicked
        assert "--run 2 --managers bt" in found.page.text_content("#run-command")

    def test_draws_its_adaptations(self, clicked):
        found, row = clicked
        drawn = found.value(
            "document.getElementById('run-time').data.find(each => each.name === 'adaptation').x"
        )
        assert len(drawn) == row.adaptations > 0


def test_what_a_manifest_says_is_written_as_text(campaign, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(campaign, folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest |= {"sweep": {"grid": {"start.x_m": [1, 2.5]}}, "points": 2}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    page = report_page([folder], runs=0)
    for written in ('"managers":"none, bt"', '"failures":"none"', '"grid":"start.x_m: 1, 2.5"'):
        assert written in page


def test_names_are_text_never_markup(campaign, tmp_path, browser):
    rows = pandas.read_csv(campaign / "runs.csv")
    rows.assign(manager=rows.manager.replace("bt", MARKUP)).to_csv(
        tmp_path / "runs.csv", index=False
    )
    file = tmp_path / "report.html"
    file.write_text(report_page([tmp_path]), encoding="utf-8")
    with opened(browser, file) as found:
        ready(found)
        assert found.complaints == []
        assert MARKUP in found.page.text_content("#managers")
        assert (
            found.value("document.querySelectorAll('img, #managers b, #conclusion b').length") == 0
        )


def test_ten_thousand_missions_make_a_page_that_can_be_sent(campaign, tmp_path):
    rows = pandas.read_csv(campaign / "runs.csv")
    many = pandas.concat([rows.assign(run=rows.run + 8 * copy) for copy in range(625)])
    many.to_csv(tmp_path / "runs.csv", index=False)
    assert len(report_page([tmp_path]).encode()) < PAGE_LIMIT_BYTES


@pytest.mark.parametrize("case", ["one run", "none found"])
def test_results_that_leave_little_to_compare_make_a_page(case, campaign, tmp_path, browser):
    rows = pandas.read_csv(campaign / "runs.csv")
    if case == "one run":
        rows = rows[rows.run == 1]
    else:
        rows = rows.assign(
            pipeline_found=False, search_time_s=300.0, detection_x_m=None, mean_reaction_time_s=None
        )
    rows.to_csv(tmp_path / "runs.csv", index=False)
    file = tmp_path / "report.html"
    file.write_text(report_page([tmp_path]), encoding="utf-8")
    with opened(browser, file) as found:
        ready(found)
        assert found.complaints == []
