# SPDX-License-Identifier: LGPL-2.1-or-later
"""What people follow, who settles what is open, and the badge that says so."""

from __future__ import annotations

import re

import pytest
from server_testing import Api, bom
from web_visitor import ROLES, Visitor, newcomer

from silo_server.run import RunningServer
from silo_server.services import following
from silo_server.services.looks import keep_looks


@pytest.fixture
def visitors(api: Api) -> dict[str, Visitor]:
    """A new user per role: what others follow, and have not looked at, would count too."""
    return {role: newcomer(api, role) for role in ROLES}


def badge(visitor: Visitor) -> int:
    """The number beside *For me*."""
    page = visitor.get("/account").body.decode()
    found = re.search(r'>For me</a><span class="dot"[^>]*>([0-9]+)<', page)
    return int(found[1]) if found else 0


def follow(visitor: Visitor, **fields: str) -> None:
    """Send the form of a page."""
    assert visitor.post("/mine/follow", **fields).status == 303


def test_news_of_a_product_are_what_others_changed_since_the_look(
    api: Api, server: RunningServer, visitors: dict[str, Visitor]
) -> None:
    """On every level; a look or a click ends them; own changes are none, nor what is followed no more."""
    top, sub, part = api.items(3)
    api.merge(sub, {part: 1})
    api.merge(top, {sub: 1})
    uuid, viewer = api.get(f"/api/items/{top}")["id"], visitors["viewer"]
    follow(viewer, target=f"item:{uuid}", on="yes", back=f"/items/{top}")
    assert badge(viewer) == 0
    api.merge(sub, {part: 2})
    assert badge(viewer) == 1
    page = viewer.get("/mine").body.decode()
    assert "<strong>New</strong>" in page
    (address,) = re.findall(rf'"(/items/{top}/changes[?]since=[^"]+)"', page)
    assert f"/items/{part}" in viewer.get(address).body.decode()
    assert ">End following<" in viewer.get(f"/items/{top}").body.decode()
    keep_looks(server.app.state.server.db)
    assert badge(viewer) == 0
    api.merge(sub, {part: 3})
    assert badge(viewer) == 1
    assert viewer.post("/mine/seen").status == 303
    assert badge(viewer) == 0
    api.merge(sub, {part: 4})
    follow(viewer, target=f"item:{uuid}")
    assert badge(viewer) == 0
    editor = visitors["editor"]
    follow(editor, target=f"item:{uuid}", on="yes")
    line = api.lines(sub)[part]["id"]
    form = {"quantity": "7", "was_quantity": "4", "mark": "", "at": "0"}
    assert editor.post(f"/items/{sub}/bom/lines/{line}", **form).status == 303
    assert api.quantities(sub) == {part: 7}
    assert badge(editor) == 0


def test_news_of_a_folder_are_of_the_boms_in_it(api: Api, visitors: dict[str, Visitor]) -> None:
    """Its BOMs and those of folders in it, and no others; a name that begins like it is another folder."""
    one, inner, other, part = api.items(4)

    def sync(top: str, folder: str, quantity: int) -> None:
        entries = [{"child_part_number": part, "quantity": quantity}]
        document = {"file": "a.FCStd", "folder": folder}
        api.good("POST", bom(top, "merge"), {"entries": entries, "document": document})

    viewer = visitors["viewer"]
    name = f"robot_{one}"
    for top, folder in ((one, name), (inner, f"{name}/arm"), (other, f"{name}2")):
        sync(top, folder, 1)
    follow(viewer, folder=f"/{name}/", on="yes")
    assert badge(viewer) == 0
    sync(other, f"{name}2", 2)
    api.good("PATCH", f"/api/items/{part}/properties", {"n": 1})
    assert badge(viewer) == 0
    sync(inner, f"{name}/arm", 2)
    assert badge(viewer) == 1
    assert f">{name}<" in viewer.get("/mine").body.decode().replace("<bdi>", "").replace("</bdi>", "")
    assert viewer.post("/mine/seen").status == 303
    assert badge(viewer) == 0
    # What a person does in a folder is no news for that person.
    editor, line = visitors["editor"], api.lines(one)[part]["id"]
    follow(editor, folder=name, on="yes")
    form = {"quantity": "7", "was_quantity": "1", "mark": "", "at": "0"}
    assert editor.post(f"/items/{one}/bom/lines/{line}", **form).status == 303
    assert (badge(editor), badge(viewer)) == (0, 1)
    follow(editor, target=f"folder:{name}")
    for wrong in ({"target": "item:nothing"}, {"folder": "/"}, {"target": "planet:mars"}):
        assert viewer.post("/mine/follow", **wrong, on="yes").status == 400


def test_a_person_follows_so_much_and_no_more(
    api: Api, visitors: dict[str, Visitor], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the limit, what is followed may be followed again, which ends its news; another item is refused."""
    first, second = (f"item:{api.get(f'/api/items/{number}')['id']}" for number in api.items(2))
    admin = visitors["admin"]
    follow(admin, target=first, on="yes")
    monkeypatch.setattr(following, "MOST_FOLLOWED", 1)
    follow(admin, target=first, on="yes")
    refused = admin.post("/mine/follow", target=second, on="yes")
    assert (refused.status, b"at most 1 items" in refused.body) == (400, True)
    page = admin.get("/mine").body.decode()
    assert (first in page, second in page) == (True, False)
    follow(admin, target=first)
    follow(admin, target=second, on="yes")
    follow(admin, target=second)


def test_what_is_open_has_somebody_who_settles_it(api: Api, visitors: dict[str, Visitor]) -> None:
    """While it is open it counts for that person; only who may change BOMs can be given one."""
    top, part, gone = api.items(3)
    api.merge(top, {part: 1, gone: 1})
    editor, viewer = visitors["editor"], visitors["viewer"]
    name, reader = editor.username, viewer.username
    assert editor.post("/waiting/assign", chosen=f"{top} -", assignee=name).status == 303
    assert badge(editor) == 0
    api.merge(top, {part: 1})
    assert badge(editor) == 1
    assert f"/items/{top}/bom" in editor.get("/mine").body.decode()
    rows = editor.get(f"/waiting?who={name}&q={top}").body.decode()
    assert f"/items/{top}/bom" in rows
    assert f"/items/{top}/bom" not in editor.get(f"/waiting?who=-&q={top}").body.decode()
    assert f"<option selected>{name}</option>" in editor.get(f"/items/{top}/bom").body.decode()
    api.good("POST", "/api/users", {"username": "former", "role": "editor"})
    assert "<option>former</option>" in editor.get(f"/items/{top}/bom").body.decode()
    api.good("PUT", "/api/users/former", {"active": False})
    assert "<option>former</option>" not in editor.get(f"/items/{top}/bom").body.decode()
    for one, status in ((reader, 403), ("former", 403), ("nobody-of-this-name", 404)):
        assert editor.post("/waiting/assign", chosen=f"{top} -", assignee=one).status == status
    assert viewer.post("/waiting/assign", chosen=f"{top} -", assignee=name).status == 403
    assert badge(editor) == 1
    api.good("POST", bom(top, "resolve"), {"decisions": [{"child_part_number": gone, "action": "remove"}]})
    assert badge(editor) == 0
    assert editor.post("/waiting/assign", assignee=name).status == 400
