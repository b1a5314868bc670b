# SPDX-License-Identifier: LGPL-2.1-or-later
"""The wire models: what client and server say to each other (spec bom-sync §5), and nothing else.

Tolerant when reading: unknown keys are ignored, the forms of the real Silo are accepted beside the spec's
(``bom.merged`` beside ``bom_merge``, ``part_number`` beside ``item``, ``description`` where there is no
``name``, null where there is nothing). Exact when writing: the spec's keys, whole quantities as integers.
Write with ``model_dump(mode="json", by_alias=True, exclude_none=True)``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import (
    AliasChoices,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_serializer,
    model_validator,
)

from silo.bom.headers import designators
from silo.bom.quantities import plain

Source = Literal["assembly", "manual"]


class Wire(BaseModel):
    """Base of all wire models: unknown keys are ignored, fields may be given by name or alias."""

    model_config = ConfigDict(extra="ignore", populate_by_name=True)


class Answer(Wire):
    """Base of what a server sends. The real Silo sends null where it has nothing; that reads as unset."""

    model_config = ConfigDict(coerce_numbers_to_str=True)

    @model_validator(mode="before")
    @classmethod
    def _none_is_unset(cls, data: Any) -> Any:
        return {k: v for k, v in data.items() if v is not None} if type(data) is dict else data


class Record(Answer, Mapping[str, Any]):
    """An answer that also reads as a mapping: ``item["part_number"]`` and ``item.part_number`` are one.

    The spec's listings (and :mod:`silo.bom`) take mappings; people and type checkers like attributes.
    """

    def __getitem__(self, key: str) -> Any:
        if key not in type(self).model_fields:
            raise KeyError(key)
        return getattr(self, key)

    def __iter__(self) -> Iterator[str]:  # type: ignore[override]
        return iter(type(self).model_fields)

    def __len__(self) -> int:
        return len(type(self).model_fields)


def _known_source(value: Any) -> Any:
    # A line with an unknown source belongs to somebody: a merge may only change lines of an assembly.
    if isinstance(value, str):
        word = value.strip().lower() or "assembly"
        return word if word == "assembly" else "manual"
    return value


def _designators(value: Any) -> Any:
    return list(designators(value)) if isinstance(value, str) else value


# The spec writes 12, never 12.0; a server that counts in integers refuses the latter.
_Shortest = PlainSerializer(plain, return_type=int | float)


def _time_or_none(value: Any, read: ValidatorFunctionWrapHandler) -> Any:
    # A time stamp is only shown to people; an unreadable one must not spoil the whole answer.
    try:
        return read(value)
    except ValueError:
        return None


Time = Annotated[datetime | None, WrapValidator(_time_or_none)]
Number = Annotated[float, _Shortest, WithJsonSchema({"type": "number"})]
Quantity = Annotated[
    float,
    Field(gt=0, allow_inf_nan=False),
    _Shortest,
    WithJsonSchema({"type": "number", "exclusiveMinimum": 0}),
]


class ItemTexts(Wire):
    """The columns of an item that people write and nothing is computed from.

    A new column is a field here, and a column of the server's table with its migration. Requests, answers,
    the form, the page, the search and the schema follow. ``long``: several lines; ``options``: the choices.
    """

    sourcing_type: Annotated[
        str | None, Field(title="Sourcing", json_schema_extra={"options": ["manufactured", "purchased"]})
    ] = None
    long_description: Annotated[
        str | None, Field(title="Long description", json_schema_extra={"long": True})
    ] = None
    unit: Annotated[str | None, Field(title="Unit", json_schema_extra={"maxLength": 32, "word": False})] = (
        None
    )
    """In which its quantities are, and of one of which its price and mass are; None: in pieces."""


class Price(Wire):
    """What a piece costs if at least ``quantity`` are ordered; both are decimal numbers as text."""

    quantity: str
    price: str


class SupplierPart(Answer):
    """An item as a supplier sells it. Amounts are decimal numbers as text, for money is no float.

    pack_size, minimum
        what is ordered is a whole number of packs, and at least the minimum.
    preferred
        it is ordered even if another one is cheaper.
    """

    supplier: str
    number: str = ""
    link: str = ""
    pack_size: str = "1"
    minimum: str = "0"
    prices: list[Price] = Field(default_factory=list)
    currency: str = "EUR"
    lead_time_days: int | None = None
    preferred: bool = False


class PartFile(Answer):
    """A file of a part, and its path below ``/api/``; ``kind``: ``model``, or that of an attachment."""

    name: str
    path: str
    kind: str = "model"


class OrderPart(Answer):
    """A part of an order list; ``kind`` is ``bought``, ``made`` or ``unsaid``.

    total, needed, ordered
        what all pieces hold of it, with spares, and what was ordered already.
    price, cost
        of one, and of what is needed, in ``currency``; None if not known. ``cost_from``: where that is from.
    quantity, order_cost
        of what is bought, in whole packs, in the currency of the ``supplier_part``.
    """

    part_number: str
    name: str = ""
    kind: str
    unit: str | None = None
    total: str
    needed: str
    ordered: str = "0"
    price: str | None = None
    cost: str | None = None
    currency: str | None = None
    cost_from: str = ""
    quantity: str | None = None
    order_cost: str | None = None
    remarks: list[str] = Field(default_factory=list)
    files: list[PartFile] = Field(default_factory=list)
    supplier_part: SupplierPart | None = None


class OrderList(Answer):
    """What to order for so many pieces of a product (``GET …/order``). Amounts are as in a SupplierPart.

    costs
        of all parts, per currency, without the ``unpriced`` ones; ``total_cost`` is in the site's
        ``currency``, without the parts of a currency ``without_rate``.
    order_costs
        what is paid for what is bought, in whole packs, per currency.
    """

    part_number: str
    pieces: int = 1
    spares: str = "0"
    release: str | None = None
    state: str = ""
    warnings: list[str] = Field(default_factory=list)
    costs: dict[str, str] = Field(default_factory=dict)
    total_cost: str = "0"
    currency: str = "EUR"
    order_costs: dict[str, str] = Field(default_factory=dict)
    unpriced: int = 0
    without_rate: int = 0
    lead_time_days: int | None = None
    without_lead_time: int = 0
    parts: list[OrderPart] = Field(default_factory=list)


FACTS = ("mass_kg", "volume_m3", "com_m", "size_m", "material")
"""Properties whose origin is kept: a model states them, a scale does, or a user."""
FactSource = Literal["hand", "scale", "cad"]


class FactOrigin(Answer):
    """Where one of :data:`FACTS` comes from, and since when. What CAD says replaces only what CAD said."""

    source: FactSource = "hand"
    at: Time = None


class Item(ItemTexts, Record):
    """An item of the PLM. ``id`` is its stable UUID; the part number may be renamed."""

    id: str = Field(validation_alias=AliasChoices("id", "uuid"))
    part_number: str
    name: str = ""
    description: str = ""
    item_type: str = "part"
    current_revision: int = 0
    created_at: Time = None
    updated_at: Time = None
    thumbnail_key: str | None = None
    category: str | None = None
    bom_version: int | None = None
    last_sync: LastSync | None = None
    properties: dict[str, Any] = Field(default_factory=dict)
    supplier_parts: list[SupplierPart] = Field(default_factory=list)
    origins: dict[str, FactOrigin] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _name_or_description(self) -> Item:
        # The spec reads item["name"]; the real Silo's display text is `description`.
        if not self.name:
            self.name = self.description or self.part_number
        return self


class LineTexts(Wire):
    """The columns of a BOM line that people write and nothing is computed from.

    A new column is a field here and in the server's ``LineState``, a column of its table with its migration,
    and headers in :mod:`silo.bom.headers`. Requests, answers, form, page, history, export and import follow.
    """

    unit: Annotated[str | None, Field(title="Unit", json_schema_extra={"maxLength": 32})] = None
    find_number: Annotated[str | None, Field(title="Find number", json_schema_extra={"maxLength": 32})] = None
    notes: Annotated[str | None, Field(title="Notes", json_schema_extra={"long": True})] = None


class BomLine(LineTexts, Record):
    """A BOM line as the server has it. ``unreferenced_since`` is set while no assembly component uses it.

    ``child_unit``: the unit of the child, which a line without a ``unit`` is in, unless CAD counted it.
    ``unit_open``: the line's unit is of another kind than the child's, so that it counts in no sum.
    ``assembly_told``: the server has heard what the assembly says of this line that people own, namely
    ``assembly_quantity``; None where the server does not keep that.
    ``components``: what the line was in the CAD model of the last sync.
    """

    id: str | None = None
    parent_part_number: str | None = None
    child_part_number: str
    child_id: str | None = None
    child_name: str = ""
    child_description: str = ""
    child_item_type: str = ""
    child_unit: str | None = None
    rel_type: str = "component"
    quantity: Number | None = None
    total_quantity: Number | None = None
    reference_designators: Annotated[list[str], BeforeValidator(_designators)] = Field(default_factory=list)
    child_revision: int | None = None
    effective_revision: int | None = None
    source: Annotated[Source, BeforeValidator(_known_source)] = "assembly"
    unreferenced_since: Time = None
    override: bool = False
    unit_open: bool = False
    assembly_told: bool | None = None
    assembly_quantity: Number | None = None
    components: list[dict[str, Any]] = Field(default_factory=list)
    depth: int | None = None
    metadata: dict[str, Any] = Field(default_factory=dict)


class Component(Wire):
    """A component as the CAD model names it: ``file`` relative to the assembly's file, ``object`` in it."""

    file: str
    object: str = ""


class MergeEntry(Wire):
    """One direct child in a merge request. ``components``: what it is in the CAD model, for the next sync.

    ``find_number``: what the CAD model proposes for a new line; a number that another line has is not taken.
    """

    child_part_number: str = Field(min_length=1)
    quantity: Quantity
    source: str = "assembly"
    components: list[Component] | None = None
    find_number: str | None = None


class LeftOutPart(Wire):
    """Something that the assembly holds and the request does not (:class:`silo.bom.left_out.LeftOut`)."""

    reason: str
    name: str = ""
    file: str = ""
    object: str = ""
    quantity: Number = 0
    message: str = ""


class HeldBom(Answer):
    """A BOM that waits on a designer's computer: since when, whose it is, and what holds it."""

    since: Time = None
    user: str = ""
    left_out: list[LeftOutPart] = Field(default_factory=list)
    document_file: str | None = None


class LastSync(Answer):
    """The last merge of an item's BOM: when (None: never), and what it left out; ``held``: a later BOM."""

    at: Time = None
    left_out: list[LeftOutPart] = Field(default_factory=list)
    held: HeldBom | None = None


class SourceDocument(Wire):
    """Which file a BOM was taken from, for the history; ``folder`` is its project's, as ``robot/arm``."""

    file: str
    folder: str | None = None
    sha256: str | None = None
    revision: int | None = None


class MergeRequest(Wire):
    """``POST /api/items/{partNumber}/bom/merge``. ``sync_id`` makes a repeat harmless.

    ``left_out``: what the assembly holds and ``entries`` does not; None says nothing about it.
    """

    source: str = "assembly"
    entries: list[MergeEntry]
    sync_id: str | None = None
    dry_run: bool = False
    document: SourceDocument | None = None
    left_out: list[LeftOutPart] | None = None

    @model_serializer(mode="wrap")
    def _as_the_spec(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # `dry_run` is ours; without it, the request is exactly the spec's.
        data: dict[str, Any] = write(self)
        return data if self.dry_run else {key: value for key, value in data.items() if key != "dry_run"}


class HeldReport(Wire):
    """``POST /api/items/{partNumber}/bom/held``: the client cannot send this BOM, and why."""

    left_out: list[LeftOutPart]
    document: SourceDocument | None = None


class QuantityLine(Answer):
    """A part number with its quantity."""

    part_number: str
    quantity: Number | None = None


class QuantityUpdate(Answer):
    """A part number with its quantity before and after."""

    part_number: str
    old_quantity: Number | None = None
    new_quantity: Number


class MergeDiff(Answer):
    """What a merge did, or would do. ``unchanged_count`` is the real Silo's short form in events."""

    added: list[QuantityLine] = Field(default_factory=list)
    removed: list[QuantityLine] = Field(default_factory=list)
    quantity_changed: list[QuantityUpdate] = Field(default_factory=list)
    unchanged: list[QuantityLine] = Field(default_factory=list)
    unchanged_count: int | None = Field(default=None, exclude=True)


class MergeWarning(Answer):
    """``unreferenced`` or ``conflict``; for a conflict both quantities are given."""

    type: str
    part_number: str
    message: str = ""
    assembly_quantity: Number | None = None
    server_quantity: Number | None = None


class Draft(Record):
    """What a change of a released product is part of: the coming revision; ``released`` stays as it is."""

    label: str
    released: str


class _Merged(Answer):
    """What answer and event of a merge share."""

    diff: MergeDiff = Field(default_factory=MergeDiff)
    resolve_url: str = ""
    sync_id: str | None = None
    warnings: list[MergeWarning] = Field(default_factory=list)
    left_out: list[LeftOutPart] | None = None


class MergeResult(_Merged):
    """The answer to a merge request."""

    status: str = "merged"
    version: int | None = None
    draft: Draft | None = None


class MergeEvent(_Merged):
    """The SSE event of a merge: the spec's ``bom_merge``, or the real Silo's ``bom.merged``."""

    type: str = "bom_merge"
    item: str = Field(validation_alias=AliasChoices("item", "part_number"))
    user: str = ""
    timestamp: Time = None
    summary: str = ""


class MissingValues(Answer):
    """How many parts lack a value, and the first of them."""

    count: int = 0
    first: list[str] = Field(default_factory=list)


class CostTotal(Answer):
    """What the parts with a cost in one currency cost."""

    currency: str
    total_cost: Number


class ProductSummary(Answer):
    """What the server keeps of a product over all levels (``GET …/bom/summary``).

    open, incomplete
        part number of a BOM → what a user has to decide there, and what its last sync left out.
    total_mass_kg, totals
        without what ``mass_missing`` and ``cost_missing`` count.
    """

    part_number: str
    open: dict[str, str] = Field(default_factory=dict)
    incomplete: dict[str, str] = Field(default_factory=dict)
    parts: int = 0
    total_mass_kg: Number | None = None
    totals: list[CostTotal] = Field(default_factory=list)
    mass_missing: MissingValues = MissingValues()
    cost_missing: MissingValues = MissingValues()


class ProductChange(Answer):
    """One thing that changed in a product: ``what`` is added, removed, quantity or line (of the BOM
    ``within``), data or file. ``at`` and ``username`` are empty for two
    frozen revisions."""

    what: str
    within: str = ""
    part_number: str
    name: str = ""
    before: str = ""
    after: str = ""
    at: Time = None
    username: str = ""


class ProductChanges(Answer):
    """What changed in a product over all levels (``GET …/bom/changes``)."""

    part_number: str
    since: Time = Field(default=None, validation_alias="from")
    to: Time = None
    changes: list[ProductChange] = Field(default_factory=list)


class ErrorBody(Answer):
    """The one shape of every HTTP error. ``problems`` lists all bad entries at once, with their index.

    ``revision``: with the code ``newer_revision``, the one that the request does not know.

    ``message`` is the English sentence. ``template``, ``plural`` and ``values`` make the same sentence,
    also in another language; ``problem_messages`` has them for each entry of ``problems``, {} for a plain
    sentence.
    """

    error: str
    message: str = ""
    template: str | None = None
    plural: str | None = None
    values: dict[str, Any] | None = None
    problems: list[str] = Field(default_factory=list)
    problem_messages: list[dict[str, Any]] = Field(default_factory=list)
    path: list[str] = Field(default_factory=list)
    revision: dict[str, Any] | None = None


class LinkedFile(Wire):
    """A file that a FreeCAD file links to.

    path
        as the link records it: relative to the folder of the linking file, with ``/``.
    item, sha256
        the UUID of its item and the hash of its content when the linking file was committed; "" where that
        was not known.
    document
        the UUID of its document, for a file that is no single item's.
    """

    path: str = Field(min_length=1, max_length=1000)
    item: str = Field(default="", max_length=64)
    sha256: str = Field(default="", pattern="^([0-9a-f]{64})?$")
    document: str = Field(default="", max_length=64)


class HeldItem(Wire):
    """An item in a file: its UUID, and the name of the object that it is; "" for the file as a whole."""

    item: str = Field(max_length=64)
    object: str = Field(default="", max_length=200)
    part_number: str = ""


class Revision(Record):
    """A revision of an item; ``file_checksum`` is the SHA-256 of its file, in hex.

    base_revision
        the revision that the file was made from; None if not stated.
    file_path
        where the file was, relative to the folder that holds it and all that it links to.
    links
        the files that it links to; only where one revision is asked for.
    draft
        in the answer to an upload, if a revision of the item is released.
    kind
        ``model`` or a kind of attachment (:mod:`silo.file_kind`); None without a file, and where the server
        knows no kinds.
    document
        in the answer to an upload that became an attachment: the UUID of the attachment's document.
    """

    revision_number: int = Field(validation_alias=AliasChoices("revision_number", "revision", "number"))
    file_key: str | None = None
    file_name: str | None = Field(default=None, validation_alias=AliasChoices("file_name", "filename"))
    file_checksum: str | None = Field(
        default=None, validation_alias=AliasChoices("file_checksum", "checksum", "sha256")
    )
    file_size: int | None = None
    comment: str = ""
    status: str = "draft"
    labels: list[str] = Field(default_factory=list)
    properties: dict[str, Any] = Field(default_factory=dict)
    created_by: str | None = None
    created_at: Time = None
    base_revision: int | None = None
    file_path: str | None = None
    links: list[LinkedFile] = Field(default_factory=list)
    draft: Draft | None = None
    kind: str | None = None
    document: str | None = None


class Document(Revision):
    """A file of a project as it is now: its UUID, with the fields of its newest revision.

    part_number
        of the item whose revisions are those of the file; "" for a file of several items, or of none.
    holds
        the items in it.
    linked, used_by
        the documents that it links to, and those that link to it; only if one document is asked for.
    """

    id: str
    part_number: str = ""
    holds: list[HeldItem] = Field(default_factory=list)
    linked: list[Document] = Field(default_factory=list)
    used_by: list[Document] = Field(default_factory=list)


class KnownContent(Record):
    """A content that a revision in Silo has: whose revision that is, and which document the file is now.

    document, revision_number, file_path
        the revision that has the content.
    now, part_number
        the document that the file became since (it was registered, split, or taken out of its item), or the
        same; and its part number, "" without one.
    """

    sha256: str
    document: str
    revision_number: int
    file_path: str | None = None
    now: str
    part_number: str = ""


class Approval(Record):
    """Who approved a revision of a product, when, with which words."""

    username: str
    at: Time = None
    comment: str = ""


class Attachment(Record):
    """A file beside the model of an item, with the fields of its newest revision.

    id
        the UUID of its document, which has its revisions.
    kind
        ``drawing``, ``step``, ``data_sheet``, ``picture``, ``certificate`` or ``other``.
    """

    id: str
    part_number: str = ""
    kind: str = "other"
    revision_number: int = Field(default=0, validation_alias=AliasChoices("revision_number", "revision"))
    file_name: str = Field(default="", validation_alias=AliasChoices("file_name", "filename", "name"))
    file_checksum: str | None = Field(
        default=None, validation_alias=AliasChoices("file_checksum", "checksum", "sha256")
    )
    file_size: int | None = Field(default=None, validation_alias=AliasChoices("file_size", "size"))
    comment: str = ""
    created_by: str | None = None
    created_at: Time = None


class FrozenFile(Record):
    """A file as it was when a product was frozen: a revision of a document, its place, its content.

    kind, part_number
        of an attachment: what it is, and the item that it lies at.
    """

    document: str
    revision: int
    file_name: str = ""
    file_path: str | None = None
    sha256: str = ""
    size: int = 0
    kind: str = "model"
    part_number: str = ""


# A whole number is no label: it means a revision of a file.
RELEASE_LABEL = r"[A-Za-z][A-Za-z0-9._-]{0,15}|[0-9]{1,7}\.[0-9]{1,7}"


class Release(Record):
    """A revision of a product that was submitted for release; ``record`` names what was frozen of it.

    status
        ``review``, ``released``, ``obsolete``, ``rejected`` or ``withdrawn``.
    blocks
        what keeps it from being released, or kept it when it was, in sentences.
    revision, files, attachments
        the item's revision in it, all models of the product, and all attachments of its items; only if one
        release is asked for.
    """

    label: str
    status: str
    record: str = ""
    with_parts: bool = False
    blocks: list[str] = Field(default_factory=list)
    comment: str = ""
    frozen_at: Time = None
    created_by: str = ""
    ended_at: Time = None
    ended_by: str | None = None
    note: str = ""
    override: str | None = None
    approvals: list[Approval] = Field(default_factory=list)
    revision: int | None = None
    files: list[FrozenFile] = Field(default_factory=list)
    attachments: list[FrozenFile] = Field(default_factory=list)


Finite = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]


class Use(Wire):
    """One placed use of a product (decision 24): ``member`` shows it, ``file`` and ``target`` name it.

    matrix
        row by row, in metres, from the target's axes to those of the product that holds the use.
    color
        RGBA that the link puts over all below it.
    """

    member: str = Field(max_length=400)
    file: str = Field(default="", max_length=1000)
    target: str = Field(max_length=1000)
    uuid: str = Field(default="", max_length=64)
    matrix: Annotated[list[Finite], Field(min_length=16, max_length=16)]
    color: Annotated[list[Share], Field(min_length=4, max_length=4)] | None = None

    @model_validator(mode="after")
    def _is_affine(self) -> Use:
        if self.matrix[12:] != [0, 0, 0, 1]:
            raise ValueError("wanted 0 0 0 1 as the last row of the matrix")
        return self


Amount = Annotated[float, Field(gt=0, le=1e12, allow_inf_nan=False)]
Point = Annotated[list[Finite], Field(min_length=3, max_length=3)]


class Stated(Wire):
    """What a file states of a product (:data:`FACTS`, and the object's description), in its own axes."""

    mass_kg: Amount | None = None
    volume_m3: Amount | None = None
    com_m: Point | None = None
    size_m: Point | None = None
    material: str | None = Field(default=None, max_length=200)
    description: str | None = Field(default=None, max_length=1000)


class ModelProduct(Wire):
    """A product of a file: what it shows; ``shape``: it is drawn in the file's geometry."""

    label: str = Field(default="", max_length=1000)
    uuid: str = Field(default="", max_length=64)
    shape: bool = False
    stated: Stated | None = None
    uses: list[Use] = Field(default_factory=list, max_length=100_000)


class Structure(Wire):
    """What a FreeCAD file shows, by the keys of its products; the first root is the file as a whole."""

    format: Literal[1] = 1
    roots: list[Annotated[str, Field(max_length=1000)]] = Field(default_factory=list, max_length=20_000)
    products: dict[Annotated[str, Field(max_length=1000)], ModelProduct] = Field(
        default_factory=dict, max_length=20_000
    )


class SceneGeometry(Record):
    """The geometry of a file in a scene: its content, where it is, how many bytes it has on the wire."""

    id: str
    url: str
    bytes: int


class Occurrence(Record):
    """A placed product that is drawn.

    path, lines
        the members from the top, and the part number of each; "" for what is no item.
    geometry, key
        an index into the scene's geometries (None: there is none yet), and the product's key in it.
    matrix
        column by column, in metres, to the axes of the top.
    """

    path: list[str]
    lines: list[str]
    part_number: str = ""
    label: str = ""
    geometry: int | None = None
    key: str
    matrix: list[float]
    color: list[float] | None = None


class NotDrawn(Record):
    """What a scene lacks, and why."""

    part_number: str = ""
    label: str = ""
    why: str


class Scene(Record):
    """``GET /api/items/{partNumber}/scene``: where each part of a product stands, and who has no picture."""

    part_number: str
    revision: int
    geometries: list[SceneGeometry] = Field(default_factory=list)
    occurrences: list[Occurrence] = Field(default_factory=list)
    without_picture: list[str] = Field(default_factory=list)
    missing: list[NotDrawn] = Field(default_factory=list)


class User(Record):
    """Who a token belongs to."""

    username: str
    display_name: str = ""
    role: str = ""
    auth_source: str = ""


class ServerState(Record):
    """``GET /ready`` and the ``server.state`` event: ``normal``, ``read-only`` or ``degraded``.

    takes_item_ids
        a new item gets the UUID that the client proposes.
    device_login
        a program can be let in as RFC 8628 has it: ``POST /api/auth/device``.
    freecad
        the FreeCAD that the team works with, such as "1.0"; "" if not stated.
    """

    mode: str = "normal"
    status: str = ""
    version: str = ""
    sse_clients: int | None = None
    takes_item_ids: bool = False
    device_login: bool = False
    freecad: str = ""


class HowReached(Record):
    """How a request reached the server, as the server saw it."""

    scheme: str = ""
    address: str = ""
    forwarded_for: str = ""


class LastBackup(Record):
    """``same_disk``: it lies on the disk of the server's files; None if the server does not say."""

    at: str
    target: str = ""
    same_disk: bool | None = None


class TriedRestore(Record):
    """A test restore: when, and of the backup of which time."""

    at: str
    made_at: str = ""


class SystemState(Record):
    """``GET /api/admin/system``, as far as ``silo-mod doctor`` asks."""

    at: str = ""
    request: HowReached | None = None
    public_url: str | None = None
    secure_cookies: bool | None = None
    open_secrets: list[str] | None = None
    free_bytes: int | None = None
    database_bytes: int = 0
    backup: LastBackup | None = None
    restore_tried: TriedRestore | None = None
    warnings: list[str] = []


class DeviceCodes(Answer):
    """``POST /api/auth/device``, as RFC 8628, 3.2 has it. ``device_code`` is the program's secret."""

    device_code: str = Field(min_length=1)
    user_code: str
    verification_uri: str
    verification_uri_complete: str = ""
    expires_in: float = 600
    interval: float = 5


class DeviceToken(Answer):
    """``POST /api/auth/device/token``: the token, or why there is none (RFC 8628, 3.5)."""

    access_token: str = ""
    error: str = ""
