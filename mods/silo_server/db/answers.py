# SPDX-License-Identifier: LGPL-2.1-or-later
"""Answers that are kept for repeated requests: key → hash of the whole request → answer.

The key is ``sync_id`` in a merge, ``Idempotency-Key`` in an upload and an import, the UUID of a new item. A
client whose connection broke sends the request again and gets the first answer. Another request under the
same key is refused: the answer to the first would drop its content in silence. Housekeeping deletes old
answers.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

from sqlalchemy import insert, select

from silo.bom.errors import ConflictError
from silo.bom.message import message
from silo_server.db.tables import answers
from silo_server.db.transaction import Tx


@dataclass(frozen=True, slots=True)
class KeyedRequest:
    """A request that may come again.

    subject
        what it is about (``merge 12``: internal id), within which the ``key`` is unique.
    """

    subject: str
    key: str
    hash: str

    @classmethod
    def of(cls, subject: str, key: str | None, *content: Any) -> KeyedRequest | None:
        """Make the request with this content (JSON values); None if the request has no key."""
        if not key:
            return None
        written = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return cls(subject, key, hashlib.sha256(written.encode()).hexdigest())


@dataclass(frozen=True, slots=True)
class KeptAnswer:
    """What was answered: text, version, and the change of a BOM that the text needs to be whole."""

    text: str
    version: int = 0
    change_id: int | None = None


def earlier_answer(tx: Tx, request: KeyedRequest | None) -> KeptAnswer | None:
    """Find the answer that the same request got before; None if there was none.

    The caller holds a lock that makes two repeats wait for one another. ConflictError if the key
    was used for another request.
    """
    if request is None:
        return None
    row = tx.conn.execute(
        select(answers).where(answers.c.subject == request.subject, answers.c.key == request.key)
    ).one_or_none()
    if row is None:
        return None
    if row.request_hash != request.hash:
        name = {"merge": "sync_id", "item": "id"}.get(request.subject.partition(" ")[0], "Idempotency-Key")
        raise ConflictError(
            message(
                "{name} {key} was used before for another request, which was carried out; send a new one "
                "with new content",
                name=name,
                key=repr(request.key),
            )
        )
    return KeptAnswer(row.answer, row.version, row.change_id)


def keep_answer(tx: Tx, request: KeyedRequest | None, answer: KeptAnswer) -> None:
    """Keep the answer to a request that was carried out, together with what it changed."""
    if request is not None:
        tx.conn.execute(
            insert(answers).values(
                subject=request.subject,
                key=request.key,
                request_hash=request.hash,
                answer=answer.text,
                version=answer.version,
                change_id=answer.change_id,
                at=tx.stamp,
            )
        )
