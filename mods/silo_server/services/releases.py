# SPDX-License-Identifier: LGPL-2.1-or-later
"""Released revisions of a product: draft → in review → released → obsolete.

A submission freezes the whole product (:mod:`silo_server.services.product.frozen`). A revision is a label and
the record of the product, so nothing that happens later changes it, and no retention touches it. Reviewers
approve exactly what was frozen.

**What blocks.** Open questions and incomplete syncs on any level, parts of our own without a file, and parts
and assemblies whose frozen record is not released. An approver may override that with a reason, unless
the site forbids it (``SILO_RELEASE_OVERRIDE``), or releases the parts with the product (``with_parts``).
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, islice, product
from typing import Any, NamedTuple

from sqlalchemy import func, insert, select, update

from silo.api.wire import RELEASE_LABEL, ItemTexts
from silo.bom.errors import ConflictError, ForbiddenError, NotFoundError, RejectedError
from silo.bom.message import Message, beside, joined, message, read_beside
from silo.bom.text import character_problem
from silo_server.actors import Actor, Role, Scope
from silo_server.db.rows import insert_rows, one_of
from silo_server.db.tables import (
    frozen_items,
    items,
    release_approvals,
    releases,
    users,
)
from silo_server.db.transaction import Tx
from silo_server.errors import TooLargeError
from silo_server.events import announce
from silo_server.fields import from_row
from silo_server.services import audit
from silo_server.services.bom.find_numbers import forget_gone
from silo_server.services.items import get_item
from silo_server.user_json import dumps
from silo_server.values import Item

# Letters that are read as digits are left out.
_LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ"
NUMBERED = ("review", "released", "obsolete")
MOST_BLOCKS = 200


@dataclass(frozen=True, slots=True)
class Release:
    """A revision of a product that was submitted.

    status
        ``review``, ``released``, ``obsolete``, or ``rejected`` and ``withdrawn`` without a release.
    record
        SHA-256 of what was frozen at ``frozen_at``.
    with_parts
        parts and assemblies that are not released yet are released with it.
    blocks
        what was open in the product when it was frozen, in sentences.
    note, override
        the last comment, and why it was released in spite of what blocks.
    """

    id: int
    label: str
    status: str
    record: str
    with_parts: bool
    blocks: Sequence[str]
    comment: str
    frozen_at: str
    created_by: str
    ended_at: str | None
    ended_by: str | None
    note: str
    override: str | None


@dataclass(frozen=True, slots=True)
class Approval:
    """Who approved, when, with which words."""

    username: str
    at: str
    comment: str


class FrozenProduct(NamedTuple):
    """A product as it was read at ``at``: its record, and those of all that is in it, by their hashes."""

    record: str
    records: Mapping[str, str]
    blocks: Sequence[str]
    at: str


def labels(scheme: str) -> Iterator[str]:
    """Yield the labels of a scheme in order: ``letters`` A, B, …, Z, AA, … or ``numbers`` 1.0, 2.0, …"""
    if scheme == "numbers":
        yield from (f"{number}.0" for number in count(1))
    for length in count(1):
        yield from map("".join, product(_LETTERS, repeat=length))


def next_label(taken: Collection[str], scheme: str) -> str:
    """Find the label that comes after the last taken one in the scheme."""
    # Beyond so many labels of the scheme none can be taken.
    first = list(islice(labels(scheme), len(taken) + 1000))
    last = max((place for place, label in enumerate(first) if label in taken), default=-1)
    return first[last + 1]


def list_releases(tx: Tx, item: Item) -> list[Release]:
    """Read all revisions of an item that were ever submitted, newest first."""
    row = releases.c
    rows = tx.conn.execute(select(releases).where(row.item_id == item.id).order_by(row.id.desc()))
    return [_release(record) for record in rows]


def _release(row: Any) -> Release:
    return from_row(Release, row, blocks=tuple(map(_read_block, json.loads(row.blocks))))


def _read_block(stored: str | Mapping[str, Any]) -> str:
    """Read what was open: with its template and values, or the sentence alone of an older release."""
    return stored if isinstance(stored, str) else read_beside(stored)


def find_release(tx: Tx, item: Item, label: str) -> Release | None:
    """Find the revision with this label; None if there is none."""
    if character_problem(label):
        return None  # PostgreSQL refuses to look for some of these
    row = releases.c
    of_label = (row.item_id == item.id) & (row.label == label)
    query = select(releases).where(of_label, row.status.in_(NUMBERED))
    rows = tx.conn.execute(query).one_or_none()
    return None if rows is None else _release(rows)


def get_release(tx: Tx, item: Item, label: str) -> Release:
    """Find the revision with this label. Raises NotFoundError."""
    release = find_release(tx, item, label)
    if release is None:
        there = ", ".join(other.label for other in list_releases(tx, item) if other.status in NUMBERED)
        raise NotFoundError(
            message(
                "{part_number} has no revision {revision}; there is {known}",
                part_number=item.part_number,
                revision=repr(label),
                known=there or message("none yet"),
            )
        )
    return release


def approvals_of(tx: Tx, release: Release) -> list[Approval]:
    """Read the approvals of a revision, in order."""
    row = release_approvals.c
    query = select(release_approvals).where(row.release_id == release.id).order_by(row.at)
    return [from_row(Approval, record) for record in tx.conn.execute(query)]


class InReview(NamedTuple):
    """A revision that waits for approval: of which item, who submitted it, and who approved it so far."""

    part_number: str
    name: str
    label: str
    comment: str
    frozen_at: str
    created_by: str
    approved_by: Sequence[str]


def reviews(tx: Tx) -> list[InReview]:
    """Find all revisions in review, the oldest first."""
    row, item, given = releases.c, items.c, release_approvals.c
    shown = (row.id, item.part_number, item.name, row.label, row.comment, row.frozen_at, row.created_by)
    query = select(*shown).join(items, item.id == row.item_id).where(row.status == "review").order_by(row.id)
    found = tx.conn.execute(query).all()
    of_them = select(given.release_id, given.username).where(
        one_of(tx, given.release_id, {r.id for r in found})
    )
    approved: dict[int, list[str]] = {}
    for release_id, username in tx.conn.execute(of_them.order_by(given.at)):
        approved.setdefault(release_id, []).append(username)
    return [InReview(*record[1:], approved_by=approved.get(record.id, [])) for record in found]


def review_count(tx: Tx) -> int:
    """Count the revisions in review."""
    query = select(func.count()).select_from(releases).where(releases.c.status == "review")
    return tx.conn.scalar(query) or 0


def may_approve(tx: Tx, actor: Actor) -> bool:
    """Report whether a user has the right to approve."""
    row = users.c
    return bool(tx.conn.scalar(select(row.approver).where(row.id == actor.user_id, row.active)))


def reviews_for(tx: Tx, actor: Actor) -> list[InReview]:
    """Find the reviews that wait for this user: who has the right to approve, and has not approved yet."""
    if not may_approve(tx, actor):
        return []
    return [review for review in reviews(tx) if actor.username not in review.approved_by]


def newest_release(tx: Tx, item: Item) -> Release | None:
    """Find the revision that is released now; None if none is."""
    row = releases.c
    query = select(releases).where(row.item_id == item.id, row.status == "released")
    rows = tx.conn.execute(query.order_by(row.id.desc()).limit(1)).one_or_none()
    return None if rows is None else _release(rows)


def coming_label(tx: Tx, item: Item) -> str:
    """Find the label that the present draft of an item will get."""
    taken = [release.label for release in list_releases(tx, item) if release.status in NUMBERED]
    return next_label(taken, tx.settings.release_labels)


def draft_of(tx: Tx, item: Item) -> dict[str, str] | None:
    """Name the draft that a change of a released item is part of, and what stays released; or None."""
    released = newest_release(tx, item)
    return {"label": coming_label(tx, item), "released": released.label} if released else None


def item_of(made: Mapping[str, Any], number: int = 0, at: str = "", by: str = "") -> Item:
    """Make an item as it was frozen, from its record."""
    return Item(
        id=number,
        uuid=made["item"],
        part_number=made["part_number"],
        name=made.get("name", ""),
        description=made.get("description", ""),
        item_type=made.get("item_type", ""),
        schema=None,
        category=made.get("category"),
        texts={name: made.get(name) for name in ItemTexts.model_fields},
        thumbnail_key=made.get("thumbnail"),
        properties=made.get("properties", {}),
        current_revision=made.get("revision", 0),
        bom_version=0,
        version=0,
        created_at=at,
        created_by=by,
        updated_at=at,
        updated_by=by,
        archived_at=None,
        supplier_parts=made.get("supplier_parts", ()),
    )


def unreleased_parts(tx: Tx, record: str) -> list[str]:
    """Find parts of our own in a frozen product, with a file or lines, that are not released like that."""
    records = read_records(tx, record)
    wanted = {
        uuid
        for uuid, made in records.items()
        if uuid != record and (made["lines"] or made["files"]) and not item_of(made).is_bought
    }
    row = releases.c
    of_them = one_of(tx, row.record, wanted) & (row.status == "released")
    done = set(tx.conn.scalars(select(row.record).where(of_them)))
    return sorted(records[uuid]["part_number"] for uuid in wanted - done)


def blocks_of(tx: Tx, release: Release) -> list[str]:
    """List what keeps a submission from being released, in sentences."""
    parts = [] if release.with_parts else unreleased_parts(tx, release.record)
    return [
        *release.blocks,
        *(message("{part}: not released as it is in this product", part=part) for part in parts),
    ]


def submit(
    tx: Tx,
    part_number: str,
    frozen: FrozenProduct,
    comment: str,
    label: str = "",
    *,
    with_parts: bool = False,
) -> Release:
    """Put a frozen product up for review. Raises ConflictError if one is in review or the label is taken."""
    item = get_item(tx, part_number, lock=True)
    before = list_releases(tx, item)
    if waiting := next((other for other in before if other.status == "review"), None):
        raise ConflictError(
            message(
                "revision {revision} of {part_number} is in review since {date}; release, reject or "
                "withdraw it first",
                revision=waiting.label,
                part_number=item.part_number,
                date=waiting.frozen_at[:10],
            )
        )
    taken = [other.label for other in before if other.status in NUMBERED]
    label = label or next_label(taken, tx.settings.release_labels)
    if not re.fullmatch(RELEASE_LABEL, label, re.ASCII):
        raise RejectedError(
            message(
                "label: wanted a letter and up to 15 letters, digits or . _ -, or a number such as 1.0, "
                "got {label}",
                label=repr(label[:40]),
            )
        )
    if label.casefold() in map(str.casefold, taken):
        raise ConflictError(
            message(
                "{part_number} has a revision {revision}; leave the label to the server",
                part_number=item.part_number,
                revision=label,
            )
        )
    _keep(tx, frozen.records)
    blocks = frozen.blocks
    if len(blocks) > MOST_BLOCKS:
        blocks = [*blocks[:MOST_BLOCKS], message("and {n} more", n=len(blocks) - MOST_BLOCKS)]
    row = {
        "item_id": item.id,
        "label": label,
        "status": "review",
        "record": frozen.record,
        "with_parts": with_parts,
        "blocks": dumps([{"message": block, **beside(block)} for block in blocks]),
        "comment": comment,
        "frozen_at": frozen.at,
        "created_by": tx.actor.username,
        "note": "",
    }
    tx.conn.execute(insert(releases).values(row))
    release = get_release(tx, item, label)
    _announce(tx, item, release, "submitted")
    return release


def _keep(tx: Tx, records: Mapping[str, str]) -> None:
    row = frozen_items.c.hash
    there = set(tx.conn.scalars(select(row).where(one_of(tx, row, records.keys()))))
    insert_rows(tx, frozen_items, [{"hash": k, "record": v} for k, v in records.items() if k not in there])


def approve(tx: Tx, part_number: str, label: str, comment: str, override: str = "") -> Release:
    """Approve a revision in review; the last approval that the site requires releases it.

    override
        why it is released in spite of what blocks.

    Raises ForbiddenError, ConflictError (what blocks; it is not in review).
    """
    item, release = _in_review(tx, part_number, label)
    _check_right(tx)
    blocks = blocks_of(tx, release)
    override = override.strip() or release.override or ""
    if blocks and not override:
        shown = joined("; ", blocks[:5])
        shown += message("; and {n} more", n=len(blocks) - 5) if len(blocks) > 5 else ""
        way = (
            message("fix that and submit it again, or say why it is released anyway (override)")
            if tx.settings.release_override
            else message("fix that and submit it again")
        )
        raise ConflictError(
            message(
                "revision {revision} of {part_number} cannot be released: {problems}; {way}",
                revision=label,
                part_number=item.part_number,
                problems=shown,
                way=way,
            )
        )
    if blocks and not tx.settings.release_override:
        raise ForbiddenError(message("this server releases nothing that is blocked (SILO_RELEASE_OVERRIDE)"))
    given = approvals_of(tx, release)
    if tx.actor.username in {other.username for other in given}:
        raise ConflictError(
            message(
                "you approved revision {revision} already; {state}",
                revision=label,
                state=_approvals_text(tx, len(given)),
            )
        )
    approval = {"release_id": release.id, "username": tx.actor.username, "at": tx.stamp, "comment": comment}
    tx.conn.execute(insert(release_approvals).values(approval))
    if blocks:
        _change(tx, release, override=override)
    if len(given) + 1 < tx.settings.release_approvals:
        _announce(tx, item, release, "approved")
        return get_release(tx, item, label)
    if release.with_parts:
        _release_parts(
            tx,
            release,
            message(
                "with revision {revision} of {part_number}", revision=label, part_number=item.part_number
            ),
        )
    _make_released(tx, item, release)
    return get_release(tx, item, label)


def _make_released(tx: Tx, item: Item, release: Release) -> None:
    row = releases.c
    earlier = (row.item_id == item.id) & (row.status == "released")
    tx.conn.execute(update(releases).where(earlier).values(status="obsolete"))
    _change(tx, release, status="released", ended_at=tx.stamp, ended_by=tx.actor.username)
    forget_gone(tx, item)
    _announce(tx, item, release, "released")


def _release_parts(tx: Tx, release: Release, comment: str) -> None:
    numbers = set(unreleased_parts(tx, release.record))
    records = read_records(tx, release.record)
    for record, made in records.items():
        if made["part_number"] not in numbers or record == release.record:
            continue
        row = tx.conn.execute(select(items.c.part_number).where(items.c.uuid == made["item"])).one()
        item = get_item(tx, row.part_number, include_archived=True, lock=True)
        frozen = FrozenProduct(record, {}, (), release.frozen_at)
        part = submit(tx, item.part_number, frozen, comment)
        _make_released(tx, item, part)


def end(tx: Tx, part_number: str, label: str, status: str, note: str) -> Release:
    """Reject or withdraw a revision in review, or call a released one obsolete, with a comment."""
    if status == "withdrawn" and not tx.actor.role.covers(Role.EDITOR):
        raise ForbiddenError(
            message(
                "{username} is {role}, this needs editor",
                username=tx.actor.username,
                role=Message(tx.actor.role),
            )
        )
    if status == "obsolete":
        item = get_item(tx, part_number, include_archived=True, lock=True)
        release = get_release(tx, item, label)
        _check_right(tx)
        if release.status != "released":
            raise ConflictError(
                message(
                    "revision {revision} of {part_number} is {status}, not released",
                    revision=label,
                    part_number=item.part_number,
                    status=Message(release.status),
                )
            )
    else:
        item, release = _in_review(tx, part_number, label)
        if status == "rejected":
            _check_right(tx)
    ended = {"ended_at": tx.stamp, "ended_by": tx.actor.username} if status != "obsolete" else {}
    _change(tx, release, status=status, note=note, **ended)
    _announce(tx, item, release, status)
    return next(other for other in list_releases(tx, item) if other.id == release.id)


def _in_review(tx: Tx, part_number: str, label: str) -> tuple[Item, Release]:
    item = get_item(tx, part_number, include_archived=True, lock=True)
    release = get_release(tx, item, label)
    if release.status != "review":
        raise ConflictError(
            message(
                "revision {revision} of {part_number} is {status}, not in review",
                revision=label,
                part_number=item.part_number,
                status=Message(release.status),
            )
        )
    return item, release


def _check_right(tx: Tx) -> None:
    if not may_approve(tx, tx.actor):
        raise ForbiddenError(
            message(
                "{username} may not approve; an admin gives that right on the page Users",
                username=tx.actor.username,
            )
        )
    if not tx.actor.scope.covers(Scope.WRITE):
        raise ForbiddenError(message("a token of the scope read cannot approve"))


def _approvals_text(tx: Tx, given: int) -> str:
    wanted = tx.settings.release_approvals
    if wanted > 1:
        return message("{n} of {wanted} approvals are given", n=given, wanted=wanted)
    return message("it is released")


def _change(tx: Tx, release: Release, **values: Any) -> None:
    tx.conn.execute(update(releases).where(releases.c.id == release.id).values(values))


def _announce(tx: Tx, item: Item, release: Release, what: str) -> None:
    audit.note(tx, f"release.{what}", item.part_number, f"revision {release.label}")
    announce.released(tx, item, release.label, what)


def read_record(tx: Tx, record: str) -> dict[str, Any]:
    """Read one frozen item by its hash."""
    row = tx.conn.execute(select(frozen_items.c.record).where(frozen_items.c.hash == record)).one()
    frozen: dict[str, Any] = json.loads(row.record)
    return frozen


def read_records(tx: Tx, record: str) -> dict[str, dict[str, Any]]:
    """Read a frozen item and all that is in it, by their hashes, itself first. Raises TooLargeError."""
    records: dict[str, dict[str, Any]] = {}
    level, lines = {record}, 0
    while level:
        row = frozen_items.c
        rows = tx.conn.execute(select(frozen_items).where(one_of(tx, row.hash, level)).order_by(row.hash))
        read = {entry.hash: json.loads(entry.record) for entry in rows}
        records |= read
        lines += sum(len(entry["lines"]) for entry in read.values())
        if lines > tx.settings.max_expanded_rows:
            raise TooLargeError(
                message(
                    "this revision has more than {most} lines; look at one of its parts",
                    most=tx.settings.max_expanded_rows,
                )
            )
        level = (
            {line["child"] for entry in read.values() for line in entry["lines"]} - records.keys() - {None}
        )
    return records
