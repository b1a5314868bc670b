# SPDX-License-Identifier: LGPL-2.1-or-later
"""The wire models: what client and server say to each other (spec bom-sync §5), and nothing else.

Tolerant when reading: unknown keys are ignored, the forms of the real Silo are accepted beside the spec's
(``bom.merged`` beside ``bom_merge``, ``part_number`` beside ``item``, ``description`` where there is no
``name``). Exact when writing: the spec's keys.
"""

from __future__ import annotations

import math
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, AliasChoices, BaseModel, ConfigDict, Field, model_validator

Source = Literal["assembly", "manual"]


class Wire(BaseModel):
    """Base of all wire models: unknown keys are ignored, fields may be given by name or alias."""

    model_config = ConfigDict(extra="ignore", populate_by_name=True)


def _finite_positive(value: float) -> float:
    if not math.isfinite(value) or value <= 0:
        raise ValueError(f"quantity: wanted a finite number above 0, got {value}")
    return value


Quantity = Annotated[float, AfterValidator(_finite_positive)]


class Item(Wire):
    """An item of the PLM. ``id`` is its stable UUID; the part number may be renamed."""

    id: str = Field(validation_alias=AliasChoices("id", "uuid"))
    part_number: str
    name: str = ""
    description: str = ""
    item_type: str = "part"
    current_revision: int = 0
    created_at: datetime | None = None
    updated_at: datetime | None = None
    sourcing_type: str | None = None
    long_description: str | None = None
    thumbnail_key: str | None = None
    properties: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _none_is_unset(cls, data: Any) -> Any:
        # The real Silo sends null where it has nothing; for us that is the default.
        return {k: v for k, v in data.items() if v is not None} if isinstance(data, dict) else data

    @model_validator(mode="after")
    def _name_or_description(self) -> Item:
        # The spec reads item["name"]; the real Silo's display text is `description`.
        if not self.name:
            self.name = self.description or self.part_number
        return self


class BomLine(Wire):
    """A BOM line as the server has it. ``unreferenced_since`` is set while no assembly component uses it."""

    id: str | None = None
    parent_part_number: str | None = None
    child_part_number: str
    child_description: str = ""
    rel_type: str = "component"
    quantity: float | None = None
    unit: str | None = None
    reference_designators: list[str] = Field(default_factory=list)
    find_number: str | None = None
    notes: str | None = None
    child_revision: int | None = None
    source: Source = "assembly"
    unreferenced_since: datetime | None = None
    depth: int | None = None
    metadata: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _none_is_unset(cls, data: Any) -> Any:
        return {k: v for k, v in data.items() if v is not None} if isinstance(data, dict) else data


class MergeEntry(Wire):
    """One direct child in a merge request."""

    child_part_number: str = Field(min_length=1)
    quantity: Quantity
    source: str = "assembly"


class SourceDocument(Wire):
    """Which file a BOM was taken from, for the history."""

    file: str
    sha256: str | None = None
    revision: int | None = None


class MergeRequest(Wire):
    """``POST /api/items/{partNumber}/bom/merge``. ``sync_id`` makes a repeat harmless."""

    source: str = "assembly"
    entries: list[MergeEntry]
    sync_id: str | None = None
    dry_run: bool = False
    document: SourceDocument | None = None


class QuantityLine(Wire):
    """A part number with its quantity."""

    part_number: str
    quantity: float | None = None


class QuantityUpdate(Wire):
    """A part number with its quantity before and after."""

    part_number: str
    old_quantity: float | None = None
    new_quantity: float


class MergeDiff(Wire):
    """What a merge did, or would do. ``unchanged_count`` is the real Silo's short form in events."""

    added: list[QuantityLine] = Field(default_factory=list)
    removed: list[QuantityLine] = Field(default_factory=list)
    quantity_changed: list[QuantityUpdate] = Field(default_factory=list)
    unchanged: list[QuantityLine] = Field(default_factory=list)
    unchanged_count: int | None = Field(default=None, exclude=True)


class MergeWarning(Wire):
    """``unreferenced`` or ``conflict``; for a conflict both quantities are given."""

    type: str
    part_number: str
    message: str = ""
    assembly_quantity: float | None = None
    server_quantity: float | None = None


class MergeResult(Wire):
    """The answer to a merge request."""

    status: str = "merged"
    diff: MergeDiff = Field(default_factory=MergeDiff)
    warnings: list[MergeWarning] = Field(default_factory=list)
    resolve_url: str = ""
    sync_id: str | None = None
    version: int | None = None


class MergeEvent(Wire):
    """The SSE event of a merge: the spec's ``bom_merge``, or the real Silo's ``bom.merged``."""

    type: str = "bom_merge"
    item: str = Field(validation_alias=AliasChoices("item", "part_number"))
    user: str = ""
    timestamp: datetime | None = None
    summary: str = ""
    diff: MergeDiff = Field(default_factory=MergeDiff)
    resolve_url: str = ""
    sync_id: str | None = None
    warnings: list[MergeWarning] = Field(default_factory=list)


class ErrorBody(Wire):
    """The one shape of every HTTP error. ``problems`` lists all bad entries at once, with their index."""

    error: str
    message: str = ""
    problems: list[str] = Field(default_factory=list)
    path: list[str] = Field(default_factory=list)
