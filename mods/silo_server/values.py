# SPDX-License-Identifier: LGPL-2.1-or-later
"""The server's own frozen values, between the services and what shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from math import isfinite
from typing import Any, NamedTuple

from silo.bom.quantities import quantity_of
from silo.bom.units import line_unit
from silo.file_kind import MODEL


@dataclass(frozen=True, slots=True)
class NewEvent:
    """An event to be written to the log; ``data`` is its JSON text."""

    name: str
    data: str
    item_uuid: str | None = None
    part_number: str | None = None


@dataclass(frozen=True, slots=True)
class Item:
    """An item. ``id`` is internal, ``uuid`` what the world knows; ``bom_version`` counts its BOM's states,
    ``version`` its own. ``texts`` are the columns of :class:`silo.api.wire.ItemTexts`."""

    id: int
    uuid: str
    part_number: str
    name: str
    description: str
    item_type: str
    schema: str | None
    category: str | None
    texts: Mapping[str, str | None]
    thumbnail_key: str | None
    properties: Mapping[str, Any]
    current_revision: int
    bom_version: int
    version: int
    created_at: str
    created_by: str
    updated_at: str
    updated_by: str
    archived_at: str | None
    supplier_parts: Sequence[Mapping[str, Any]] = ()  # as silo.api.wire.SupplierPart
    origins: Mapping[str, Mapping[str, str]] = field(default_factory=dict)  # as silo.api.wire.Origin

    @property
    def subject(self) -> str:
        """Return the name of the item for messages: its part number."""
        return self.part_number

    @property
    def is_bought(self) -> bool:
        """Return True for a purchased item: it says so, or says nothing and a supplier is known."""
        return bought(self.texts.get("sourcing_type"), self.supplier_parts or self.properties.get("supplier"))


def bought(sourcing: str | None, supplier: object) -> bool:
    """Decide :attr:`Item.is_bought` from the sourcing type and the supplier."""
    return sourcing == "purchased" or bool(not sourcing and supplier)


@dataclass(frozen=True, slots=True)
class Document:
    """A file with revisions of its own, or with those of the item ``item_id``. ``uuid`` is what the world
    knows.

    kind
        ``model``, or that of an attachment (:mod:`silo.file_kind`), which lies at the item ``attached_to``.
    """

    id: int
    uuid: str
    item_id: int | None
    current_revision: int
    created_at: str
    created_by: str
    became: str | None = None
    kind: str = MODEL
    attached_to: int | None = None
    removed_at: str | None = None

    @property
    def subject(self) -> str:
        """Return the name of the document for messages."""
        return f"document {self.uuid}"


@dataclass(frozen=True, slots=True)
class Revision:
    """A revision of an item: a property snapshot and, if one was uploaded, a file; or one of a document.

    base_revision, file_path, links
        what the client said of the file (:class:`silo.api.wire.Revision`).
    kind
        of its file; None without one.
    """

    revision_number: int
    comment: str
    status: str
    properties: Mapping[str, Any]
    file_name: str | None
    file_checksum: str | None
    file_size: int | None
    thumbnail_key: str | None
    created_at: str
    created_by: str
    base_revision: int | None = None
    file_path: str | None = None
    links: Sequence[Mapping[str, str]] = ()
    kind: str | None = None

    @property
    def is_model(self) -> bool:
        """Return True if the file is a model; an item's older revision may hold an attachment."""
        return self.kind == MODEL


@dataclass(frozen=True, slots=True)
class LineState:
    """Everything on a BOM line that can change; what history stores before and after.

    source
        ``assembly`` or ``manual``.
    unreferenced_since
        since when no component of the assembly uses it (assembly lines only).
    override, cad_quantity
        an assembly line whose quantity a user changed, and what the assembly had said.
    reason
        why a user keeps it as an intentional, non-CAD line.
    """

    quantity: Decimal
    source: str
    rel_type: str = "component"
    unit: str | None = None
    reference_designators: tuple[str, ...] = ()
    find_number: str | None = None
    notes: str | None = None
    child_revision: int | None = None
    unreferenced_since: str | None = None
    override: bool = False
    cad_quantity: Decimal | None = None
    reason: str | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Keep quantities as they were typed; what is no number stays, for the check of the state to name."""
        for name in ("quantity", "cad_quantity"):
            value = getattr(self, name)
            if isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value):
                object.__setattr__(self, name, quantity_of(value))


class Line(NamedTuple):
    """A BOM line with what its child is called. There may be 100 000 in a tree, so it is made of a tuple."""

    id: str
    parent_id: int
    child_id: int
    position: int
    child_part_number: str
    child_uuid: str
    child_name: str
    child_description: str
    child_item_type: str
    child_current_revision: int
    child_archived: bool
    child_unit: str | None
    state: LineState

    @property
    def unit(self) -> str | None:
        """Return the unit that the quantity is in, as it is shown; None for pieces that need no word."""
        if self.state.unit or not self.child_unit:
            return self.state.unit
        return line_unit(None, self.child_unit, from_cad=self.state.source == "assembly").symbol

    @property
    def newer_revision_exists(self) -> bool:
        """Return True if the line names an older revision of its child than the newest."""
        pinned = self.state.child_revision
        return pinned is not None and pinned < self.child_current_revision
