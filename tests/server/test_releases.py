# SPDX-License-Identifier: LGPL-2.1-or-later
"""A release never changes under random later operations; the pages that submit, approve and show it."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest
from hunting import over
from model_file import model_file
from server_testing import Api, bom, form_body
from web_visitor import Visitor, visitors_of

from silo.bom.errors import ConfigError
from silo_server.run import running_server
from silo_server.services import releases
from silo_server.settings import Settings

TOKEN = "silo_release"
# The whole law takes an hour; a sample runs with the tests.
OPERATIONS = int(os.environ.get("SILO_RELEASE_OPERATIONS", "100"))
VIEWS = [
    f"export.{end}?view={view}&release=A"
    for end in ("csv", "json")
    for view in ("single", "flat", "indented")
]


def put_file(api: Api, item: str, content: bytes) -> None:
    """Upload a file as a new revision of an item."""
    body, headers = form_body({"file": (f"{item}.FCStd", model_file(content))})
    api.good("POST", f"/api/items/{item}/file", body=body, headers=headers)


def product(api: Api) -> tuple[str, list[str]]:
    """Three levels with shared parts, all with files; returns the top and all items."""
    top, left, right = api.items(3, item_type="assembly")
    parts = [api.item(properties={"mass_kg": 0.5 * n, "standard_cost": n}) for n in range(1, 5)]
    api.merge(left, {parts[0]: 2, parts[1]: 3})
    api.merge(right, {left: 2, parts[2]: 1})
    api.merge(top, {left: 1, right: 2, parts[3]: 12})
    for item in (top, left, right, *parts):
        put_file(api, item, item.encode())
    return top, [top, left, right, *parts]


def release(api: Api, top: str) -> None:
    """Release a product as it is now."""
    api.good("PUT", "/api/users/admin", {"approver": True})
    api.good("POST", f"/api/items/{top}/releases", {"with_parts": True})
    api.good("POST", f"/api/items/{top}/releases/A/approval", {})


def as_frozen(api: Api, top: str) -> list[bytes]:
    """Everything that the server says of revision A."""
    told = api.get(f"/api/items/{top}/releases/A")
    exports = [api.call("GET", bom(top, view)) for view in VIEWS]
    assert {one.status for one in exports} == {200}
    files = [
        api.call("GET", f"/api/documents/{one['document']}/file/{one['revision']}").body
        for one in told["files"]
    ]
    # Which state the release is in is no part of what is frozen.
    frozen = {name: told[name] for name in ("record", "revision", "files", "label", "frozen_at", "comment")}
    return [repr(frozen).encode(), *(one.body.replace(b"obsolete", b"released") for one in exports), *files]


def change_something(api: Api, chance: random.Random, items: list[str]) -> None:
    """One operation that people and programs do every day, on a random item of the product."""
    item, other = chance.sample(items, 2)
    kind = chance.randrange(8)
    if kind == 0:
        api.call("POST", bom(item, "merge"), {"entries": [{"child_part_number": other, "quantity": 3}]})
    elif kind == 1:
        api.call("POST", bom(item), {"child_part_number": other, "quantity": chance.randint(1, 9)})
    elif kind == 2:
        api.call("PUT", bom(item, other), {"quantity": chance.randint(1, 99), "notes": "later"})
    elif kind == 3:
        api.call("DELETE", bom(item, other))
    elif kind == 4:
        api.call("PATCH", f"/api/items/{item}/properties", {"mass_kg": chance.random()})
    elif kind == 5:
        api.call("PUT", f"/api/items/{item}", {"name": f"name {chance.random()}"})
    elif kind == 6:
        put_file(api, item, str(chance.random()).encode())
    else:
        made = api.call("POST", f"/api/items/{item}/releases", {"with_parts": True})
        label = made.json().get("label")
        end = chance.choice([("approval", {"override": "a trial"}), ("end", {"status": "withdrawn"})])
        api.call("POST", f"/api/items/{item}/releases/{label}/{end[0]}", end[1])


@over("sqlite")
def test_a_release_never_changes(url: str, tmp_path: Path) -> None:
    """Whatever is done later to anything in it, its data, its exports and its files are the same bytes."""
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        top, items = product(api)
        release(api, top)
        before, chance, at_first = as_frozen(api, top), random.Random(7), api.get(bom(top, "flat"))
        for number in range(OPERATIONS):
            change_something(api, chance, items)
            if number % 50 == 25:
                assert as_frozen(api, top) == before
        assert as_frozen(api, top) == before
        assert api.get(bom(top, "flat")) != at_first


def test_labels_of_a_scheme() -> None:
    """Letters without I and O, then two of them; numbers; what a person chose is no obstacle."""
    letters = "ABCDEFGHJKLMNPQRSTUVWXYZ"
    assert [releases.next_label(list(letters[:count]), "letters") for count in range(25)] == [*letters, "AA"]
    last = {"AA": "AB", "AH": "AJ", "AN": "AP", "AZ": "BA", "YZ": "ZA", "ZY": "ZZ"}
    assert {label: releases.next_label([*letters, label], "letters") for label in last} == last
    assert releases.next_label(["1.0", "2.0", "P1"], "numbers") == "3.0"
    assert releases.next_label(["P1"], "letters") == "A"
    assert releases.next_label(["C"], "letters") == "D"


@pytest.mark.parametrize("wrong", [{"release_labels": "roman"}, {"release_approvals": 0}])
def test_settings_that_cannot_be(wrong: dict[str, object]) -> None:
    """The message names them."""
    with pytest.raises(ConfigError, match="release"):
        Settings(database_url="sqlite:///x.db", **wrong)  # type: ignore[arg-type]


@over("sqlite")
def test_two_people_approve_where_the_site_asks_for_two(url: str, tmp_path: Path) -> None:
    """One person's second approval does not count; without an override nothing that is blocked goes out."""
    strict = Settings(database_url=url, files_dir=tmp_path, release_approvals=2, release_override=False)
    with running_server(url, token=TOKEN, settings=strict) as server, Api(server.base_url, TOKEN) as api:
        top, items = product(api)
        visitors = visitors_of(api)
        for name in ("viewer", "admin"):
            api.good("PUT", f"/api/users/{name}", {"approver": True})
        path = f"/items/{top}/releases"
        assert visitors["editor"].post(path, comment="series", with_parts="yes").status == 303
        assert visitors["viewer"].post(f"{path}/A/approval", approval="fine").status == 303
        again = visitors["viewer"].post(f"{path}/A/approval", approval="fine")
        assert again.status == 409
        assert "1 of 2 approvals are given" in again.body.decode()
        assert api.get(f"/api{path}/A")["status"] == "review"
        assert visitors["admin"].post(f"{path}/A/approval").status == 303
        assert [one["username"] for one in api.get(f"/api{path}/A")["approvals"]] == ["viewer", "admin"]
        assert api.get(f"/api{path}/A")["status"] == "released"
        api.merge(top, {items[1]: 1})
        assert visitors["editor"].post(path).status == 303
        refused = visitors["admin"].post(f"{path}/B/approval", override="because")
        assert refused.status == 403
        assert "releases nothing that is blocked" in refused.body.decode()


def page_of(visitor: Visitor, path: str) -> str:
    """The text of a page that must be there."""
    answer = visitor.get(path)
    assert answer.status == 200, answer.body[:300]
    return answer.body.decode()


@over("sqlite")
def test_the_pages_of_a_release(url: str, tmp_path: Path) -> None:
    """Draft, review with what blocks, the frozen tree and flat list, and the head of the product."""
    with (
        running_server(url, token=TOKEN, files_dir=tmp_path) as server,
        Api(server.base_url, TOKEN) as api,
    ):
        top, items = product(api)
        visitors = visitors_of(api)
        editor, viewer = visitors["editor"], visitors["viewer"]
        path = f"/items/{top}/releases"
        assert "Draft <bdi>A</bdi>" in page_of(editor, path)
        assert "Submit for review" not in page_of(viewer, path)
        assert editor.post(path, comment="<b>series").status == 303
        shown = page_of(viewer, path)
        assert "in review" in shown
        assert "&lt;b&gt;series" in shown
        assert f"{items[1]}: not released as it is in this product" in shown.replace("<bdi>", "")
        assert "You do not have that right" in shown
        assert viewer.post(f"{path}/A/approval").status == 403
        assert viewer.post(f"{path}/A/end", status="withdrawn").status == 403
        assert editor.post(f"{path}/A/end", status="gone").status == 400
        api.good("PUT", "/api/users/viewer", {"approver": True})
        assert "Release it anyway" in page_of(viewer, path)
        assert viewer.post(f"{path}/A/approval", override="a trial").status == 303
        assert "revision <bdi>A</bdi> released" in page_of(viewer, f"/items/{top}")
        api.merge(items[1], {items[3]: 5})
        assert "changed since" in page_of(viewer, f"/items/{top}")
        tree, flat = page_of(viewer, f"{path}/A"), page_of(viewer, f"{path}/A?view=flat")
        assert tree.count("<tr>") == 1 + 3 + 2 + 2 + 2
        assert flat.count("<tr>") == 1 + 4
        assert "a trial" in tree
        assert viewer.post(f"{path}/A/end", status="obsolete").status == 303
        assert "obsolete" in page_of(viewer, path)
        assert viewer.get(f"{path}/Q").status == 404


@over("sqlite")
def test_a_site_that_wants_drawings_releases_nothing_without(url: str, tmp_path: Path) -> None:
    """Of its own parts only; a bought part comes with whatever its supplier sends."""
    wants = Settings(database_url=url, files_dir=tmp_path, release_wants="drawing, step")
    with running_server(url, token=TOKEN, settings=wants) as server, Api(server.base_url, TOKEN) as api:
        own, bought = api.item(sourcing_type="manufactured"), api.item(sourcing_type="purchased")
        top = api.item(item_type="assembly", sourcing_type="manufactured")
        api.merge(top, {own: 1, bought: 4})
        for item in (top, own):
            put_file(api, item, item.encode())
            body, headers = form_body({"file": ("a.pdf", b"%PDF-1.7 drawing")})
            api.good("POST", f"/api/items/{item}/files", body=body, headers=headers)
        api.good("POST", f"/api/items/{top}/releases", {})
        (told,) = api.get(f"/api/items/{top}/releases")["releases"]
        lacking = sorted(line for line in told["blocks"] if "STEP" in line or "drawing" in line)
        assert lacking == sorted(f"{item}: no STEP file" for item in (top, own))


def test_a_kind_that_the_site_cannot_want(tmp_path: Path) -> None:
    """A wrong word would want nothing, and each release would go out."""
    with pytest.raises(ConfigError, match="drawings"):
        Settings(database_url=f"sqlite:///{tmp_path}/x.db", release_wants="drawings")
