# SPDX-License-Identifier: LGPL-2.1-or-later
"""The server's own frozen values, between the services and what shows them.

JSON that users give us (properties, a line's metadata): what is let in, and how it is stored.

One guard (:func:`json_problem`) stands on every way in. What it accepts, :func:`dumps` and
``routes.context.json_answer`` can always write.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from enum import StrEnum
from typing import Any, NamedTuple, TypeVar

from silo.bom.errors import RejectedError
from silo.bom.resolve import character_problem
from silo_server.settings import wire

MAX_DEPTH = 32
MAX_BYTES = 256 * 1024
MAX_KEY = 200
# JSON does not tell 1e300 from a whole number of 301 digits, and so neither do we: what a double can hold.
MAX_NUMBER = sys.float_info.max
# The same as it is written, which is what the API document's readers compare with.
_MAX_WHOLE = int(Decimal(repr(MAX_NUMBER)))


def dumps(value: Any) -> str:
    """Write compact JSON text, as it is stored and sent."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def json_problem(value: Any) -> str | None:
    """Say what is wrong with a JSON value that a user gave; None if nothing is."""
    stack = [(value, 1)]
    while stack:
        part, depth = stack.pop()
        if depth > MAX_DEPTH and isinstance(part, dict | list | tuple):
            return f"wanted at most {MAX_DEPTH} levels of nesting, got more"
        if isinstance(part, dict):
            for key in part:
                if problem := character_problem(key):
                    return problem
                if len(key) > MAX_KEY:
                    return f"wanted keys of at most {MAX_KEY} characters, got {key[:60]!r}"
            stack.extend((below, depth + 1) for below in part.values())
        elif isinstance(part, list | tuple):
            stack.extend((below, depth + 1) for below in part)
        elif problem := _scalar_problem(part):
            return problem
    size = len(dumps(value).encode())
    if size > MAX_BYTES:
        return f"wanted at most {MAX_BYTES // 1024} KiB of JSON, got {size // 1024} KiB"
    return None


def check_json(name: str, value: Any) -> None:
    """Raise RejectedError, naming the field, unless the value may be stored."""
    problem = json_problem(value)
    if problem is not None:
        raise RejectedError(f"{name}: {problem}", [f"{name}: {problem}"])


def merge_patch(target: Any, patch: Any) -> Any:
    """Apply a JSON merge patch (RFC 7386) to ``target``: null removes a member, objects merge.

    The patch has passed the guard, which bounds how deep this goes.
    """
    if not isinstance(patch, dict):
        return patch
    merged = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge_patch(merged.get(key), value)
    return merged


def _scalar_problem(value: Any) -> str | None:
    if isinstance(value, str):
        return character_problem(value)
    if isinstance(value, float) and not math.isfinite(value):
        return f"wanted finite numbers, got {value}"
    if isinstance(value, int) and not -_MAX_WHOLE <= value <= _MAX_WHOLE:
        return "wanted numbers of at most 309 digits, got a longer one; send it as text"
    return None


T = TypeVar("T")


class Role(StrEnum):
    """Who may do what; each role includes the ones before it."""

    VIEWER = "viewer"  # reads everything, manages the own tokens
    EDITOR = "editor"  # changes items, BOMs and files
    ADMIN = "admin"  # users, mode, audit

    def covers(self, needed: Role) -> bool:
        """Return True if this role may do what ``needed`` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class Scope(StrEnum):
    """What a token may be used for, at most; each scope includes the ones before it."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"

    @property
    def role(self) -> Role:
        """Return the highest role that a token of this scope can have."""
        return {Scope.READ: Role.VIEWER, Scope.WRITE: Role.EDITOR, Scope.ADMIN: Role.ADMIN}[self]

    def covers(self, wanted: Scope) -> bool:
        """Return True if this scope includes ``wanted``."""
        return self.role.covers(wanted.role)


@dataclass(frozen=True, slots=True)
class Actor:
    """Who does something, and from where.

    role
        what this caller may do: the user's role, or less if the token's scope is narrower.
    scope, expires_at
        those of the token (``auth_source`` token); ``expires_at`` None = until it is revoked.
    by_link
        a session that a login link began: the user may set a password without naming the old one.
    """

    username: str
    role: Role
    user_id: int | None = None
    display_name: str = ""
    auth_source: str = "local"
    address: str = ""
    csrf_token: str | None = None
    session_hash: str | None = None
    scope: Scope = Scope.ADMIN
    expires_at: str | None = None
    by_link: bool = False

    @property
    def by_token(self) -> bool:
        return self.auth_source == "token"

    @property
    def own_id(self) -> int:
        """Return the user's id; each caller that a guard let in is a user."""
        assert self.user_id is not None
        return self.user_id


SYSTEM = Actor("system", Role.ADMIN, auth_source="system")


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
    knows."""

    id: int
    uuid: str
    item_id: int | None
    current_revision: int
    created_at: str
    created_by: str

    @property
    def subject(self) -> str:
        """Return the name of the document for messages."""
        return f"document {self.uuid}"


@dataclass(frozen=True, slots=True)
class Revision:
    """A revision of an item: a property snapshot and, if one was uploaded, a file; or one of a document.

    base_revision, file_path, links
        what the client said of the file (:class:`silo.api.wire.Revision`).
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


@dataclass(frozen=True, slots=True)
class LineState:
    """Everything on a BOM line that can change; what history stores before and after.

    source
        ``assembly`` or ``manual``.
    unreferenced_since
        since when no component of the assembly uses it (assembly lines only).
    override, cad_quantity
        an assembly line whose quantity a person changed, and what the assembly had said.
    reason
        why a person keeps it as an intentional, non-CAD line.
    """

    quantity: float
    source: str
    rel_type: str = "component"
    unit: str | None = None
    reference_designators: tuple[str, ...] = ()
    find_number: str | None = None
    notes: str | None = None
    child_revision: int | None = None
    unreferenced_since: str | None = None
    override: bool = False
    cad_quantity: float | None = None
    reason: str | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)


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
    state: LineState


def names_of(kind: Any) -> Iterable[str]:
    """Return the names of the fields of a frozen value's class."""
    names: Iterable[str] = kind.__dataclass_fields__  # dataclasses.fields() makes a new tuple for each row
    return names


def from_row(kind: type[T], row: Any, /, **given: Any) -> T:
    """Make a frozen value from a row with columns named as its fields; ``given`` wins over the row."""
    values = row._asdict() | given  # in half the time of an attribute for each
    return kind(**{name: values[name] for name in names_of(kind)})


def to_wire(value: Any, *left_out: str) -> dict[str, Any]:
    """Return the fields of a frozen value as the API sends them, under their own names."""
    kind = type(value)
    if kind not in _TIMES:
        # Found once for each class: a BOM has thousands of lines.
        _TIMES[kind] = {
            name: name in ("at", "since") or name.endswith(("_at", "_since")) for name in names_of(kind)
        }
    return {
        name: wire(getattr(value, name)) if is_time else getattr(value, name)
        for name, is_time in _TIMES[kind].items()
        if name not in left_out
    }


_TIMES: dict[type, dict[str, bool]] = {}  # class → field → whether it is a time
