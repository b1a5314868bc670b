# SPDX-License-Identifier: LGPL-2.1-or-later
"""Small doors: event streams are bounded, a redirect does not believe the Host header, a stored scene holds
only what was checked.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import socket
from contextlib import ExitStack
from urllib.parse import urlsplit

import pytest
from server_testing import Api, form_body, wait_until
from web_visitor import enter

from silo_server.events.stream import MOST_STREAMS
from silo_server.run import RunningServer
from silo_server.schema import find_schema
from silo_server.services.scene import GLB, check_glb, check_structure
from silo_server.web_address import address_problem


def _stream(server: RunningServer, headers: dict[str, str]) -> socket.socket:
    parts = urlsplit(server.base_url)
    opened = socket.create_connection((parts.hostname or "", parts.port or 0), timeout=60)
    lines = [
        "GET /api/events HTTP/1.1",
        "Host: silo",
        *(f"{name}: {value}" for name, value in headers.items()),
    ]
    opened.sendall("\r\n".join([*lines, "", ""]).encode())
    return opened


def _status(opened: socket.socket) -> int:
    return int(opened.recv(4096).split()[1])


def test_the_streams_of_a_user_at_an_address_are_bounded(server: RunningServer, api: Api) -> None:
    """The next is refused with a sentence, another user's is not, and an ended one makes room."""
    ours = {"Authorization": f"Bearer {api.token}"}
    other = {"Cookie": enter(api, "admin").cookie}
    with ExitStack() as all_of_them:
        streams = [all_of_them.enter_context(_stream(server, ours)) for _ in range(MOST_STREAMS)]
        assert {_status(each) for each in streams} == {200}
        refused = api.bad(503, "GET", "/api/events")
        assert f"{MOST_STREAMS} event streams" in refused["message"]
        streams[0].close()

        def room() -> bool:
            with _stream(server, ours) as again:
                return _status(again) == 200

        wait_until(room, "room for a stream")
        if other:
            assert api.as_(None).call("GET", "/api/auth/me", headers=other).status == 200


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "evil.example:80@x"])
@pytest.mark.parametrize("path", ["/items/", "//evil.example/", "/api/items/"])
def test_a_redirect_is_a_path_of_this_server(api: Api, host: str, path: str) -> None:
    answer = api.call("GET", path, headers={"Host": host})
    target = answer.headers.get("location", "/")
    assert target.startswith("/")
    assert not target.startswith("//")


def _structure(**more: object) -> bytes:
    return json.dumps({"format": 1, "roots": ["a"], "products": {"a": {"label": "A", **more}}}).encode()


def test_a_structure_holds_nothing_that_is_not_in_its_model() -> None:
    check_structure(_structure())
    for more in ({"note": "x"}, {"stated": {"mass_kg": 1.0, "script": "x"}}):
        with pytest.raises(Exception, match="is no key of a structure"):
            check_structure(_structure(**more))
    with pytest.raises(Exception, match="is no key of a structure"):
        check_structure(json.dumps({"format": 1, "roots": [], "products": {}, "__proto__": {}}).encode())


def _glb(document: object) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return (
        b"glTF"
        + (2).to_bytes(4, "little")
        + (20 + len(text)).to_bytes(4, "little")
        + (len(text).to_bytes(4, "little") + b"JSON" + text)
    )


def test_a_glb_of_many_objects_is_refused_before_it_is_built(api: Api) -> None:
    """29 kB packed unfolded to a gigabyte."""
    with pytest.raises(Exception, match="geometry: it holds more than"):
        check_glb(_glb({"scenes": [{}] * (GLB.objects + 1)}))
    with pytest.raises(Exception, match="wanted nodes, meshes and materials only"):
        check_glb(_glb({"scenes": [{"nodes": [], "extensions": {}}]}))
    number = api.item()
    body, headers = form_body({"file": ("x.FCStd", b"bomb")})
    api.good("POST", f"/api/items/{number}/file", body=body, headers=headers)

    where = f"/api/models/{hashlib.sha256(b'bomb').hexdigest()}/geometry"
    packed = gzip.compress(_glb({"scenes": [[]] * (GLB.objects + 1)}))
    answer = api.bad(413, "PUT", where, body=packed, headers={"Content-Encoding": "gzip"})
    assert "more than" in answer["message"]


@pytest.mark.parametrize(
    "link",
    [
        "javascript:alert(1)",
        "https://",
        "http:// x",
        "https://a b",
        "https://" + "a" * 2000,
    ],
)
def test_each_field_for_a_link_refuses_the_same(api: Api, link: str) -> None:
    """The link of an item and that of its supplier part; a page makes links of both."""
    number = api.item()
    suppliers = {"supplier_parts": [{"supplier": "S", "link": link}]}
    assert api.bad(400, "PUT", f"/api/items/{number}/suppliers", suppliers)
    assert address_problem(link)
    assert not address_problem("https://shop.example/part?a=b")
    field = next(f for f in find_schema("kindred-rd").fields if f.name == "sourcing_link")
    with pytest.raises(Exception, match="Sourcing link: wanted"):
        field.read(link)
