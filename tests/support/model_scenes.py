# SPDX-License-Identifier: LGPL-2.1-or-later
"""Models as a commit sends them, of simple bodies, and the story of a machine in two revisions."""

from __future__ import annotations

import gzip
import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import numpy as np
import trimesh
from model_file import model_file
from server_testing import Api, form_body

from silo.drawing import Glb, cube, shaded
from silo.inertia.geometry.together import Mesh

Body = tuple[trimesh.Trimesh, Sequence[float]]
"""A mesh in metres, and its colour with alpha."""


def body(kind: str, size: float, detail: int = 24) -> trimesh.Trimesh:
    """A block, a ball or a rod, ``size`` metres across, about the origin."""
    if kind == "ball":
        return trimesh.creation.uv_sphere(radius=size / 2, count=(detail, detail))
    if kind == "rod":
        return trimesh.creation.cylinder(radius=size / 8, height=size, sections=detail)
    return trimesh.creation.box(extents=(size, size * 0.7, size * 0.4))


def geometry(bodies: Mapping[str, Body]) -> bytes:
    """A GLB with a node for each key."""
    made = Glb()
    for key, (mesh, colour) in bodies.items():
        smooth = shaded(Mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)))
        low, size, matrix = cube(smooth.vertices)
        shape = made.quantized(smooth.vertices, smooth.normals, smooth.faces, low, size)
        drawn = made.mesh([(shape, made.material(colour, colour[3]))])
        made.roots.append(made.node(drawn, matrix, extras={"key": key}))
    return made.packed()


def use(
    member: str, target: str, uuid: str, *at: float, color: Sequence[float] | None = None
) -> dict[str, Any]:
    """A use of a product of the same file, at x, y, z."""
    matrix = [1, 0, 0, at[0], 0, 1, 0, at[1], 0, 0, 1, at[2], 0, 0, 0, 1]
    return {"member": member, "file": "", "target": target, "uuid": uuid, "matrix": matrix, "color": color}


def commit(api: Api, item: str, content: bytes, bodies: Mapping[str, Body], uses: Mapping[str, Any]) -> None:
    """Upload a file with its model. ``uses``: product → what it shows; the first is the file as a whole."""
    content = model_file(content)
    form, headers = form_body({"file": ("machine.FCStd", content)})
    api.good("POST", f"/api/items/{item}/file", body=form, headers=headers)
    send_model(api, content, bodies, uses)


def library(api: Api, content: bytes, held: Mapping[str, str]) -> None:
    """Upload a file of several items with its model. ``held``: a body of :data:`BODIES` → its item."""
    content = model_file(content)
    items = [{"item": api.get(f"/api/items/{one}")["id"], "object": key} for key, one in held.items()]
    form, headers = form_body({"file": ("library.FCStd", content), "items": json.dumps(items)})
    document = uuid5(NAMESPACE_URL, "/".join(held.values()))
    api.good("POST", f"/api/documents/{document}/file", body=form, headers=headers)
    send_model(api, content, {key: BODIES[key] for key in held}, {"Library": []})


def send_model(api: Api, content: bytes, bodies: Mapping[str, Body], uses: Mapping[str, Any]) -> None:
    """Send the model of a content that is a revision's file."""
    products = {key: {"label": key, "shape": True} for key in bodies}
    products |= {key: {"label": key, "uses": shown} for key, shown in uses.items()}
    structure = json.dumps({"format": 1, "roots": list(uses)[:1], "products": products}).encode()
    path = f"/api/models/{hashlib.sha256(content).hexdigest()}"
    packed = {"Content-Encoding": "gzip"}
    api.good("PUT", f"{path}/geometry", body=gzip.compress(geometry(bodies)), headers=packed)
    api.good("PUT", f"{path}/structure", body=structure)


BODIES: Mapping[str, Body] = {
    "Plate": (body("block", 0.4), (0.6, 0.65, 0.7, 1)),
    "Bolt": (body("rod", 0.12), (0.3, 0.3, 0.3, 1)),
    "Gear": (body("block", 0.1), (0.8, 0.5, 0.2, 1)),
    "Cover": (body("block", 0.2), (0.3, 0.5, 0.8, 1)),
    "Sensor": (body("ball", 0.08), (0.2, 0.7, 0.3, 1)),
}


def machine(api: Api, prefix: str) -> str:
    """A machine and its second revision: each kind of difference, and two questions. Returns its part number.

    The cover is gone, a sensor is new, 3 bolts became 6 and a person says 9, one of two gears moved.
    """
    names = ("Machine", "Gearbox", *BODIES)
    parts = {one: api.item(f"{prefix}-{one.upper()}", name=one) for one in names}
    uuids = {one: api.get(f"/api/items/{number}")["id"] for one, number in parts.items()}
    top, gearbox = parts["Machine"], parts["Gearbox"]
    api.merge(gearbox, {parts["Gear"]: 2})

    def revision(number: int, bolts: int, more: Sequence[dict[str, Any]], gear: float) -> None:
        shown = [
            use("Plate", "Plate", uuids["Plate"], 0, 0, 0),
            use("Box", "Gearbox", uuids["Gearbox"], 0, 0, 0.15),
        ]
        shown += [use(f"Bolt{n}", "Bolt", uuids["Bolt"], 0.06 * n - 0.15, 0.1, 0.1) for n in range(bolts)]
        gears = [
            use("Gear1", "Gear", uuids["Gear"], -0.12, 0, 0),
            use("Gear2", "Gear", uuids["Gear"], gear, 0, 0),
        ]
        structure = {"Machine": [*shown, *more], "Gearbox": gears}
        commit(api, top, f"{prefix} {number}".encode(), BODIES, structure)
        quantities = {
            one["uuid"]: sum(other["uuid"] == one["uuid"] for other in structure["Machine"])
            for one in structure["Machine"]
        }
        numbers = {uuid: parts[one] for one, uuid in uuids.items()}
        api.merge(top, {numbers[uuid]: count for uuid, count in quantities.items()})

    revision(1, 3, [use("Cover", "Cover", uuids["Cover"], 0, 0, 0.3)], 0.08)
    api.good("PUT", f"/api/items/{top}/bom/{parts['Bolt']}", {"quantity": 9})
    revision(2, 6, [use("Sensor", "Sensor", uuids["Sensor"], 0.15, -0.1, 0.13)], 0.14)
    return top
