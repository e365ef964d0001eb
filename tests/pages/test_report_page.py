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


def ready(found):
    found.wait_until("document.body.dataset.ready === 'true'")
    return found


def traces(found, chart):
    return found.value(f"document.getElementById('{chart}').data.map(each => each.name)")


def assert_is_drawn_and_fits(found, report, size, theme):
    assert found.complaints == []
    assert found.outside(report) == []
    assert found.value("document.documentElement.scrollWidth") <= size[0]
    assert found.value("document.documentElement.dataset.theme") == theme
    for chart in ("ecdf", "spread", "paired", "where", "runs", "run-time", "run-map"):
        drawn = found.value(f"document.querySelectorAll('#{chart} svg path').length")
        assert drawn > 3, chart


class TestItOpensWithoutComplaintOrRequestAndFitsTheWindow:
    def test_on_a_desktop(self, report, opened_report):
        assert_is_drawn_and_fits(opened_report, report, DESKTOP, "light")

    def test_on_a_phone_with_a_dark_theme(self, report, browser):
        with opened(browser, report, PHONE, theme="dark") as found:
            assert_is_drawn_and_fits(ready(found), report, PHONE, "dark")


OVERLAP = """(() => {
  const box = name => document.querySelector(name).getBoundingClientRect();
  const [legend, title, side] = [box('#run-legend'), box('#run-time .xtitle'), box('#run-time .ytitle')];
  return { overlap: legend.top < title.bottom, left: side.top - box('#run-time').top };
})()"""


def test_on_a_phone_the_timeline_s_legend_and_titles_stand_clear_of_each_other(report, browser):
    with opened(browser, report, PHONE) as found:
        place = ready(found).value(OVERLAP)
    assert not place["overlap"]
    assert place["left"] >= 0


def test_the_timeline_names_its_marks_and_modes_as_a_replay_does(opened_report):
    told = opened_report.value(
        "[...document.querySelectorAll('#run-legend span')].map(each => each.textContent)"
    )
    assert told[0] == "▼adaptation"
    assert told[told.index("altitude in") - 1] == "┄visibility"
    assert "━fd_spiral_low" in told and "━fd_follow_pipeline" in told


def test_it_says_first_what_follows_and_last_how_it_was_made(opened_report):
    page = opened_report.page
    assert "none" in page.text_content("#conclusion")
    assert "bt" in page.text_content("#conclusion")
    assert "SHA-256" in page.text_content("#how")
    assert page.text_content("#count") == "16 missions"


def test_a_manager_has_the_colour_that_it_has_in_figures(opened_report):
    for number, name in enumerate(("none", "bt"), start=1):
        chip = f"#managers button:nth-child({number}) i"
        shown = opened_report.page.evaluate(
            f"getComputedStyle(document.querySelector('{chip}')).backgroundColor"
        )
        assert shown == "rgb({}, {}, {})".format(*bytes.fromhex(line(*looks([name]))["color"][1:]))


def test_managers_metrics_and_runs_can_be_chosen_and_all_of_them_again(opened_report):
    page = opened_report.page
    assert traces(opened_report, "ecdf") == ["none", "bt"]
    metric, among = (page.input_value(f"#{choice}") for choice in ("metric", "found"))
    page.click("#managers button:first-child")
    assert traces(opened_report, "ecdf") == ["bt"]
    assert page.text_content("#count") == "8 missions"
    page.select_option("#metric", "distance_inspected_m")
    assert "distance" in page.text_content("#ecdf-title")
    page.select_option("#found", "0")
    assert page.text_content("#count") != "8 missions"
    page.select_option("#found", among)
    page.select_option("#metric", metric)
    page.click("#managers button:first-child")
    assert traces(opened_report, "ecdf") == ["none", "bt"]
    assert page.text_content("#count") == "16 missions"


def test_a_click_on_a_mission_shows_its_numbers_and_way(opened_report, campaign):
    rows = pandas.read_csv(campaign / "runs.csv")
    row = rows[(rows.manager == "bt") & (rows.run == 2)].iloc[0]
    page = opened_report.page
    page.evaluate(
        "document.getElementById('runs').emit('plotly_click', {points: [{customdata: 9}]})"
    )
    assert f"{row.search_time_s:g}" in page.text_content("#run-table tr[aria-selected=true]")
    assert page.input_value("#run-number") == "2"
    assert "--run 2 --managers bt" in page.text_content("#run-command")
    drawn = opened_report.value(
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
