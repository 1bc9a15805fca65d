"""Chromium that has no windows, as Debian has it, and a page that keeps what went wrong in it."""

from __future__ import annotations

import asyncio
import os
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, sync_playwright

from tests.support.peers.peer import PATIENCE_S

DESK = {"width": 1440, "height": 900}
TABLET = {"width": 768, "height": 1024}


_started: list[tuple[Playwright, Browser, asyncio.AbstractEventLoop]] = []


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser of this process; without Chromium the test is skipped on a laptop and fails in CI.

    It starts with the first test that needs it and remains until `end_chromium`: a start costs a second of the
    processor. Between the tests that use it, Playwright's event loop is not the running one of the thread, so that
    another test may have one.
    """
    # The same engine without the program around it, which takes a third more of the processor.
    path = shutil.which("chromium-headless-shell")
    if path is None:
        message = "chromium-headless-shell is not installed: `make system-packages` installs it"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    before = asyncio._get_running_loop()
    if not _started:
        playwright = sync_playwright().start()
        # The server is alone on its page: a new page needs no process apart, held ready for the next site.
        # And its process is the one in which the empty page was.
        arguments = ["--disable-site-isolation-trials", "--renderer-process-limit=1"]
        # Its sandbox does not start for root.
        arguments += ["--no-sandbox"] * (os.geteuid() == 0)
        browser = playwright.chromium.launch(executable_path=path, args=arguments)
        _started.append((playwright, browser, asyncio.get_running_loop()))
    _, browser, loop = _started[0]
    asyncio._set_running_loop(loop)
    of_others = list(browser.contexts)
    try:
        yield browser
        for context in browser.contexts:
            if context not in of_others:
                context.close()
    finally:
        asyncio._set_running_loop(before)


def end_chromium() -> None:
    """End the browser of this process, if a test has started it."""
    while _started:
        playwright, browser, loop = _started.pop()
        asyncio._set_running_loop(loop)
        browser.close()
        playwright.stop()
        asyncio._set_running_loop(None)


class Tab:
    """A page of the dashboard. `wrong` collects what must not happen: errors, refused content, requests elsewhere."""

    def __init__(self, browser: Browser, url: str, wait: bool = True, **options: Any) -> None:
        self.wrong: list[str] = []
        self.url = url
        self.context: BrowserContext = browser.new_context(**({"viewport": DESK} | options))
        self.context.set_default_timeout(1000 * PATIENCE_S)
        self.context.add_init_script(
            "addEventListener('securitypolicyviolation', (e) => console.error('CSP', e.violatedDirective))"
        )
        self.page: Page = self.context.new_page()
        self.page.on("console", lambda m: self.wrong.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", self._looked)
        self.page.goto(url)
        if wait:
            self.until("window.livebode?.bode.curves.measured")

    def __enter__(self) -> Tab:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()

    def reload(self) -> None:
        """Load the page again, once its address holds every choice: a page changes its address only so often."""
        self.page.evaluate(
            "async () => { while (livebode.shownAddress() !== location.href)"
            " await new Promise((done) => setTimeout(done, 20)); }"
        )
        self.page.reload()

    def until(self, expression: str) -> None:
        """Wait for JavaScript to become true; before the page has loaded its parts, their names are not defined."""
        self.page.wait_for_function(
            f"() => {{ try {{ with (window.livebode || {{}}) return Boolean({expression}); }}"
            " catch (error) { if (window.livebode || !(error instanceof ReferenceError)) throw error; return false; } }"
        )

    def settle(self) -> None:
        """Wait until all that is due now is drawn, and each chart has the size that this leaves it.

        The read-out has rows or none, so that it changes the size of the charts above it.
        """
        for _ in range(2):  # what is drawn may make other parts due
            now_ms = self.page.evaluate("() => performance.now()")
            self.until(f"[...page.dirty].every((part) => page.last[part] > {now_ms})")
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        self.until(
            "bode.charts.every(({root: {parentElement: host}, width, height}) =>"
            " !host.clientWidth || (width === host.clientWidth && height === host.clientHeight))"
        )

    def js(self, expression: str) -> Any:
        """The value of JavaScript; NaN and undefined come as null."""
        return self.page.evaluate(f"() => {{ with (window.livebode || {{}}) return ({expression}); }}")

    def numbers(self, expression: str) -> np.ndarray:
        """An array of numbers; NaN for what is none."""
        text = f"Array.from({expression}, (v) => Number.isFinite(v) ? v : null)"
        return np.array([np.nan if v is None else v for v in self.js(text)], dtype=float)

    def _looked(self, request: Any) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in ("blob", "data") and parts.hostname not in ("127.0.0.1", "localhost"):
            self.wrong.append(f"a request went to {request.url}")


def until(true: Callable[[], bool], what: str, patience_s: float = PATIENCE_S) -> None:
    """Wait for something in this process."""
    end = time.monotonic() + patience_s
    while not true():
        assert time.monotonic() < end, f"waited in vain for {what}"
        threading.Event().wait(0.01)
