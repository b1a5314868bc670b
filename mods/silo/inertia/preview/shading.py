# SPDX-License-Identifier: LGPL-2.1-or-later
"""Normals for pictures: smooth over a fillet, sharp at an edge. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from trimesh import creation

from silo.inertia.geometry.together import Floats, Indices, Mesh

CREASE = np.cos(np.radians(38.0))
"""Faces that meet at more than this angle keep their edge."""

MAX_DEGREE = 100
"""Triangles at one vertex up to which normals are smoothed; the tip of a fan looks well enough flat."""


@dataclass(frozen=True, eq=False)
class Shaded:
    """Triangles with one normal per vertex: vertices (n, 3) [m], normals (n, 3), faces (m, 3)."""

    vertices: Floats
    normals: Floats
    faces: Indices


def shaded(mesh: Mesh) -> Shaded:
    """Return the mesh with normals; a vertex on an edge becomes several."""
    if not len(mesh):
        return Shaded(mesh.vertices, np.zeros_like(mesh.vertices), mesh.faces)
    place = np.unique(mesh.vertices, axis=0, return_inverse=True)[1].reshape(-1)
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normals = _smoothed(place[mesh.faces].reshape(-1), np.cross(b - a, c - a))
    points = mesh.vertices[mesh.faces].reshape(-1, 3)
    rows = np.hstack([points.astype(np.float32), np.round(normals, 3).astype(np.float32)])
    unique, index = np.unique(rows, axis=0, return_inverse=True)
    return Shaded(
        unique[:, :3].astype(np.float64), _unit(unique[:, 3:].astype(np.float64)), index.reshape(-1, 3)
    )


def _smoothed(vertex: Indices, areas: Floats) -> Floats:
    """Return (3 m, 3): for each corner the mean normal of the faces at its vertex that look about its own
    way.

    ``vertex`` (3 m,) of each corner, ``areas`` (m, 3) normals as long as the faces are large.
    """
    flat = _unit(areas)
    order = np.argsort(vertex, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(vertex[order]) != 0])
    degrees = np.diff(np.r_[starts, len(order)])
    result = flat[np.arange(len(vertex)) // 3]
    for degree in np.unique(degrees):
        if degree > MAX_DEGREE:
            continue
        corners = order[starts[degrees == degree][:, None] + np.arange(degree)]
        face = corners // 3
        near = np.einsum("nix,njx->nij", flat[face], flat[face]) > CREASE
        mean = np.einsum("nij,njx->nix", near.astype(np.float64), areas[face]).reshape(-1, 3)
        result[corners.reshape(-1)] = _unit(mean)
    return result


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    result: Floats = vectors / np.where(length > 0, length, 1.0)
    return result


def ellipsoid(rings: int = 20, sectors: int = 32) -> Mesh:
    """Return a unit sphere; scaled by three semi-axes it is any ellipsoid."""
    ball = creation.uv_sphere(radius=1.0, count=(rings, sectors))
    return Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
