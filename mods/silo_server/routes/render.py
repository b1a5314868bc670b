# SPDX-License-Identifier: LGPL-2.1-or-later
"""Values as the API tells them."""

from __future__ import annotations

from typing import Any

from silo_server.clock import wire
from silo_server.values import Item, Revision


def item_to_wire(item: Item) -> dict[str, Any]:
    """An item, under the contract's names."""
    return {
        "id": item.uuid,
        "part_number": item.part_number,
        "name": item.name,
        "description": item.description,
        "item_type": item.item_type,
        "schema": item.schema,
        "category": item.category,
        "sourcing_type": item.sourcing_type,
        "long_description": item.long_description,
        "thumbnail_key": item.thumbnail_key,
        "properties": dict(item.properties),
        "current_revision": item.current_revision,
        "bom_version": item.bom_version,
        "created_at": wire(item.created_at),
        "created_by": item.created_by,
        "updated_at": wire(item.updated_at),
        "updated_by": item.updated_by,
        "archived_at": wire(item.archived_at),
    }


def revision_to_wire(part_number: str, revision: Revision) -> dict[str, Any]:
    """A revision, under the contract's names."""
    return {
        "part_number": part_number,
        "revision_number": revision.revision_number,
        "comment": revision.comment,
        "status": revision.status,
        "properties": dict(revision.properties),
        "file_name": revision.file_name,
        "file_checksum": revision.file_checksum,
        "file_size": revision.file_size,
        "thumbnail_key": revision.thumbnail_key,
        "created_at": wire(revision.created_at),
        "created_by": revision.created_by,
    }
