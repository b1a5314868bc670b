# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the calls of a client share: how a question becomes a request."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel

from silo.api.address import ServerAddress
from silo.api.multipart import as_json
from silo.api.replies import Reply
from silo.api.transport import Call, Cancel, Transport

LISTS = ("items", "entries", "lines", "bom", "results", "data")
"""The keys under which servers put a list that is not bare."""

Params = Mapping[str, str | int]


class Caller:
    """Base of the client's parts: an address and a transport."""

    _address: ServerAddress
    _transport: Transport

    def _get(self, subject: str, *segments: str, params: Params | None = None) -> Reply:
        """Ask; a question may be repeated freely."""
        return self._transport.send(
            Call(
                "GET",
                self._address.api(*segments),
                subject,
                params=params or {},
                headers={"Accept": "application/json"},
                repeatable=True,
            )
        )

    def _change(
        self,
        method: str,
        subject: str,
        *segments: str,
        body: BaseModel,
        headers: Mapping[str, str] | None = None,
        repeatable: bool = False,
        cancelled: Cancel | None = None,
    ) -> Reply:
        """Send a model as JSON."""
        # Not pydantic's own JSON, which writes NaN as null: what cannot be said is an error, no gap.
        content = as_json(body.model_dump(by_alias=True, exclude_none=True))
        return self._transport.send(
            Call(
                method,
                self._address.api(*segments),
                subject,
                body=lambda: content,
                headers={"Accept": "application/json", "Content-Type": "application/json", **(headers or {})},
                repeatable=repeatable,
                cancelled=cancelled,
            )
        )

    def _delete(self, subject: str, *segments: str) -> None:
        """Remove."""
        self._transport.send(Call("DELETE", self._address.api(*segments), subject))
