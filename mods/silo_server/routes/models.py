# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the routes take and give, beside the wire models that client and server share."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Annotated, Any, cast

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    WithJsonSchema,
    create_model,
)

from silo.api import wire
from silo.bom.numbers import read_quantity
from silo.bom.quantities import LARGEST_QUANTITY, quantity_of
from silo.bom.text import character_problem
from silo_server.routes import openapi
from silo_server.schema import text_hints
from silo_server.services.bom.line_edit import REL_TYPES, SOURCES
from silo_server.services.field_checks import quantity_problem
from silo_server.services.search import LookAlike


def _characters(text: str) -> str:
    if problem := character_problem(text):
        raise ValueError(problem)
    return text


Text = Annotated[
    str,
    StringConstraints(max_length=10_000),
    AfterValidator(_characters),
    WithJsonSchema(openapi.text(10_000)),
]
Short = Annotated[
    str, StringConstraints(max_length=200), AfterValidator(_characters), WithJsonSchema(openapi.text(200))
]
# The services check these values; the schemas here are for the OpenAPI document.
ItemUuid = Annotated[Short, WithJsonSchema(openapi.UUID)]
ItemType = Annotated[Short, WithJsonSchema(openapi.ITEM_TYPE)]
RelType = Annotated[Short, WithJsonSchema({"type": "string", "enum": list(REL_TYPES)})]
Source = Annotated[Short, WithJsonSchema({"type": "string", "enum": list(SOURCES)})]
Brief = Annotated[Short, WithJsonSchema(openapi.text(32))]


# What may be in it is one rule for all ways in, which the services keep (silo_server.user_json).
Properties = Annotated[dict[str, Any], WithJsonSchema(openapi.JSON_OBJECT)]


def _amount(value: object) -> object:
    if isinstance(value, str):
        reading = read_quantity(value, points_are_decimal=True)
        if reading.value is None:
            raise ValueError(reading.problem)
        value = reading.value
    problem = quantity_problem(value)
    if problem is not None:
        raise ValueError(problem)
    return quantity_of(cast(float | int | Decimal, value))


def _whole(value: object) -> object:
    return int(value) if isinstance(value, float) and value.is_integer() else value


# JSON's true and false are no numbers, and 1.5 or "2" no whole one; 2.0 is.
_WHOLE = BeforeValidator(_whole)
RevisionNumber = Annotated[int, Field(strict=True, ge=0, le=1_000_000), _WHOLE]
# A JSON number is exact up to 2**53. Change 0 is the empty BOM before everything.
ChangeId = Annotated[int, Field(strict=True, ge=1, le=2**53 - 1), _WHOLE]
ChangeIdOrNone = Annotated[int, Field(strict=True, ge=0, le=2**53 - 1), _WHOLE]
# A quantity: a number, or text as people type it.
Amount = Annotated[
    Decimal,
    BeforeValidator(_amount),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0, "maximum": LARGEST_QUANTITY},
                {"type": "string", "pattern": "^[1-9][0-9]{0,8}([.,][0-9]{1,2})?$"},
            ]
        }
    ),
]


class RequestBody(BaseModel):
    """Base of request bodies: unknown keys are ignored."""

    model_config = ConfigDict(extra="ignore")


if TYPE_CHECKING:
    _ItemTexts = RequestBody
    _LineTexts = RequestBody
else:

    def _bounded(of: type[BaseModel]) -> type[RequestBody]:
        """Make a body with the fields of a wire model, their lengths and characters checked."""

        def kind(hints: dict[str, Any]) -> Any:
            return Text if hints.get("long") else Brief if "maxLength" in hints else Short

        fields = {name: (kind(text_hints(field)) | None, None) for name, field in of.model_fields.items()}
        return create_model(f"_{of.__name__}", __base__=RequestBody, **fields)

    _ItemTexts, _LineTexts = map(_bounded, (wire.ItemTexts, wire.LineTexts))


class NewItemBody(_ItemTexts):
    """``POST /api/items``. With ``id`` (a UUID chosen by the client) a repeat makes no second item.

    An ``id`` that is no UUID is refused, as is one whose item has another part number or is archived.
    """

    model_config = ConfigDict(
        extra="ignore",
        protected_namespaces=(),
        populate_by_name=True,
        json_schema_extra=openapi.NUMBER_OR_CATEGORY,
    )

    schema_name: Short | None = Field(None, alias="schema")
    category: Annotated[Short, WithJsonSchema(openapi.CATEGORY_OR_EMPTY)] | None = None
    part_number: Annotated[Short, WithJsonSchema(openapi.part_number(or_empty=True))] | None = None
    id: ItemUuid | None = None
    name: Short | None = None
    description: Text | None = None
    item_type: ItemType | None = None
    properties: Properties | None = None


class ItemChangeBody(_ItemTexts):
    """``PUT /api/items/{pn}``: what is absent or null stays. ``properties`` make a new revision."""

    part_number: Annotated[Short, WithJsonSchema(openapi.part_number())] | None = None
    name: Short | None = None
    description: Text | None = None
    item_type: ItemType | None = None
    category: Annotated[Short, WithJsonSchema(openapi.CATEGORY_OR_EMPTY)] | None = None
    properties: Properties | None = None
    comment: Text = ""
    source: wire.FactSource = "hand"


class UuidsBody(RequestBody):
    """``POST /api/items/by-uuid``."""

    uuids: list[Short] = Field(max_length=10_000)


class ChecksumsBody(RequestBody):
    """``POST /api/documents/by-content``."""

    sha256: list[Annotated[str, WithJsonSchema(openapi.SHA256), Field(pattern="^[0-9a-f]{64}$")]] = Field(
        max_length=10_000
    )


class LookAlikeQuery(RequestBody):
    """A component that may be an item already: its name, and the SHA-256 of its file."""

    name: Short
    sha256: Short = ""


class LookAlikesBody(RequestBody):
    """``POST /api/items/look-alikes``."""

    wanted: list[LookAlikeQuery] = Field(max_length=1000)


class NumbersBody(RequestBody):
    """``POST /api/items/boms``."""

    part_numbers: list[Short] = Field(max_length=10_000)


class NumberBody(RequestBody):
    """``POST /api/generate-part-number``."""

    model_config = ConfigDict(extra="ignore", protected_namespaces=(), populate_by_name=True)

    schema_name: Short | None = Field(None, alias="schema")
    category: Annotated[Short, WithJsonSchema(openapi.CATEGORY)]


class NumberOut(BaseModel):
    """The number the next item of the category would get."""

    part_number: str


class ItemOut(wire.Item):
    """An item, with what this server says beyond the contract."""

    schema_name: str | None = Field(None, alias="schema")
    version: int
    created_by: str
    updated_by: str
    archived_at: wire.Time
    last_sync: wire.LastSync | None = None


class ItemsOut(BaseModel):
    """The items that were found; what is missing is absent."""

    items: list[ItemOut]


class LookAlikesOut(BaseModel):
    """For each component, in the order asked; at most twelve, those with the same file first."""

    look_alikes: list[list[LookAlike]]


class RevisionOut(wire.Revision):
    """A revision: a property snapshot and, if one was uploaded, a file."""

    part_number: str
    thumbnail_key: str | None


class DocumentsOut(BaseModel):
    """The documents that were found; what is missing is absent."""

    documents: list[wire.Document]


class ContentsOut(BaseModel):
    """Whose revisions have the contents that were asked for; unknown ones are absent."""

    contents: list[wire.KnownContent]


class AttachmentsOut(BaseModel):
    """The attachments of an item."""

    files: list[wire.Attachment]


class RevisionBody(RequestBody):
    """``POST /api/items/{pn}/revisions``: a revision without a file."""

    properties: Properties | None = None
    comment: Text = ""


class LineOut(wire.BomLine):
    """A BOM line, with what this server says beyond the contract.

    ``assembly_told`` and ``components`` are in a list of one level only, ``depth`` in a tree.
    """

    id: str
    newer_revision_exists: bool
    child_archived: bool
    cad_quantity: float | None
    reason: str | None


class BomsOut(BaseModel):
    """The lines of each item that was found, by the part number as it was asked for."""

    boms: dict[str, list[LineOut]]


class NewLineBody(_LineTexts):
    """``POST /api/items/{pn}/bom``."""

    child_part_number: Short
    quantity: Amount = Decimal(1)
    rel_type: RelType = "component"
    reference_designators: list[Short] = Field(default_factory=list, max_length=10_000)
    child_revision: RevisionNumber | None = None
    source: Source = "manual"
    metadata: Properties = Field(default_factory=dict)


def _kept(unused: Any) -> Any:
    # An absent key keeps the value of the line; this default is never read, and not in the document.
    return Field(unused, json_schema_extra=_without_default)


def _without_default(schema: dict[str, Any]) -> None:
    schema.pop("default", None)


class LineChangeBody(_LineTexts):
    """``PUT /api/items/{pn}/bom/{child}``: only the keys that are there are changed; null clears.

    A quantity, a relation type and a source cannot be cleared: null is refused for them.
    """

    quantity: Amount = _kept(Decimal(1))
    rel_type: RelType = _kept("component")
    reference_designators: list[Short] | None = Field(None, max_length=10_000)
    child_revision: RevisionNumber | None = None
    source: Source = _kept("manual")
    metadata: Properties | None = None
