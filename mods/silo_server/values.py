# SPDX-License-Identifier: LGPL-2.1-or-later
"""The server's own frozen values, between the services and whoever shows them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple, TypeVar

from silo_server.clock import wire

T = TypeVar("T")


class Role(StrEnum):
    """Who may do what; each role includes the ones before it."""

    VIEWER = "viewer"  # reads everything, manages the own tokens
    EDITOR = "editor"  # changes items, BOMs and files
    ADMIN = "admin"  # users, mode, audit

    def covers(self, needed: Role) -> bool:
        """True where this role may do what ``needed`` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class Scope(StrEnum):
    """What a token may be used for, at most; each scope includes the ones before it."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"

    @property
    def role(self) -> Role:
        """The role beyond which this scope does not go."""
        return {Scope.READ: Role.VIEWER, Scope.WRITE: Role.EDITOR, Scope.ADMIN: Role.ADMIN}[self]

    def covers(self, wanted: Scope) -> bool:
        """True where this scope includes ``wanted``."""
        return self.role.covers(wanted.role)


@dataclass(frozen=True, slots=True)
class Actor:
    """Who does something, and from where.

    role
        what this caller may do: the user's role, or less where the token's scope is narrower.
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
        """The user's id; every caller that a guard let in is a user."""
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
    ``version`` its own. ``created_as``: the number (case-folded) that it was asked for under."""

    id: int
    uuid: str
    part_number: str
    name: str
    description: str
    item_type: str
    schema: str | None
    category: str | None
    sourcing_type: str | None
    long_description: str | None
    thumbnail_key: str | None
    properties: Mapping[str, Any]
    current_revision: int
    bom_version: int
    version: int
    created_as: str | None
    created_at: str
    created_by: str
    updated_at: str
    updated_by: str
    archived_at: str | None


@dataclass(frozen=True, slots=True)
class Revision:
    """A revision of an item: a property snapshot and, where one was uploaded, a file.

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
    """The names of the fields of a frozen value's class."""
    names: Iterable[str] = kind.__dataclass_fields__  # dataclasses.fields() makes a new tuple for each row
    return names


def from_row(kind: type[T], row: Any, /, **given: Any) -> T:
    """A frozen value from a row whose columns have the names of its fields; ``given`` wins over them."""
    return kind(**given, **{name: getattr(row, name) for name in names_of(kind) if name not in given})


def to_wire(value: Any, *left_out: str) -> dict[str, Any]:
    """The fields of a frozen value, under their own names, as the API sends them."""
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
