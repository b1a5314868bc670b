# SPDX-License-Identifier: LGPL-2.1-or-later
"""The HTML report of masses in a real browser: the view turns, tables sort, nothing is loaded or run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect
from server_testing import wait_until
from settled import box_of, measured, picture_of

pytest.importorskip("OCP.BRep", exc_type=ImportError)

from silo.cli.main import main
from silo.inertia.links.link_map import read_link_map

ARM = Path(__file__).parents[2] / "examples" / "arm"


@pytest.fixture(name="report", scope="module")
def _report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example's report, with a part and a material that try to be markup."""
    folder = tmp_path_factory.mktemp("report")
    bom = (
        (ARM / "bom.csv").read_text("utf-8").replace("Threadlocker", "<img src=x onerror=alert(1)></script>")
    )
    (folder / "bom.csv").write_text(bom, "utf-8")
    assert (
        main(
            [
                "inertia",
                f"{ARM / 'arm.step'}",
                "--bom",
                f"{folder / 'bom.csv'}",
                "--report",
                f"{folder}/r.html",
            ]
        )
        == 0
    )
    return folder / "r.html"


@pytest.fixture(name="opened")
def _opened(chromium: Browser, report: Path) -> Iterator[Callable[..., Page]]:
    """``opened(webgl)``: the page, of nobody else's; requests and errors are in ``page.said``."""
    pages: list[Any] = []

    def opened(webgl: bool = True) -> Page:
        pages.append(page := chromium.new_page(viewport={"width": 1300, "height": 900}))
        if not webgl:
            page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
        page.set_default_timeout(90_000)
        page.said = []
        page.on("request", lambda request: page.said.append(request.url))
        page.on("pageerror", lambda error: page.said.append(str(error)))
        page.on("dialog", lambda dialog: page.said.append(dialog.message))
        page.goto(report.as_uri())
        return page

    yield opened
    for page in pages:
        page.close()


def seen(page: Page, other_than: bytes = b"") -> bytes:
    """The view, once it looks otherwise: it is drawn again a moment after it was asked to."""
    canvas = page.locator("#view canvas")
    wait_until(lambda: picture_of(canvas) != other_than, "another picture")
    return picture_of(canvas)


def test_the_view_turns_and_hides_links(opened: Callable[..., Page]) -> None:
    """Dragging turns it, a box hides a link, a click names the part; the page asks for nothing."""
    page: Any = opened()
    page.wait_for_selector("body[data-ready='35']")
    first = seen(page)
    expect(page.locator("#view .tools").get_by_text("at", exact=True)).to_be_hidden()  # no section
    box = box_of(page.locator("#view canvas"))
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.8
    page.mouse.click(x, y)
    expect(page.locator("#view .said")).to_contain_text("base_link: ")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 150, y + 20, steps=3)
    page.mouse.up()
    turned = seen(page, other_than=first)
    page.locator("#side").get_by_label("Show upper_arm").uncheck()
    hidden = seen(page, other_than=turned)
    page.get_by_role("button", name="See through").click()
    seen(page, other_than=hidden)
    page.set_viewport_size({"width": 390, "height": 800})
    assert box_of(page.locator("#view"))["width"] < 390  # the stage would cut off the rest
    assert [word for word in page.said if not word.startswith("file:") or not word.endswith("r.html")] == []


def test_the_page_begins_with_the_sum(opened: Callable[..., Page]) -> None:
    """BOM total, counted and what is missing stand above all else, and a name in it is text."""
    page = opened()
    line = page.locator("#sum")
    expect(line).to_contain_text("BOM total")
    expect(line).to_contain_text("counted")
    assert box_of(line)["y"] < box_of(page.locator("#view"))["y"]


def test_clicks_give_parts_to_links_and_save_the_map(opened: Callable[..., Page], tmp_path: Path) -> None:
    """A new link, a part clicked into it, one chosen in the table, two links made one; the map reads back."""
    page: Any = opened()
    page.wait_for_selector("body[data-ready='35']")
    page.get_by_role("button", name="New link").click()
    page.locator(".draft input[type=text]").last.fill("to: “ol”")
    page.locator(".draft input[type=text]").last.press("Tab")
    canvas = page.locator("#view canvas")
    canvas.click(position={"x": box_of(canvas)["width"] / 2, "y": box_of(canvas)["height"] * 0.8})
    expect(page.locator("#view .said")).to_contain_text("to: “ol”: base_link/")
    clicked = page.locator("#view .said").inner_text().partition("”: ")[2]
    page.get_by_label("Link of Finger").select_option("to: “ol”")
    page.get_by_label("Filter parts").fill("to: ol")
    page.get_by_label("Filter parts").fill("to: “ol”")
    expect(page.locator("#shown")).to_have_text("2 of 19 lines")
    page.locator(".draft input[type=text]").nth(2).fill("upper_arm")
    page.get_by_label("Clicks go to base_link").click()  # it ends the typing, and is a click as well
    expect(page.get_by_label("Clicks go to base_link")).to_be_checked()
    expect(page.locator(".draft:visible")).to_have_count(4)
    made = saved(page, tmp_path)
    assert made["upper_arm"] == ("path:upper_arm", "path:forearm")
    assert made["to: “ol”"] == (f"path:{clicked}", "path:gripper/finger left", "path:gripper/finger right")
    assert sorted(made) == ["base_link", "gripper", "to: “ol”", "upper_arm"]
    assert [word for word in page.said if not word.startswith(("file:", "blob:"))] == []


def test_a_click_with_shift_gives_a_whole_link_and_undo_takes_it_back(
    opened: Callable[..., Page], tmp_path: Path
) -> None:
    """The link that was clicked leaves the list and the map; each undo takes one step back, names too."""
    page: Any = opened()
    page.wait_for_selector("body[data-ready='35']")
    first = saved(page, tmp_path)
    undo = page.get_by_role("button", name="Undo")
    expect(undo).to_be_disabled()
    lines = page.locator(".draft:visible")
    page.get_by_label("Clicks go to gripper").check()
    canvas = page.locator("#view canvas")
    place = {"x": box_of(canvas)["width"] / 2, "y": box_of(canvas)["height"] * 0.8}
    before = seen(page)
    canvas.click(position=place, modifiers=["Shift"])
    expect(page.locator("#view .said")).to_contain_text("gripper: ")
    seen(page, other_than=before)
    expect(lines).to_have_count(3)
    assert set(saved(page, tmp_path)["gripper"]) == set(first["gripper"] + first["base_link"])
    page.locator(".draft:visible input[type=text]").first.fill("gripper")
    page.locator(".draft:visible input[type=text]").first.press("Enter")
    expect(lines).to_have_count(2)
    assert sorted(saved(page, tmp_path)) == ["forearm", "gripper"]
    undo.click()
    expect(lines).to_have_count(3)
    undo.click()
    expect(lines).to_have_count(4)
    expect(undo).to_be_disabled()
    assert saved(page, tmp_path) == first


def saved(page: Page, folder: Path) -> dict[str, tuple[str, ...]]:
    """Link → patterns of the map that the page saves."""
    with page.expect_download() as download:
        page.get_by_role("button", name="Save map.yaml").click()
    download.value.save_as(folder / "map.yaml")
    return {link.name: link.patterns for link in read_link_map(folder / "map.yaml").links}


def test_tables_sort_and_filter_and_names_are_text(opened: Callable[..., Page]) -> None:
    """Numbers as numbers; without WebGL the tables are there; dark where wanted, never wider than a phone."""
    page: Any = opened(webgl=False)
    expect(page.locator("#view")).to_contain_text("shows no 3D (WebGL)")
    assert page.locator("#view canvas").count() == 0
    rows = page.locator("#parts tbody tr")
    page.get_by_role("button", name="Total kg").click()
    values = [float(text) for text in rows.locator("td:nth-child(6)").all_inner_texts()]
    assert values == sorted(values)
    page.get_by_role("button", name="Total kg").click()
    values = [float(text) for text in rows.locator("td:nth-child(6)").all_inner_texts()]
    assert values == sorted(values, reverse=True)
    page.get_by_label("Filter parts").fill("gripper tpu")
    expect(page.locator("#shown")).to_have_text("1 of 19 lines")
    expect(page.locator("#parts tbody tr:visible")).to_contain_text("Finger")
    page.locator("summary", has_text="row unused").click()
    expect(page.locator("#warnings")).to_contain_text("<img src=x onerror=alert(1)></script>")
    assert page.locator("#warnings img").count() == 0
    colours = "(({color, backgroundColor}) => [color, backgroundColor])(getComputedStyle(document.body))"
    light = measured(page, colours)
    page.emulate_media(color_scheme="dark")
    assert measured(page, colours) == ["rgb(230, 237, 243)", "rgb(18, 22, 27)"] != light
    page.set_viewport_size({"width": 390, "height": 800})
    assert measured(page, "document.documentElement.scrollWidth") == 390
    assert [word for word in page.said if not word.endswith("r.html")] == []
