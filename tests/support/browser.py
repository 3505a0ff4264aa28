"""Debian's Chromium without a window, driven by Playwright."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tactile_live.server import LivePage

CHROMIUM = Path("/usr/bin/chromium")

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
"""It speaks with nobody but the page."""


def why_not() -> str:
    """Return why no browser can be used here; empty if one can."""
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return "playwright is not installed; make test-pages installs it"
    return "" if os.access(CHROMIUM, os.X_OK) else "chromium is not installed; see .ci/packages"


@contextmanager
def chromium() -> Iterator[Any]:
    """Yield a browser, with a new empty profile."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


class Tab:
    """A page in the browser, which must not report any error."""

    def __init__(self, tab: Any) -> None:
        self.tab = tab
        self.errors: list[str] = []
        self.requests: list[str] = []
        tab.on("pageerror", lambda error: self.errors.append(str(error)))
        tab.on("request", lambda request: self.requests.append(request.url))
        tab.on(
            "console",
            lambda line: self.errors.append(line.text) if line.type == "error" else None,
        )

    def open(self, page: LivePage) -> Tab:
        self.tab.goto(page.address)
        self.live()
        return self

    def live(self, cards: int = 1) -> None:
        """Wait until each sensor has shown some more pictures."""
        shown = [self.pictures(index) for index in range(cards)]
        for index, before in enumerate(shown):
            self.wait(lambda index=index, before=before: self.pictures(index) > before + 2)

    def pictures(self, index: int = 0) -> int:
        card = self.tab.locator(".card").nth(index)
        return int(card.get_attribute("data-pictures", timeout=20_000) or 0)

    def wait(self, there: Callable[[], Any]) -> Any:
        for _ in range(400):
            if found := there():
                return found
            self.tab.wait_for_timeout(50)
        said = self.tab.locator(".said").all_inner_texts()
        raise AssertionError(f"the page did not get there in time; it says {said}")

    def text(self, selector: str, index: int = 0) -> str:
        return str(self.tab.locator(selector).nth(index).inner_text())

    def said(self, words: str) -> None:
        self.wait(lambda: words in self.text(".said"))

    def press(self, button: str) -> None:
        self.tab.get_by_role("button", name=button).first.click()
