# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM over HTTP: its lines, the merge, the tree, review and history, files in and out."""

from __future__ import annotations

from fastapi import APIRouter

from silo_server.routes.answers import READ_ERRORS
from silo_server.routes.requests import BoundedRoute


def bom_router(tag: str) -> APIRouter:
    """Make a router below the address of an item's BOM; ``tag`` is its chapter of the API's document."""
    return APIRouter(
        route_class=BoundedRoute, prefix="/api/items/{part_number}/bom", tags=[tag], responses=READ_ERRORS
    )
