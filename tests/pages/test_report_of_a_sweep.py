"""The report of a campaign that sweeps a parameter, opened in a browser."""

import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.pages.report import report_page
from tests.helpers.browser import opened

pytest.importorskip("plotly")
CAMPAIGN = """campaign: 1
scenario: seams2023
managers: [none, bt]
runs: 3
sweep: {grid: {visibility.period_s: [60, 80], mission.time_limit_s: [100, 110]}}
"""


@pytest.fixture(scope="module")
def report(browser, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    file = folder / "campaign.yaml"
    file.write_text(CAMPAIGN, encoding="utf-8")
    run_campaign(file, out=folder / "out")
    page = folder / "report.html"
    page.write_text(report_page([folder / "out"], runs=1), encoding="utf-8")
    with opened(browser, page) as found:
        found.wait_until("document.body.dataset.ready === 'true'")
        yield found


def test_it_is_drawn_to_its_end_without_complaint(report):
    assert report.complaints == []


def test_its_chart_has_the_means_of_each_manager_over_the_swept_values(report):
    drawn = report.value(
        "document.getElementById('sweep').data.map(each => [each.name, [...each.x]])"
    )
    assert drawn == [["none", [60, 80]], ["bt", [60, 80]]]


def test_its_chart_says_over_what_means_are_averaged(report):
    title = report.page.text_content("#sweep-title")
    assert "over visibility.period_s, averaged over mission.time_limit_s" in title


def test_what_stands_below_the_chart_is_drawn_too(report):
    assert report.value("document.querySelectorAll('#where svg path').length") > 3
