# SPDX-License-Identifier: LGPL-2.1-or-later
"""Released revisions: what is frozen stays as it is, who may approve, what blocks, what a change says."""

from __future__ import annotations

from urllib.parse import quote

import pytest
from hunting import BOTH
from model_file import model_file
from server_testing import Api, another_user, bom


def releases(part_number: str, rest: str = "") -> str:
    """The address of an item's revisions."""
    return f"/api/items/{quote(part_number)}/releases{rest}"


@pytest.fixture(name="boss")
def _boss(api: Api) -> Api:
    """A viewer with the right to approve."""
    return another_user(api, role="viewer", approver=True)


@pytest.fixture(name="product")
def _product(api: Api) -> tuple[str, str, str]:
    """A gearbox: top, sub-assembly, bought screw; all files are there."""
    top, sub = api.items(2, item_type="assembly")
    screw = api.item(sourcing_type="purchased", properties={"mass_kg": 0.004, "standard_cost": 0.25})
    api.merge(sub, {screw: 4})
    api.merge(top, {sub: 2, screw: 1})
    api.upload(top)
    api.upload(sub)
    return top, sub, screw


@BOTH
def test_the_life_of_a_revision(api: Api, boss: Api, product: tuple[str, str, str]) -> None:
    """Draft, in review, released, obsolete; each state is seen, and who made it."""
    top = product[0]
    assert api.get(releases(top)) == {"draft": "A", "releases": []}
    made = api.good("POST", releases(top), {"comment": "first", "with_parts": True})
    assert (made["label"], made["status"], made["blocks"]) == ("A", "review", [])
    assert "in review" in api.bad(409, "POST", releases(top), {})["message"]
    done = boss.good("POST", releases(top, "/A/approval"), {"comment": "fine"})
    assert (done["status"], [one["comment"] for one in done["approvals"]]) == ("released", ["fine"])
    assert api.get(releases(top))["draft"] == "B"
    api.good("POST", releases(top), {"with_parts": True})
    boss.good("POST", releases(top, "/B/approval"), {})
    assert [one["status"] for one in api.get(releases(top))["releases"]] == ["released", "obsolete"]
    boss.good("POST", releases(top, "/B/end"), {"status": "obsolete", "note": "recalled"})
    assert api.get(releases(top, "/B"))["note"] == "recalled"
    assert "not in review" in boss.bad(409, "POST", releases(top, "/B/approval"), {})["message"]


@BOTH
def test_what_is_frozen_stays_as_it_is(api: Api, boss: Api, product: tuple[str, str, str]) -> None:
    """Every level, with quantities, data and files; whatever happens to the items and their BOMs later."""
    top, sub, screw = product
    api.good("POST", releases(top), {"with_parts": True})
    boss.good("POST", releases(top, "/A/approval"), {})
    exports = [
        f"export.{end}?view={view}&release=A" for end in ("csv", "json") for view in ("flat", "indented")
    ]
    before = [api.call("GET", bom(top, one)).body for one in exports]
    whole = api.get(releases(top, "/A"))
    assert b"0.036" in before[0], before[0]  # 9 screws of 4 g
    api.merge(sub, {screw: 7, api.item(): 1})
    api.good("PUT", f"/api/items/{screw}", {"name": "another"})
    api.good("PATCH", f"/api/items/{screw}/properties", {"mass_kg": 9})
    api.upload(sub, model_file(b"newer"))
    api.good("DELETE", f"/api/items/{screw}")
    assert [api.call("GET", bom(top, one)).body for one in exports] == before
    assert api.get(releases(top, "/A")) == whole
    assert {one["revision"] for one in whole["files"]} == {1}


def test_only_the_right_to_approve_approves(api: Api, boss: Api, product: tuple[str, str, str]) -> None:
    """Neither the role of an admin nor a token that only reads; a withdrawal is an editor's."""
    top = product[0]
    editor = another_user(api)
    editor.good("POST", releases(top), {"with_parts": True})
    for other in (api, editor):
        assert "may not approve" in other.bad(403, "POST", releases(top, "/A/approval"), {})["message"]
        other.bad(403, "POST", releases(top, "/A/end"), {"status": "rejected"})
    reader = boss.as_(boss.good("POST", "/api/auth/tokens", {"name": "r", "scopes": ["read"]})["token"])
    assert "scope read" in reader.bad(403, "POST", releases(top, "/A/approval"), {})["message"]
    boss.bad(403, "POST", releases(top, "/A/end"), {"status": "withdrawn"})
    boss.bad(403, "POST", releases(top), {})
    editor.good("POST", releases(top, "/A/end"), {"status": "withdrawn", "note": "a mistake"})
    editor.good("POST", releases(top), {"with_parts": True})
    refused = boss.good("POST", releases(top, "/A/end"), {"status": "rejected", "note": "too heavy"})
    assert (refused["status"], refused["note"]) == ("rejected", "too heavy")
    assert [one["status"] for one in api.get(releases(top))["releases"]] == ["rejected", "withdrawn"]


def test_what_is_open_blocks(api: Api, boss: Api, product: tuple[str, str, str]) -> None:
    """Questions on any level, a missing file, a part that is not released; a reason overrides them."""
    top, sub, screw = product
    bracket = api.item()
    api.merge(sub, {screw: 4, bracket: 1})
    api.merge(sub, {bracket: 1})
    made = api.good("POST", releases(top), {})
    assert sorted(made["blocks"]) == sorted(
        [
            f"{bracket}: no file",
            f"{sub}: 1 unreferenced line",
            f"{sub}: not released as it is in this product",
        ]
    )
    message = boss.bad(409, "POST", releases(top, "/A/approval"), {})["message"]
    assert f"{bracket}: no file" in message
    done = boss.good("POST", releases(top, "/A/approval"), {"override": "prototype"})
    assert (done["status"], done["override"]) == ("released", "prototype")


def test_a_part_is_released_before_the_product_or_with_it(
    api: Api, boss: Api, product: tuple[str, str, str]
) -> None:
    """The very state that the product holds: a part that changed after its release blocks again."""
    top, sub, screw = product
    api.good("POST", releases(sub), {})
    boss.good("POST", releases(sub, "/A/approval"), {})
    assert api.good("POST", releases(top), {})["blocks"] == []
    api.good("POST", releases(top, "/A/end"), {"status": "withdrawn"})
    api.merge(sub, {screw: 5})
    assert api.good("POST", releases(top), {})["blocks"] == [f"{sub}: not released as it is in this product"]
    api.good("POST", releases(top, "/A/end"), {"status": "withdrawn"})
    api.good("POST", releases(top), {"with_parts": True})
    boss.good("POST", releases(top, "/A/approval"), {})
    assert [(one["label"], one["status"]) for one in api.get(releases(sub))["releases"]] == [
        ("B", "released"),
        ("A", "obsolete"),
    ]


def test_a_part_in_review_by_itself_holds_up_its_product(
    api: Api, boss: Api, product: tuple[str, str, str]
) -> None:
    """The approval with parts says which part waits, and releases nothing."""
    top, sub, _ = product
    api.good("POST", releases(sub), {})
    api.good("POST", releases(top), {"with_parts": True})
    message = boss.bad(409, "POST", releases(top, "/A/approval"), {})["message"]
    assert f"revision A of {sub} is in review since" in message
    for number in (top, sub):
        assert [release["status"] for release in api.get(releases(number))["releases"]] == ["review"]
        assert api.get(releases(number, "/A"))["approvals"] == []


def test_a_sync_of_a_released_product_says_which_draft_it_begins(
    api: Api, boss: Api, product: tuple[str, str, str]
) -> None:
    """And nothing of it before the first release."""
    top, sub, screw = product
    assert "draft" not in api.merge(top, {sub: 2})
    assert "draft" not in api.upload(top, model_file(b"1"))
    api.good("POST", releases(top), {"with_parts": True})
    boss.good("POST", releases(top, "/A/approval"), {"override": "one line is gone"})
    assert api.merge(top, {sub: 3, screw: 1})["draft"] == {"label": "B", "released": "A"}
    assert api.upload(top, model_file(b"2"))["draft"] == {"label": "B", "released": "A"}
    assert "draft" not in api.upload(api.item(), model_file(b"3"))


def test_labels(api: Api, boss: Api, product: tuple[str, str, str]) -> None:
    """A label of a person is taken once, in whatever case; a message names those that there are."""
    top = product[0]
    for label in ("a b", "-x", "x" * 17, "ä", "3", "1e3"):
        assert "label: wanted" in api.bad(400, "POST", releases(top), {"label": label})["message"]
    api.good("POST", releases(top), {"label": "P1", "with_parts": True})
    boss.good("POST", releases(top, "/P1/approval"), {})
    assert "has a revision p1" in api.bad(409, "POST", releases(top), {"label": "p1"})["message"]
    assert api.get(releases(top))["draft"] == "A"
    assert "there is P1" in api.bad(404, "GET", releases(top, "/Q"))["message"]
    api.bad(404, "GET", bom(top, "export.csv?release=Q"))
    assert "frozen revisions, got 'Q'" in api.bad(404, "GET", bom(top, "changes?from=P1&to=Q"))["message"]
    api.bad(400, "GET", bom(top, "changes.csv?from=P1&to=yesterday+noon"))
