# SPDX-License-Identifier: LGPL-2.1-or-later
"""A browser's page as people see it: looked at when its style sheet, its scripts and its fonts are there.

A test may see the text of a page before its style sheet has come; whatever it measures then is wrong.
``tests/test_settled.py`` keeps the tests of the browser from measuring in any other way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, FloatRect, Locator, Page, Route

# The animations of the pages end by themselves; one that does not is stopped where it is.
_STILL = """async () => {
    await document.fonts.ready;
    for (const animation of document.getAnimations()) {
        try { animation.finish(); } catch { animation.cancel(); }
    }
}"""


def settled(page: Page) -> Page:
    """The page when all of it is loaded, laid out and still."""
    page.wait_for_load_state("load")
    page.evaluate(_STILL)
    return page


def measured(what: Page | Locator, script: str, argument: object = None) -> Any:
    """What the script finds on the settled page, or on a part of it."""
    if hasattr(what, "wait_for_load_state"):
        return settled(what).evaluate(script, argument)
    settled(what.page)
    return what.evaluate(script, argument)


def box_of(part: Locator) -> FloatRect:
    """Where the part is on the settled page."""
    settled(part.page)
    box = part.bounding_box()
    assert box is not None, "the part is not on the page"
    return box


def picture_of(part: Locator) -> bytes:
    """How the part looks on the settled page, as PNG."""
    settled(part.page)
    return part.screenshot()


def wait_for_cursor(part: Locator) -> None:
    """Wait until what a person types goes into this field."""
    field = part.element_handle()
    part.page.wait_for_function("field => field === document.activeElement", arg=field, polling=100)


def come_late(context: BrowserContext, seconds: float) -> None:
    """From now on, what pages need beside their text comes so many seconds late."""

    def wait(route: Route) -> None:
        route.request.frame.page.wait_for_timeout(seconds * 1000)
        route.continue_()

    context.route("**/static/**", wait)
