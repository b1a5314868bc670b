# SPDX-License-Identifier: LGPL-2.1-or-later
"""Another revision as a ghost beside the open document: what it shows, and what differs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from silo.workbench.ghost import Differences, Ghost
from silo.workbench.words import filled, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.inertia.geometry.together import Mesh
    from silo.workbench.session.worker import Control


def ghosts(client: SiloClient, part_number: str, revision: int, control: Control) -> list[Ghost]:
    """Fetch the model of a revision, and find what it shows. For a worker."""
    import numpy as np

    from silo.drawing import products

    scene = client.get_scene(part_number, revision)
    found: list[Ghost] = []
    meshes: dict[int, dict[str, Mesh]] = {}
    for occurrence in scene.occurrences:
        control.check()
        if occurrence.geometry is None:
            continue
        if occurrence.geometry not in meshes:
            meshes[occurrence.geometry] = products(
                client.get_geometry(scene.geometries[occurrence.geometry].id)
            )
        if (mesh := meshes[occurrence.geometry].get(occurrence.key)) is not None:
            matrix = np.array(occurrence.matrix).reshape(4, 4).T
            found.append(Ghost(tuple(occurrence.path), matrix, mesh.moved(matrix)))
    return found


def difference_text(differences: Differences | None, revision: int) -> str:
    if differences is None:
        return translate("Silo", "The ghost is removed.")
    text = translate(
        "Silo", "Ghost: {removed} only in revision {n}, {moved} elsewhere there. Only here: {added}."
    )
    if differences.unknown:
        text += " " + translate("Silo", "Not compared: {unknown} in groups and arrays without links.")
    return filled(text, n=revision, **vars(differences))
