# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the calls of a client share: how a question becomes a request."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from silo.api.abilities import Abilities
from silo.api.address import ServerAddress
from silo.api.multipart import as_json
from silo.api.replies import Reply
from silo.api.transport import Call, Cancel, Transport
from silo.bom.errors import RejectedError

LISTS = ("items", "entries", "lines", "bom", "results", "data")
"""The keys under which servers put a list that is not bare."""

_UNKNOWN_KEY = re.compile(
    r"(unknown|unrecogni[sz]ed|unexpected|additional|extra|unsupported)\s+(json\s+)?"
    r"(fields?|keys?|propert|inputs?|parameters?|attributes?)|not permitted",
    re.IGNORECASE,
)

Params = Mapping[str, str | int]


class Caller:
    """Base of the client's parts: an address and a transport."""

    _address: ServerAddress
    _transport: Transport
    abilities: Abilities

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
        extensions: Sequence[str] = (),
    ) -> Reply:
        """Send a model as JSON.

        extensions
            keys that only our own server knows, also inside lists of objects. A strict server refuses them:
            it is asked once more without them, and never sent any again.
        """
        # Not pydantic's own JSON, which writes NaN as null: what cannot be said is an error, no gap.
        said = body.model_dump(by_alias=True, exclude_none=True)
        bare = _without(said, extensions)

        def send(data: Any) -> Reply:
            content = as_json(data)
            return self._transport.send(
                Call(
                    method,
                    self._address.api(*segments),
                    subject,
                    body=lambda: content,
                    headers={
                        "Accept": "application/json",
                        "Content-Type": "application/json",
                        **(headers or {}),
                    },
                    repeatable=repeatable,
                    cancelled=cancelled,
                )
            )

        if self.abilities.strict or bare == said:
            return send(bare)
        try:
            return send(said)
        except RejectedError as error:
            if not _UNKNOWN_KEY.search(f"{error} {' '.join(error.problems)}"):
                raise
        reply = send(bare)
        self.abilities.strict = True
        return reply

    def _delete(self, subject: str, *segments: str) -> None:
        """Remove."""
        self._transport.send(Call("DELETE", self._address.api(*segments), subject))


def _without(data: Any, keys: Sequence[str]) -> Any:
    """The data without these keys, here and in lists of objects; what a user put into a value stays."""
    if not keys or not isinstance(data, dict):
        return data
    return {
        key: [_without(one, keys) for one in value] if isinstance(value, list) else value
        for key, value in data.items()
        if key not in keys
    }
