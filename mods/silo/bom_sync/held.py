# SPDX-License-Identifier: LGPL-2.1-or-later
"""A BOM that is held back: the server learns it, so that nobody takes the old BOM for the newest.

Only a server that remembers its syncs is asked; any other learns nothing, and the report stays on this
computer.
"""

from __future__ import annotations

from typing import Any, Protocol

from silo.api.wire import HeldReport, LeftOutPart, SourceDocument
from silo.bom.errors import NotFoundError
from silo.bom.left_out import Reason, what_holds
from silo.bom.message import Message
from silo.bom_sync.resolved import Resolved, blocking, left_out_parts


class HoldApi(Protocol):
    """What a report needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def hold_bom(self, part_number: str, report: HeldReport, /) -> Any: ...


def report_held(resolved: Resolved, api: HoldApi, document: SourceDocument | None = None) -> bool:
    """Report that the BOM of an assembly cannot be sent; returns False if the server takes no such report.

    Raises SiloError for a server that cannot be asked now.
    """
    number, identity = resolved.assembly.part_number, resolved.assembly.silo_uuid
    if number is None or identity not in resolved.last_syncs:
        return False
    try:
        api.hold_bom(number, HeldReport(left_out=_what_holds(resolved), document=document))
    except NotFoundError:
        return False
    return True


def why_held(resolved: Resolved) -> Message:
    """Say why the BOM of an assembly cannot be sent, as the server's pages do: ``2 files missing``."""
    return what_holds(part.model_dump() for part in _what_holds(resolved))


def _what_holds(resolved: Resolved) -> list[LeftOutPart]:
    parts = left_out_parts(resolved)
    if any(part.reason != Reason.UNREGISTERED for part in parts):
        return parts
    # A finding whose objects all belong to components that are there is in no list of components.
    return [
        *parts,
        *(LeftOutPart(reason=Reason.BROKEN, message=str(each.message)[:4096]) for each in blocking(resolved)),
    ]
