"""axe-core in the pages of a test."""

from __future__ import annotations

import os
from pathlib import Path

from playwright.sync_api import Browser

from tests.support.browser import Tab

AXE = Path(__file__).parents[2] / "node_modules/axe-core/axe.min.js"
TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
# What of the rules depends on the colours or the size of the screen.
SIZES = ["target-size", "scrollable-region-focusable", "color-contrast"]
CHECK = """async ([within, only]) => {
  const what = only ? { type: 'rule', values: only } : { type: 'tag', values: TAGS };
  const found = await axe.run(within, { runOnly: what, resultTypes: ['violations'] });
  return found.violations.flatMap(({ id, nodes }) => nodes.map((node) =>
    `${id}: ${node.html.slice(0, 150)} ${(node.any[0] ?? node.all[0] ?? node.none[0])?.message}`));
}""".replace("TAGS", str(TAGS))


def with_axe(browser: Browser) -> Tab:
    """A tab whose pages all have axe-core; to send it to each of them would cost more than to run it."""
    tab = Tab(browser, "about:blank", wait=False)
    tab.context.add_init_script(path=AXE)
    return tab


def violations(tab: Tab, what: str, within: str = "html", only: list[str] | None = None) -> list[str]:
    """Each in words; of all rules, or of those that are named."""
    if shots := os.environ.get("SHOTS"):
        tab.page.screenshot(path=f"{shots}/{what}-{'phone' if only else 'desk'}.png".replace(" ", "-"))
    return [f"{what}, {'phone' if only else 'desk'}: {one}" for one in tab.page.evaluate(CHECK, [within, only])]
