# SPDX-License-Identifier: LGPL-2.1-or-later
"""The model on the pages, in software WebGL: rows and bodies light each other, colours say what differs."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from model_scenes import library, machine
from PIL import Image
from playwright.sync_api import Locator, Page, expect
from server_testing import Api, wait_until
from settled import box_of, measured, picture_of

from silo_server.run import RunningServer

Visit = Callable[..., Page]
GREEN, RED, AMBER, VIOLET = 140, 5, 38, 255


@pytest.fixture(scope="module")
def top(server: RunningServer) -> Iterator[str]:
    """The machine of the story; the tests only look at it."""
    with Api(server.base_url, server.token) as api:
        yield machine(api, "M1")


def amount(picture: bytes, hue: int, left: float = 0, right: float = 1, least: int = 100) -> int:
    """How many pixels of a part of a picture have a strong colour of this hue [°]."""
    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("HSV")).astype(int)
    width = pixels.shape[1]
    colour, strong, bright = np.moveaxis(pixels[:, int(left * width) : int(right * width)], 2, 0)
    near = abs((colour * 360 / 255 - hue + 180) % 360 - 180) < 15
    return int((near & (strong > least) & (bright > 60)).sum())


def has(picture: bytes, hue: int, left: float = 0, right: float = 1, least: int = 100) -> bool:
    """Is there enough of a colour to be seen?"""
    return amount(picture, hue, left, right, least) > 40


def opened(page: Page, path: str) -> Locator:
    """The model on a page, drawn in full."""
    page.goto(path)
    model = page.locator("#model[data-ready]")
    model.wait_for()
    return model


def still(canvas: Locator, other_than: bytes = b"") -> bytes:
    """The picture, once it is another and drawn in full: two in a row are the same."""
    seen = [other_than, b""]

    def is_still() -> bool:
        seen.append(picture_of(canvas))
        in_full = measured(canvas, "canvas => canvas.parentElement.dataset.drawn") == "in full"
        return in_full and seen[-1] == seen[-2] != other_than

    wait_until(is_still, "another picture that stays")
    return seen[-1]


def test_rows_and_bodies_light_each_other(visit: Visit, top: str) -> None:
    """A row's button lights its bodies, by keyboard too; a click on a body lights its row; keys hide it."""
    page = visit("viewer")
    model = opened(page, f"/items/{top}")
    canvas, said = model.locator("canvas"), model.locator(".said")
    plain = still(canvas)
    bolts = page.get_by_role("button", name="Show M1-BOLT in the model")
    bolts.focus()
    page.keyboard.press("Enter")
    expect(bolts).to_have_attribute("aria-pressed", "true")
    expect(said).to_have_text("M1-BOLT Bolt: 6 in the model")
    lit = still(canvas, plain)
    assert has(lit, 215)
    assert not has(plain, 215)
    box = box_of(canvas)
    canvas.click(position={"x": box["width"] / 2, "y": box["height"] * 0.75})
    expect(said).to_contain_text("M1-PLATE Plate")
    expect(page.locator("tr.lit")).to_contain_text("M1-PLATE")
    expect(bolts).to_have_attribute("aria-pressed", "false")
    canvas.focus()
    with_plate = still(canvas)
    page.keyboard.press("h")
    expect(page.locator("tr.lit")).to_have_count(0)
    without = still(canvas, with_plate)
    page.keyboard.press("a")
    page.keyboard.press("ArrowLeft")
    still(canvas, without)
    # A closed branch stands for what is in it.
    page.goto(f"/items/{top}?depth=1")
    page.get_by_role("button", name="Show M1-GEARBOX in the model").click()
    expect(said).to_have_text("M1-GEARBOX: 2 in the model")


def test_what_is_lit_is_in_the_first_picture(visit: Visit, top: str) -> None:
    """However small a lit body is and however little can be drawn in time; all others follow."""
    page = visit("viewer")
    model = opened(page, f"/items/{top}")
    still(model.locator("canvas"))
    measured(page, "() => (Viewer.SETTLED = Viewer.SMALL = 1e6)")
    page.get_by_role("button", name="Show M1-BOLT in the model").click()
    model.locator("[data-drawn='in part']").wait_for()
    wait_until(
        lambda: has(picture_of(model.locator("canvas")), 215), "lit bolts, though all others are too small"
    )


def test_colours_say_what_the_bom_says(visit: Visit, top: str) -> None:
    """By state, supplier and mass; a colour's button lights its bodies."""
    page = visit("viewer")
    model = opened(page, f"/items/{top}")
    colours = model.get_by_role("combobox", name="Colours")
    colours.select_option("by state")
    expect(model.get_by_role("button", name="question open (6)")).to_be_visible()
    colours.select_option("by supplier")
    expect(model.get_by_role("button", name="no supplier (10)")).to_be_visible()
    colours.select_option("by mass")
    model.get_by_role("button", name="mass unknown (10)").click()
    expect(page.locator("tr.lit")).not_to_have_count(0)
    colours.select_option("as in CAD")
    expect(model.get_by_role("button", name="mass unknown (10)")).to_have_count(0)


def test_a_decision_shows_each_kind_of_change(visit: Visit, top: str) -> None:
    """Added, removed as a ghost, changed and moved have their colours; the camera goes to each question."""
    page = visit("viewer")
    model = opened(page, f"/items/{top}/bom")
    canvas, said = model.locator("canvas"), model.locator(".said")
    legend = model.get_by_role("group", name="Legend")
    expect(legend.get_by_role("button")).to_have_text(
        ["added (1)", "removed (1)", "quantity changed (6)", "moved (1)"]
    )
    first = still(canvas)
    assert [one for one in (GREEN, RED, AMBER, VIOLET) if not has(first, one)] == []
    assert not has(first, RED, least=170)  # a ghost
    legend.get_by_role("button", name="removed (1)").click()
    far = still(canvas, first)
    page.get_by_role("button", name="Next ›").click()
    expect(said).to_have_text("1 of 2: M1-COVER Cover: CAD no longer uses it")
    wait_until(lambda: amount(picture_of(canvas), RED) > 1.5 * amount(far, RED), "the camera near the cover")
    near = still(canvas)
    canvas.focus()
    page.keyboard.press("n")
    expect(said).to_have_text("2 of 2: M1-BOLT Bolt: 9 in Silo, 6 in CAD")
    still(canvas, near)
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Old beside new").click()
    wait_until(lambda: has(picture_of(canvas), RED, 0, 0.5), "the cover on the left")
    both = still(canvas)
    assert has(both, RED, 0, 0.5, least=170)
    assert not has(both, RED, 0.5, 1)
    assert has(both, GREEN, 0.5, 1)
    assert not has(both, GREEN, 0, 0.5)
    opened(page, f"/items/{top}/compare?all=1")
    expect(legend.get_by_role("button")).to_have_text(
        ["added (1)", "removed (1)", "quantity changed (6)", "moved (1)"]
    )
    # The step of a changed quantity lights those that came, so not the whole row.
    while "quantity changed" not in said.inner_text():
        page.get_by_role("button", name="Next ›").click()
    expect(said).to_contain_text("M1-BOLT Bolt: 3 before, 6 now")
    expect(page.get_by_role("button", name="Show M1-BOLT in the model")).to_have_attribute(
        "aria-pressed", "false"
    )
    page.goto(f"/items/{top}/changes?since=r1")
    expect(legend.get_by_role("button", name="added (1)")).to_be_visible()


def test_what_waits_leads_to_its_question_in_the_model(visit: Visit, api: Api, top: str) -> None:
    """The model opens with the camera on the first question; a BOM without a model has no way to it."""
    bare = api.items(2)
    api.merge(bare[0], {bare[1]: 1})
    api.merge(bare[0], {})
    page = visit("viewer")
    page.goto("/waiting")
    expect(page.locator("tbody tr")).to_have_count(2)
    expect(page.get_by_role("link", name="in the model")).to_have_count(1)
    page.get_by_role("link", name=f"Show {top} in the model").click()
    model = page.locator("#model[data-ready]")
    model.wait_for()
    expect(model.locator(".said")).to_have_text("1 of 2: M1-COVER Cover: CAD no longer uses it")
    assert amount(still(model.locator("canvas")), RED) > 3000
    expect(model.locator("canvas")).to_be_in_viewport()


WHERE = {
    "SENSOR Sensor · added · Sensor": GREEN,
    "COVER Cover · removed · Cover": RED,
    "BOLT Bolt · quantity changed · Bolt": AMBER,
    "GEAR Gear · moved · Box › Gear": VIOLET,
}
PLAIN = ("PLATE Plate · Plate", "GEAR Gear · Box › Gear")
# Where a click meets which body, without a picture: [x, y, words], x and y as shares of the canvas.
PICKS = """([columns, rows]) => {
    const canvas = document.querySelector("#model canvas"), said = document.querySelector("#model .said");
    return Array.from({ length: columns * rows }, (_, n) => {
        const [x, y] = [((n % columns) + 0.5) / columns, (Math.floor(n / columns) + 0.5) / rows];
        const area = canvas.getBoundingClientRect(); // a row that is lit scrolls into sight
        const at = { clientX: area.left + x * area.width, clientY: area.top + y * area.height };
        canvas.dispatchEvent(new MouseEvent("click", at));
        return [x, y, said.textContent];
    });
}"""


def test_a_change_has_its_colour_where_its_occurrences_stand(visit: Visit, top: str) -> None:
    """Green, amber, a red ghost, a violet outline: at the places where a click meets these bodies."""
    page = visit("viewer")
    canvas = opened(page, f"/items/{top}/bom").locator("canvas")
    pixels = np.asarray(Image.open(io.BytesIO(still(canvas))).convert("HSV")).astype(int)
    height, width = pixels.shape[:2]
    met: dict[str, list[np.ndarray]] = {}
    for x, y, words in measured(page, PICKS, [90, 60]):
        name = re.sub(r"^M1-|\d$", "", words)
        met.setdefault(name, []).append(pixels[int(y * height), int(x * width)])

    def share(of: str, hue: int, least: int = 60, most: int = 255) -> float:
        """How many of the pixels where a body is have this hue [°], so strong."""
        colour, strong, _ = np.array(met[of]).T
        near = abs((colour * 360 / 255 - hue + 180) % 360 - 180) < 20
        return float((near & (least < strong) & (strong <= most)).mean())

    assert [of for of, hue in WHERE.items() if share(of, hue) < 0.6] == []
    assert share("COVER Cover · removed · Cover", RED, most=170) > 0.6, "a ghost is pale"
    assert [of for of in PLAIN if max(share(of, hue) for hue in WHERE.values()) > 0.3] == []


def test_a_part_in_a_file_of_several_shows_its_own_body(visit: Visit, api: Api) -> None:
    """Without a revision of its own, on its page and where its BOM is decided."""
    gear, cover = api.items(2)
    library(api, b"of two", {"Gear": gear, "Cover": cover})
    page = visit("viewer")
    for path in (f"/items/{gear}", f"/items/{gear}/bom"):
        assert opened(page, path).get_attribute("data-ready") == "1"


def test_items_without_a_picture_get_what_an_editor_sees(visit: Visit, api: Api) -> None:
    """The product and each part in it, in its own colours on nothing; a viewer's browser sends nothing."""
    top = machine(api, "M2")
    parts = {one: f"M2-{one}" for one in ("PLATE", "BOLT", "GEARBOX", "GEAR", "SENSOR")}
    names = {top, *parts.values()}
    opened(visit("viewer"), f"/items/{top}")
    assert not any(api.get(f"/api/items/{one}")["thumbnail_key"] for one in names)
    page = visit("editor")
    opened(page, f"/items/{top}")
    assert {*api.get(f"/api/items/{top}/scene")["without_picture"]} <= names
    wait_until(lambda: not api.get(f"/api/items/{top}/scene")["without_picture"], "all pictures")
    pictures = {one: api.call("GET", f"/api/items/{one}/thumbnail").body for one in names}
    assert {Image.open(io.BytesIO(one)).size for one in pictures.values()} == {(256, 256)}
    assert has(pictures[parts["SENSOR"]], 130, least=80)
    assert has(pictures[parts["GEAR"]], 30, least=80)
    assert not has(pictures[parts["GEAR"]], 130, least=80)
    assert has(pictures[top], 130, least=80)
    for one in pictures.values():
        clear = np.asarray(Image.open(io.BytesIO(one)))[:, :, 3]
        assert clear[0, 0] == 0
        assert 0.1 < (clear > 0).mean() < 0.9
    page.goto("/items?q=M2-")
    expect(page.locator("img.thumb")).to_have_count(6)


def test_without_webgl_or_a_model_the_page_says_so(visit: Visit, api: Api, top: str) -> None:
    """A sentence in place of the model; nothing at all where there is none."""
    page = visit("viewer")
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(f"/items/{top}")
    expect(page.locator("#model")).to_contain_text("This browser shows no 3D")
    page.goto(f"/items/{api.item()}")
    expect(page.locator("#model")).to_have_count(0)
