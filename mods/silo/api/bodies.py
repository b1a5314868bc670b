# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a client sends beside a merge: items, numbers, look-ups, lines (silo-contract §1.3, §1.5, §1.6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import Field, ValidationError

from silo.api.wire import Answer, BomLine, Quantity, Wire
from silo.bom.errors import InputError

Body = TypeVar("Body", bound=Wire)


class UuidsBody(Wire):
    """``POST /api/items/by-uuid``: many identities in one question."""

    uuids: list[str]


class NumbersBody(Wire):
    """``POST /api/items/boms``: the BOMs of many items in one question."""

    part_numbers: list[str]


class BomsAnswer(Answer):
    """Its answer: the lines of each item that is known, by the part number as it was asked for."""

    boms: dict[str, list[BomLine]]


class ItemBody(Wire):
    """``POST /api/items``. The server makes the part number from schema and category.

    ``id``, a UUID of the client's choice, makes a repeat harmless where the server honours it.
    """

    schema_name: str = Field(alias="schema", default="kindred-rd")
    category: str = Field(min_length=1)
    description: str = ""
    name: str | None = None
    item_type: str = "part"
    id: str | None = None
    projects: list[str] | None = None
    sourcing_type: str | None = None
    long_description: str | None = None
    properties: dict[str, Any] | None = None


class ItemChanges(Wire):
    """``PUT /api/items/{partNumber}``. With ``properties`` it makes a new revision, else in place."""

    part_number: str | None = None
    description: str | None = None
    name: str | None = None
    item_type: str | None = None
    sourcing_type: str | None = None
    long_description: str | None = None
    properties: dict[str, Any] | None = None
    comment: str | None = None


class NumberBody(Wire):
    """``POST /api/generate-part-number``: a preview, it may be asked as often as one likes."""

    schema_name: str = Field(alias="schema", default="kindred-rd")
    category: str = Field(min_length=1)


class NumberAnswer(Answer):
    """The number that the next item of this category would get."""

    part_number: str


class LineBody(Wire):
    """``POST …/bom`` and ``PUT …/bom/{child}``: a line as a person writes it.

    ``source`` is for a merge by single calls, on a server that has no other.
    """

    child_part_number: str | None = None
    quantity: Quantity | None = None
    unit: str | None = None
    rel_type: str | None = None
    find_number: str | None = None
    notes: str | None = None
    reference_designators: list[str] | None = None
    child_revision: int | None = None
    metadata: dict[str, Any] | None = None
    source: str | None = None


def body(kind: type[Body], values: Mapping[str, Any], thing: str) -> Body:
    """The values as a request; raises :class:`InputError` with all that does not fit at once."""
    unknown = sorted(set(values) - set(kind.model_fields) - {"schema"})
    if unknown:
        known = ", ".join(kind.model_fields)
        raise InputError(f"{', '.join(unknown)}: no field of {thing}; wanted some of {known}")
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
        raise InputError(f"these values do not fit {thing}: {wrong}") from error
