"""Headless Chromium, as a reader's browser: the system's own, or the one that playwright has
installed.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from tests.helpers.needed import missing

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
DESKTOP, PHONE = (1280, 800), (390, 844)


@dataclass
class Opened:
    """A page in the browser, and what it complained about or asked for."""

    page: Any
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def outside(self, file: Path) -> list[str]:
        """Requests that leave the page; what it makes of itself (blob:, data:) does not."""
        return [
            each for each in self.requests if not each.startswith((file.as_uri(), "blob:", "data:"))
        ]

    def value(self, script: str) -> Any:
        """The value of a JavaScript expression in the page."""
        return self.page.evaluate(script)

    def wait_until(self, script: str, timeout_s: float = 20.0) -> None:
        """Wait until a JavaScript expression holds; playwright's own way needs eval, which pages
        forbid.
        """
        end_s = time.monotonic() + timeout_s
        while not self.page.evaluate(script):
            assert time.monotonic() < end_s, script
            self.page.wait_for_timeout(20)


@contextmanager
def chromium() -> Iterator[Any]:
    """Start the browser; where it cannot be, skip the test, or fail it in CI."""
    try:
        playwright = import_module("playwright.sync_api")
    except ImportError:
        missing("playwright is not installed")
    with ExitStack() as stack:
        try:
            started = stack.enter_context(playwright.sync_playwright())
        except Exception as error:  # its driver is a program, which needs shared libraries
            missing(f"playwright's driver does not start ({error}): it needs libatomic1")
        system = next(filter(None, map(shutil.which, _NAMES)), None)
        if system is None and not Path(started.chromium.executable_path).exists():
            missing("no Chromium: install the system's, or run `playwright install chromium`")
        browser = started.chromium.launch(
            executable_path=system, args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        stack.callback(browser.close)
        yield browser


@contextmanager
def opened(
    browser: Any, file: Path, size: tuple[int, int] = DESKTOP, hash_: str = "", theme: str = "light"
) -> Iterator[Opened]:
    """Open a file in a window of a size, and listen to it."""
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, color_scheme=theme
    )
    page = context.new_page()
    found = Opened(page)
    page.on("console", lambda message: found.complaints.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: found.complaints.append(str(error)))
    page.on("request", lambda request: found.requests.append(request.url))
    page.goto(file.as_uri() + hash_)
    try:
        yield found
    finally:
        context.close()
