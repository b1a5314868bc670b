# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is drawn of files, and the scene that the server joins from it; hostile models."""

from __future__ import annotations

import gzip
import hashlib
import json
import struct
import uuid
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hunting import BOTH
from model_file import model_file
from server_testing import Answer, Api, form_body

from silo.drawing import Glb, cube

STILL = [1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
TURNED = [0.0, -1, 0, 0.5, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


def glb(
    *keys: str,
    change: Callable[[dict[str, Any]], object] = lambda _: None,
    last: int = 2,
    behind: bytes = b"",
) -> bytes:
    """A triangle for each key; ``change`` spoils its JSON, and ``behind`` is more of its buffer."""
    made = Glb()
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0]])
    low, size, matrix = cube(points)
    for key in keys:
        shape = made.quantized(points, np.array([[0.0, 0, 1]] * 3), np.array([[0, 1, last]]), low, size)
        mesh = made.mesh([(shape, made.material((1, 0, 0)))])
        made.roots.append(made.node(mesh, matrix, extras={"key": key}))
    body = made.packed()
    length = struct.unpack_from("<I", body, 12)[0]
    document, blob = json.loads(body[20 : 20 + length]), body[28 + length :] + behind
    rest = struct.pack("<I4s", len(blob), b"BIN\0") + blob
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return (
        struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + rest
    )


def use(target: str, file: str = "", matrix: list[float] = STILL, **more: Any) -> dict[str, Any]:
    """A use of a product."""
    return {"member": f"Link of {target}", "file": file, "target": target, "matrix": matrix, **more}


def structure(**products: Any) -> dict[str, Any]:
    """A structure; the first product is the file as a whole."""
    return {"format": 1, "roots": list(products)[:1], "products": products}


def put(api: Api, content: bytes, part: str, body: bytes, **headers: str) -> Answer:
    """Send a part of a model."""
    checksum = hashlib.sha256(content).hexdigest()
    packed = {"Content-Encoding": "gzip"} if body[:2] == b"\x1f\x8b" else {}
    return api.call("PUT", f"/api/models/{checksum}/{part}", body=body, headers={**packed, **headers})


def state(api: Api, content: bytes, **products: Any) -> int:
    """Send the structure of a file; returns the status."""
    return put(api, content, "structure", json.dumps(structure(**products)).encode()).status


def upload(
    api: Api, item: str, content: bytes | None = None, links: list[dict[str, str]] | None = None
) -> bytes:
    """Upload a file, of a content that no other test has; returns the content."""
    content = content or model_file(uuid.uuid4().bytes)
    api.upload(item, content, links=json.dumps(links or []))
    return content


def upload_for(api: Api, document: str, held: dict[str, str]) -> bytes:
    """Upload a file that holds items: object → part number; returns its content."""
    content = model_file(uuid.uuid4().bytes)
    items = [{"item": api.get(f"/api/items/{number}")["id"], "object": name} for name, number in held.items()]
    body, headers = form_body({"file": ("x.FCStd", content), "items": json.dumps(items)})
    api.good("POST", f"/api/documents/{document}/file", body=body, headers=headers)
    return content


def commit(
    api: Api,
    item: str,
    links: list[dict[str, str]] | None = None,
    *,
    content: bytes | None = None,
    **products: Any,
) -> str:
    """Upload a file with its model; returns the SHA-256."""
    content = upload(api, item, content, links)
    shapes = [key for key, one in products.items() if one.get("shape")]
    assert put(api, content, "geometry", gzip.compress(glb(*shapes))).status == 204
    assert state(api, content, **products) == 204
    return hashlib.sha256(content).hexdigest()


def test_a_model_is_kept_by_content_and_may_be_cached_for_ever(api: Api) -> None:
    """Packed at rest and on the way; only for files of revisions."""
    item, sent = api.item(), glb("Body")
    assert put(api, b"no file here", "geometry", sent).status == 404
    content = upload(api, item)
    checksum = hashlib.sha256(content).hexdigest()
    asked = {"sha256": [checksum, "0" * 64]}
    assert api.good("POST", "/api/models/missing", asked) == {"sha256": [checksum]}
    assert api.call("GET", f"/api/models/{checksum}/geometry").status == 404
    assert put(api, content, "geometry", sent).status == 204
    assert state(api, content, Body={"shape": True}) == 204
    assert api.good("POST", "/api/models/missing", asked) == {"sha256": []}
    (told,) = api.get(f"/api/items/{item}/scene")["geometries"]
    found = api.call("GET", told["url"], headers={"Accept-Encoding": "gzip"})
    assert (found.headers["content-encoding"], found.headers["content-type"]) == ("gzip", "model/gltf-binary")
    assert "immutable" in found.headers["cache-control"]
    assert (len(found.body), gzip.decompress(found.body)) == (told["bytes"], sent)
    again = api.call("GET", told["url"], headers={"If-None-Match": found.headers["etag"]})
    assert again.status == 304
    # A newer maker's model replaces it, at another address.
    assert put(api, content, "geometry", glb("Body", "Pad")).status == 204
    assert api.get(f"/api/items/{item}/scene")["geometries"][0]["url"] != told["url"]


@BOTH
def test_a_scene_joins_the_newest_files_or_those_that_a_revision_recorded(api: Api) -> None:
    """A changed part needs no new assembly; each occurrence knows the lines that lead to it."""
    top, sub, leaf = api.items(3)
    uuids = {one: api.get(f"/api/items/{one}")["id"] for one in (top, sub, leaf)}
    old = commit(api, leaf, Body={"label": "Bolt", "shape": True})
    middle = commit(
        api,
        sub,
        [{"path": "leaf.FCStd", "item": uuids[leaf], "sha256": old}],
        Assembly={
            "uses": [use("Body", "leaf.FCStd", TURNED, uuid=uuids[leaf], color=[0, 1, 0, 1]), use("Plate")]
        },
        Plate={"label": "Plate", "shape": True},
    )
    commit(
        api,
        top,
        [{"path": "sub.FCStd", "item": uuids[sub], "sha256": middle}],
        Assembly={"uses": [use("Assembly", "sub.FCStd", TURNED, uuid=uuids[sub], color=[1, 0, 0, 0.5])] * 2},
    )
    # A flexible link places the parts of another file by itself.
    commit(
        api,
        flexible := api.item(),
        [{"path": "sub.FCStd", "item": uuids[sub], "sha256": middle}],
        **{"Assembly@Flexible": {"uses": [use("Body", "sub.FCStd|leaf.FCStd"), use("X", "sub.FCStd|x")]}},
    )
    scene = api.get(f"/api/items/{flexible}/scene")
    assert [one["label"] for one in scene["occurrences"]] == ["Bolt"]
    assert [one["why"] for one in scene["missing"]] == ["its file sub.FCStd|x is not in Silo"]
    scene = api.get(f"/api/items/{top}/scene")
    assert (scene["part_number"], scene["revision"], scene["missing"]) == (top, 1, [])
    assert [len(scene[name]) for name in ("occurrences", "geometries")] == [4, 2]
    assert sorted(scene["without_picture"]) == sorted([top, sub, leaf])
    bolt, plate = scene["occurrences"][:2]
    assert (bolt["path"], bolt["lines"]) == (["Link of Assembly", "Link of Body"], [sub, leaf])
    assert (bolt["part_number"], bolt["label"], bolt["key"]) == (leaf, "Bolt", "Body")
    assert bolt["color"] == [1, 0, 0, 0.5]
    # Turned twice by a quarter about Z: half a turn; columns, as three.js reads them.
    assert bolt["matrix"] == [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0.5, 0.5, 0, 1]
    assert (plate["lines"], plate["part_number"]) == ([sub, ""], "")
    assert scene["geometries"][bolt["geometry"]]["id"] == old
    new = commit(api, leaf, Body={"label": "Longer bolt", "shape": True})
    now, before = (api.get(f"/api/items/{top}/scene{query}") for query in ("", "?revision=1"))
    assert (now["geometries"][0]["id"], now["occurrences"][0]["label"]) == (new, "Longer bolt")
    assert before == scene
    api.bad(404, "GET", f"/api/items/{top}/scene?revision=2")


def test_what_a_scene_lacks_is_listed_once(api: Api) -> None:
    """A file that is not here, one without a model, a part that its file lost, a ring, a wild place."""
    top, bare = api.items(2)
    number = {one: api.get(f"/api/items/{one}")["id"] for one in (top, bare)}
    upload(api, bare)
    far = [1e6, 0, 0, 0, 0, 1e6, 0, 0, 0, 0, 1e6, 0, 0, 0, 0, 1]
    commit(
        api,
        top,
        [
            {"path": "gone.FCStd", "item": str(uuid.uuid4())},
            {"path": "bare.FCStd", "item": number[bare]},
            {"path": "me.FCStd", "item": number[top]},
        ],
        Assembly={
            "label": "Ring",
            "uuid": number[top],
            "uses": [
                *[use("X", "gone.FCStd")] * 2,
                use("X", "unknown.FCStd"),
                use("Body", "bare.FCStd", uuid=number[bare]),
                use("X", "me.FCStd"),
                use("Assembly", "me.FCStd"),
                use("Far", matrix=far),
            ],
        },
        Far={"uses": [use("Far2", matrix=far)], "label": "Far"},
        Far2={"label": "Farther", "shape": True},
    )
    scene = api.get(f"/api/items/{top}/scene")
    assert scene["occurrences"] == []
    assert [(one["part_number"], one["label"], one["why"]) for one in scene["missing"]] == [
        ("", "X", "its file gone.FCStd is not in Silo"),
        ("", "X", "its file unknown.FCStd is not in Silo"),
        (bare, "x.FCStd", "its file has no model yet"),
        ("", "X", "x.FCStd has no such part any more"),
        (top, "Ring", "it contains itself; it is left out where the ring closes"),
        ("", "Farther", "its place or its scale is beyond all bounds"),
    ]
    assert api.get(f"/api/items/{bare}/scene")["missing"][0]["why"] == "its file has no model yet"
    api.bad(404, "GET", f"/api/items/{api.item()}/scene")


def test_a_scene_is_bounded_however_small_the_file(api: Api, monkeypatch: pytest.MonkeyPatch) -> None:
    """60 levels of two uses each are 10^18 parts, also if none has a shape."""
    monkeypatch.setattr("silo_server.services.scene.MAX_OCCURRENCES", 500)
    item = api.item()
    levels = {f"L{n}": {"uses": [use(f"L{n + 1}")] * 2} for n in range(60)}
    commit(api, item, **levels, L60={})
    assert "at most 500 parts" in api.bad(413, "GET", f"/api/items/{item}/scene")["message"]


def spoil(path: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """Put a value at ``a.0.b`` of a GLB's JSON."""

    def change(document: Any) -> None:
        *steps, last = path.split(".")
        for step in steps:
            document = document[int(step) if step.isdigit() else step]
        document[int(last) if last.isdigit() else last] = value

    return change


def accessor(**more: Any) -> dict[str, Any]:
    """The first of a view that holds three points."""
    return {"bufferView": 0, "componentType": 5123, "count": 3, "type": "VEC3", **more}


def spoilt(**changes: Any) -> bytes:
    """A GLB with several values put at ``a__0__b``; what is put at the end of a list makes it longer."""

    def change(document: dict[str, Any]) -> None:
        for path, value in changes.items():
            name, _, rest = path.partition("__")
            if rest.isdigit() and int(rest) == len(document[name]):
                document[name].append(value)
            else:
                spoil(path.replace("__", "."), value)(document)

    return glb("A", change=change, behind=b"\xff" * 1000)


def bare(size: int = 0) -> bytes:
    """A GLB of JSON alone, whose length is off by so much."""
    text = json.dumps({"asset": {"version": "2.0"}, "scenes": [{"nodes": []}]}).encode()
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text) + size, b"JSON") + text


HUGE = 10**30
LIGHT = {"attributes": {"POSITION": 0}, "indices": 2}
KEYED = {"extras": {"key": "A"}}
GEOMETRIES: dict[str, Any] = {
    "no GLB": b"hello",
    "nothing": b"",
    "cut off": glb("A")[:-8],
    "a fourth vertex of three": glb("A", last=3),
    "a tail": glb("A") + b"1234",
    "a length of 4 GB": b"glTF\2\0\0\0\xff\xff\xff\xff" + glb("A")[12:],
    "a JSON chunk of 4 GB": glb("A")[:12] + b"\xff\xff\xff\xff" + glb("A")[16:],
    "a JSON chunk that ends behind the file": bare(4),
    "another chunk than BIN": glb("A").replace(b"BIN\0", b"XXX\0"),
    "a BIN chunk that is shorter than the rest": glb("A").replace(b",\0\0\0BIN", b"(\0\0\0BIN"),
    "a view of another buffer": spoilt(bufferViews__0__buffer=1),
    "a wide stride": spoilt(bufferViews__3={"buffer": 0, "byteLength": 4, "byteStride": 256}),
    "an accessor of nothing": spoilt(accessors__3=accessor(count=0)),
    "an accessor before its view": spoilt(accessors__3=accessor(byteOffset=-4)),
    "an accessor whose stride leads out of its view": spoilt(accessors__3=accessor(count=4)),
    "ten million vertices": spoilt(
        bufferViews__3={"buffer": 0, "byteLength": 1000},
        accessors=[accessor(bufferView=3, componentType=5121, type="SCALAR", count=1000)] * 10_001,
    ),
    "20 001 nodes": spoilt(nodes=[KEYED] * 20_001, scenes__0__nodes=list(range(20_001))),
    "20 001 meshes": spoilt(meshes=[{"primitives": []}] * 20_001, nodes__0=KEYED),
    "100 001 primitives": spoilt(meshes__0__primitives=[LIGHT] * 100_001),
    "indices in threes": spoilt(accessors__2__type="VEC3", accessors__2__count=1),
    "indices with a stride": spoilt(bufferViews__2__byteStride=2),
    "fewer normals than points": glb("A", last=1, change=spoil("accessors.1.count", 2)),
    "indices behind an offset": spoilt(bufferViews__2__byteLength=14, accessors__2__byteOffset=8),
    "JSON that nests": struct.pack("<4sIII4s", b"glTF", 2, 100_020, 100_000, b"JSON") + b"[" * 100_000,
    **{
        f"{path} = {value!r:.40}": glb("A", change=spoil(path, value))
        for path, value in {
            "buffers.0.byteLength": HUGE,
            "buffers.0.uri": "https://example.com/x.bin",
            "bufferViews.0.byteLength": 1 << 30,
            "bufferViews.0.byteOffset": -4,
            "bufferViews.0.byteStride": HUGE,
            "accessors.0.count": HUGE,
            "accessors.0.bufferView": -1,
            "accessors.0.componentType": 99,
            "accessors.1.count": 2,
            "accessors.2.count": 4,
            "accessors.0.sparse": {"count": 1},
            "accessors.0.max": [float("nan")] * 3,
            "nodes.0.matrix": [1e400] * 16,
            "nodes.0.translation": [10**400] * 3,
            "nodes.0.scale": [-(10**400)] * 3,
            "nodes.0.mesh": 7,
            "nodes.0.children": [0],
            "nodes.0.extras": {},
            "scenes.0.nodes": [0] * 1000,
            "images": [{"uri": "https://example.com/x.png"}],
            "extensionsUsed": ["KHR_draco_mesh_compression"],
            "meshes.0.primitives.0.indices": 0,
            "meshes.0.primitives.0.attributes.POSITION": -3,
            "meshes.0.primitives.0.material": 5,
            "nodes": [{}] * 20_001,
            "meshes": "x",
        }.items()
    },
}
DEEP = b'{"products":' + b"[" * 100_000
STRUCTURES: dict[str, Any] = {
    "no JSON": b"\xff\xfe",
    "an array": b"[]",
    "JSON that nests": DEEP,
    "another format": {**structure(), "format": 2},
    "a root that is not there": {**structure(), "roots": ["X"]},
    "a use of nothing": structure(A={"uses": [use("B")]}),
    "a short matrix": structure(A={"uses": [use("A", matrix=STILL[:12])]}),
    "no affine matrix": structure(A={"uses": [use("A", matrix=[*STILL[:12], 0, 0, 0, 2])]}),
    "NaN": structure(A={"uses": [use("A", matrix=[float("nan"), *STILL[1:]])]}),
    "infinity": json.dumps(structure(A={"uses": [use("A")]})).replace("1.0", "1e999").encode(),
    "a huge number": structure(A={"uses": [use("A", matrix=[1e7, *STILL[1:]])]}),
    "a colour of 2": structure(A={"uses": [use("A", color=[2, 0, 0, 1])]}),
    "control characters": structure(A={"label": "a\0b"}),
    "control characters in a use": structure(A={"uses": [use("A", member="a\0b")]}),
    "an endless whole number": structure(A={"uses": [use("A", matrix=[-(10**400), *STILL[1:]])]}),
    "a long label": structure(A={"label": "a" * 2000}),
    "too many products": structure(**{f"P{n}": {} for n in range(20_001)}),
}


@pytest.mark.parametrize("part", ["geometry", "structure"])
def test_hostile_models_are_refused_with_a_sentence(api: Api, part: str) -> None:
    """Huge counts, NaN, claims of gigabytes, addresses elsewhere; the server keeps nothing and goes on."""
    content = upload(api, api.item())
    for name, value in (GEOMETRIES if part == "geometry" else STRUCTURES).items():
        answer = put(api, content, part, value if isinstance(value, bytes) else json.dumps(value).encode())
        assert answer.status == (413 if name == "JSON that nests" else 400), name
        assert answer.json()["message"].startswith(f"{part}: "), name
    many = structure(A={"uses": [use("A")] * 50_001}, B={"uses": [use("A")] * 50_000})
    for bad, status in {
        gzip.compress(b" " * (65 << 20)): 413,
        gzip.compress(glb("A"))[:-9]: 400,
        gzip.compress(glb("A")) + b"x": 400,
        b"\x1f\x8b" + b"x" * 100: 400,
        **({gzip.compress(json.dumps(many).encode()): 400} if part == "structure" else {}),
        b" " * (17 << 20): 413,
    }.items():
        assert put(api, content, part, bad).status == status
    assert put(api, content, part, glb("A"), **{"Content-Encoding": "br"}).status == 400
    checksum = hashlib.sha256(content).hexdigest()
    assert api.call("GET", f"/api/models/{checksum}/{part}").status == 404


BOX = {"mass_kg": 0.5, "volume_m3": 6e-5, "com_m": [0.0, 0.01, 0.02], "size_m": [0.01, 0.02, 0.3]}


@BOTH
def test_items_take_what_their_newest_file_states(api: Api) -> None:
    """With source and time, in the revision of the file; what is typed stays; older files say nothing."""
    number = api.item()
    path = f"/api/items/{number}"
    named = api.get(path)["name"]
    old, new = model_file(uuid.uuid4().bytes), model_file(uuid.uuid4().bytes)
    about = {**BOX, "material": "Steel", "description": "Box, 300 long"}
    commit(api, number, content=old, Body={"shape": True, "stated": about})
    item = api.get(path)
    assert item["properties"] == {**BOX, "material": "Steel"}
    assert (item["description"], item["name"], item["current_revision"]) == ("Box, 300 long", named, 1)
    assert {one["source"] for one in item["origins"].values()} == {"cad"}
    assert api.get(f"{path}/revisions")[0]["properties"] == item["properties"]
    # The same from another kernel is no change.
    near = {**about, "mass_kg": 0.5 + 1e-8, "com_m": [1e-11, 0.01, 0.02]}
    commit(api, number, content=new, Body={"shape": True, "stated": near})
    assert api.get(path)["origins"] == item["origins"]
    api.good("PATCH", f"{path}/properties?source=scale", {"mass_kg": 0.53})
    api.good("PUT", path, {"description": "A box"})
    # An older content says nothing; the newest one does, beside what is typed, in a revision of its own.
    assert state(api, old, Body={"stated": {**about, "mass_kg": 9}}) == 204
    assert api.get(path)["properties"]["mass_kg"] == 0.53
    assert state(api, new, Body={"stated": {"size_m": [1, 2, 3]}}) == 204
    item = api.get(path)
    assert item["properties"] == {"mass_kg": 0.53, "size_m": [1, 2, 3]}
    assert (item["description"], item["current_revision"]) == ("A box", 4)
    # A content that is known states it again as soon as it is the newest.
    api.good("PATCH", f"{path}/properties", {"mass_kg": None})
    upload(api, number, old)
    assert api.get(path)["properties"] == {**BOX, "material": "Steel", "mass_kg": 9}


def test_a_mass_from_cad_goes_with_its_shape(api: Api) -> None:
    """A file that states no mass leaves one alone that CAD said, unless size or material changed."""
    number = api.item()
    path = f"/api/items/{number}"
    api.good("PATCH", f"{path}/properties?source=cad", {"mass_kg": 2})
    for stated, mass in [
        ({"size_m": [1, 2, 3]}, 2),
        ({"size_m": [1, 2, 3], "material": "Wood"}, 2),
        ({"size_m": [1, 2, 3], "material": "Wood", "mass_kg": 4}, 4),
        ({"size_m": [1, 2, 3], "material": "Wood"}, 4),
        (None, 4),
        ({"size_m": [1, 2, 4], "material": "Wood"}, None),
    ]:
        commit(api, number, Body={"shape": True, "stated": stated})
        assert api.get(path)["properties"].get("mass_kg") == mass


def test_what_no_file_can_state_is_refused(api: Api) -> None:
    """Signs, sizes, characters."""
    number = api.item()
    content = upload(api, number)
    for stated in (
        {"mass_kg": 0},
        {"mass_kg": -1},
        {"mass_kg": 1e13},
        {"size_m": [1, 2]},
        {"material": 3},
        {"com_m": [0, 0, 1e7]},
        {"material": "\u0000"},
        {"description": "x" * 1001},
    ):
        assert state(api, content, Body={"stated": stated}) == 400, stated
    assert api.get(f"/api/items/{number}")["properties"] == {}


def test_each_item_of_a_file_takes_what_its_object_states(api: Api) -> None:
    """Without revisions of their own; an object that is gone states nothing."""
    numbers = api.items(3)
    content = upload_for(api, str(uuid.uuid4()), dict(zip(("A", "B", "Gone"), numbers, strict=True)))
    assert state(api, content, A={"stated": {"mass_kg": 1}}, B={"stated": {"mass_kg": 2}}) == 204
    items = [api.get(f"/api/items/{one}") for one in numbers]
    assert [(one["properties"].get("mass_kg"), one["current_revision"]) for one in items] == [
        (1, 0),
        (2, 0),
        (None, 0),
    ]


@BOTH
def test_an_older_file_of_several_items_is_found_whatever_else_an_item_has(api: Api) -> None:
    """The number is that of the file's revision, also if its items have revisions of their own properties."""
    numbers, document = api.items(2), str(uuid.uuid4())
    for label in ("Old", "New"):
        content = upload_for(api, document, dict(zip("AB", numbers, strict=True)))
        products = {name: {"label": f"{label} {name}", "shape": True} for name in "AB"}
        assert state(api, content, **products) == 204
    api.good("PATCH", f"/api/items/{numbers[1]}/properties?source=scale", {"mass_kg": 2})
    assert api.get(f"/api/items/{numbers[1]}")["current_revision"] == 1
    for number, name in zip(numbers, "AB", strict=True):
        path = f"/api/items/{number}/scene"
        shown = [api.get(path + query) for query in ("?revision=1", "?revision=2", "")]
        assert [one["revision"] for one in shown] == [1, 2, 2]
        labels = [one["occurrences"][0]["label"] for one in shown]
        assert labels == [f"Old {name}", f"New {name}", f"New {name}"]
        api.bad(404, "GET", f"{path}?revision=3")
