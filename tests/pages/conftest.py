"""A browser, and a campaign to show."""

import pytest

from suave_des.campaign.campaign import run_campaign
from tests.helpers.browser import chromium


@pytest.fixture(scope="module")
def browser():
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaigns") / "two"
    run_campaign("seams2023", ["none", "bt"], runs=8, out=folder)
    return folder
