"""Take the pictures of reports and replays that README and guides show, from real runs.

    python docs/make_screenshots.py

It needs Chromium. The pictures change with fonts, so no test compares them; one checks that they
are there and small.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from suave_des.campaign.campaign import run_campaign
from suave_des.pages.replay import missions_run, replay_page
from suave_des.pages.report import report_page
from suave_des.scenario.loader import load_scenario

if TYPE_CHECKING:
    from playwright.sync_api import Browser

IMAGES = Path(__file__).resolve().parent / "images"
PICTURES = ("replay.png", "replay-phone.png", "replay-two.png", "report.png")
_COLOURS = 256


def main() -> None:
    """Take all pictures."""
    from playwright.sync_api import sync_playwright

    loaded = load_scenario("seams2023")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        campaign = folder / "seams2023"
        run_campaign("seams2023", ["none", "random", "metacontrol"], runs=100, out=campaign)
        pages = {
            "replay": replay_page(missions_run(loaded, ("metacontrol",), run=2, seed=1)),
            "replay-two": replay_page(
                missions_run(loaded, ("metacontrol", "none"), run=12, seed=1)
            ),
            "report": report_page([campaign]),
        }
        pages["replay-phone"] = pages["replay"]
        for page, text in pages.items():
            (folder / f"{page}.html").write_text(text, encoding="utf-8")
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        _take(browser, folder / "replay.html", "#t=37&theme=dark", (1180, 760))
        _take(browser, folder / "replay-phone.html", "#t=37&theme=dark", (390, 760), scale=2)
        _take(browser, folder / "replay-two.html", "#t=76&theme=light", (1180, 860))
        _take(browser, folder / "report.html", "#theme=light", (1180, 1000))
        browser.close()


def _take(browser: Browser, file: Path, where: str, size: tuple[int, int], scale: int = 1) -> None:
    """Take one picture, in as few colours as it needs; scale: pixels of the screen to one here."""
    viewport = {"width": size[0], "height": size[1]}
    page = browser.new_page(viewport=viewport, device_scale_factor=scale)
    page.goto(file.as_uri() + where)
    while not page.evaluate("document.body.dataset.ready || document.body.dataset.time"):
        page.wait_for_timeout(100)
    page.wait_for_timeout(1000)
    with Image.open(io.BytesIO(page.screenshot())) as taken:
        # A palette of the most frequent colours would leave out those of a mark or a thin line.
        coverage = Image.Quantize.MAXCOVERAGE
        picture = taken.convert("RGB").quantize(_COLOURS, method=coverage, kmeans=4)
    target = IMAGES / f"{file.stem}.png"
    picture.save(target, optimize=True)
    print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
