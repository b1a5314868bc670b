# SPDX-License-Identifier: LGPL-2.1-or-later
"""Part numbers as companies have them: whatever a number holds, it is kept, and found by API, client and
pages.
"""

from __future__ import annotations

import html
import re
from urllib.parse import quote, unquote

import pytest
from server_testing import Api
from web_visitor import Visitor

from silo.api.client import SiloClient
from silo.bom.items.part_address import WORDS, part_number_of, part_page, part_segment
from silo.platform.part_file_name import part_file_stem
from silo_server.run import RunningServer

NUMBERS = [
    "4711/02",
    "100%",
    "A#7",
    "/",
    "a/b/c",
    "..",
    ".",
    "a..b",
    "../x",
    "new",
    "Search",
    "import",
    "A~2F",
    "~_x",
    "A%2FB",
    "DIN 912 M8?x=1",
    "½-ROHR",
    "+49",
    "-12",
    "=SUM",
    "1,5",
    "K&M <3>",
    "a\\b",
    "x;y",
    'say "hi"',
    "it's",
    "CON",
    "x" * 64,
]
# Those whose pages are followed, link by link.
FOLLOWED = ("4711/02", "100%", "A#7", "..", "new")
LINK = re.compile(r'href="(/(?:api/)?items/[^"]+)"')


@pytest.mark.parametrize("number", [*NUMBERS, *WORDS, "~", "~~2F", "...", "%", "%25"])
def test_an_address_is_read_back(number: str) -> None:
    """A segment has no slash, is no dots, and means one number."""
    segment = part_segment(number)
    assert "/" not in segment
    assert segment.strip(".")
    assert segment.casefold() not in WORDS
    assert part_number_of(unquote(segment)) == number


def test_file_names_get_a_safe_form() -> None:
    """A name on every system, also where it would be a device."""
    stems = {part_file_stem(number) for number in NUMBERS}
    assert {"4711_02", "100%", "A#7", "a_b_c", "_CON", "_", "½-ROHR"} <= stems
    assert not any(set(stem) & set('<>:"/\\|?*') or stem != stem.strip(". ") for stem in stems)


@pytest.mark.parametrize("number", NUMBERS)
def test_a_number_is_data(number: str, api: Api, server: RunningServer, visitors: dict[str, Visitor]) -> None:
    """Made, read, put into a BOM, exported and shown; each link of its pages leads to a page."""
    top = f"top {number}"[:64]
    for name in (number, top):
        assert api.good("POST", "/api/items", {"part_number": name, "name": "own"})["part_number"] == name
    with SiloClient(server.base_url, server.token) as client:
        assert client.get_item(number).part_number == number
    path, above = (f"/api/items/{part_segment(each)}" for each in (number, top))
    api.good("POST", f"{above}/bom", {"child_part_number": number, "quantity": 2})
    if number.strip(".") and number.casefold() not in WORDS and "~" not in number:
        assert api.get(f"/api/items/{quote(number, safe='')}")["part_number"] == number
    assert [use["parent_part_number"] for use in api.get(f"{path}/bom/where-used")] == [top]
    assert api.good("PUT", f"{above}/bom/{part_segment(number)}", {"quantity": 3})["quantity"] == 3
    sent = api.call("GET", f"{above}/bom/export.csv")
    assert sent.status == 200
    assert "/" not in sent.headers["content-disposition"]
    if re.search(r"\w", number):
        found = api.get(f"/api/items/search?q={quote(number, safe='')}&limit=100")
        assert number in [item["part_number"] for item in found]
    if number not in FOLLOWED:
        return
    visitor, seen = visitors["editor"], set()
    for page in (part_page(number), part_page(top), part_page(top, "bom"), part_page(top, "order")):
        shown = visitor.get(page)
        assert shown.status == 200, page
        seen |= {html.unescape(link).partition("#")[0] for link in LINK.findall(shown.body.decode())}
    assert part_page(number) in {link.partition("?")[0] for link in seen}
    for link in sorted(seen):
        assert visitor.get(link).status == 200, link
