"""A headless Chromium, as the browser of a person."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def chromium(*switches: str) -> Iterator[Any]:
    """Start Debian's, or any `chromium` that is found."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=[*switches, *["--no-sandbox"] * (os.geteuid() == 0)]
        )
        yield browser
        browser.close()
