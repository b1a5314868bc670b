# SPDX-License-Identifier: LGPL-2.1-or-later
"""Giving a component its item: create it in Silo, write the identity into its file, never twice.

The order is what keeps a crash harmless: the intent, with the UUID that the item shall have, is on disk
before the server is asked; the identity is in the file before the intent is forgotten. Whatever is
interrupted, the next run finds the intent, asks the server for that UUID, and goes on where it stopped.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from silo.bom.errors import InputError, SiloError
from silo.bom.model import BomEntry
from silo.bom.naming import Proposal
from silo.durable import replacing

# Servers that give UUIDs of their own still keep properties: this one finds an item made before a crash.
REGISTRATION_PROPERTY = "registration_id"


class RegistrationApi(Protocol):
    """What registering needs of a Silo; :class:`silo.api.client.SiloClient` has it."""

    def get_item_by_uuid(self, uuid: str, /) -> Mapping[str, Any] | None: ...

    def search_items(self, query: str, /) -> Any: ...

    def create_item(
        self,
        schema: str,
        category: str,
        description: str,
        *,
        item_type: str,
        properties: Mapping[str, Any],
        idempotency_key: str,
    ) -> Mapping[str, Any]: ...


# Writes an identity into the component's file: (entry, uuid). Raises DocumentError where it cannot.
Stamp = Callable[[BomEntry, str], None]


@dataclass(frozen=True)
class Registration:
    """What became of one component: its item, or the error that kept it from getting one."""

    proposal: Proposal
    part_number: str | None = None
    item_id: str | None = None
    error: SiloError | None = None


class Journal:
    """Intents that are not finished, one small JSON file; written whole and renamed, so never half."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def pending(self) -> dict[str, str]:
        """``file#object`` → the UUID that its item was to get."""
        try:
            known = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            raise InputError(
                f"{self.path}: the journal of unfinished registrations cannot be read ({error}). Mend or "
                "move it away; items of an interrupted run may then exist without a file that names them."
            ) from error
        return {str(k): str(v) for k, v in known.items()} if isinstance(known, dict) else {}

    def begin(self, component: str) -> tuple[str, bool]:
        """The UUID for a component's item, and whether an earlier run had already begun with it."""
        known = self.pending()
        if component in known:
            return known[component], True
        known[component] = str(uuid.uuid4())
        self._write(known)
        return known[component], False

    def replace(self, component: str, item_id: str) -> None:
        """Remember the UUID that the server chose itself."""
        self._write({**self.pending(), component: item_id})

    def done(self, component: str) -> None:
        """Forget a component: its file names its item."""
        known = self.pending()
        if known.pop(component, None) is not None:
            self._write(known)

    def _write(self, known: Mapping[str, str]) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(self.path) as file:
            file.write(json.dumps(known, indent=1).encode())


def component_key(entry: BomEntry) -> str:
    """How the journal names a component."""
    return f"{entry.doc_path}#{entry.object_name}"


def register(
    proposal: Proposal,
    api: RegistrationApi,
    journal: Journal,
    stamp: Stamp,
    *,
    schema: str = "kindred-rd",
    properties: Mapping[str, Any] | None = None,
) -> Registration:
    """Register one component; an error is returned, not raised, so that the others go on.

    properties
        further properties of the first revision, such as the file's hash.
    """
    component = component_key(proposal.entry)
    try:
        wanted, begun = journal.begin(component)
        item = _made_before(api, proposal, wanted) if begun else None
        if item is None:
            item = api.create_item(
                schema,
                proposal.category,
                proposal.name,
                item_type=proposal.item_type,
                properties={**(properties or {}), REGISTRATION_PROPERTY: wanted},
                idempotency_key=wanted,
            )
        item_id = str(item["id"])
        if item_id != wanted:
            journal.replace(component, item_id)
        stamp(proposal.entry, item_id)
        journal.done(component)
    except SiloError as error:
        return Registration(proposal, error=error)
    return Registration(proposal, part_number=str(item["part_number"]), item_id=item_id)


def _made_before(api: RegistrationApi, proposal: Proposal, wanted: str) -> Mapping[str, Any] | None:
    """The item that an interrupted run created, if it came that far."""
    item = api.get_item_by_uuid(wanted)
    if item is not None:
        return item
    for found in api.search_items(proposal.name):
        if (found.get("properties") or {}).get(REGISTRATION_PROPERTY) == wanted:
            match: Mapping[str, Any] = found
            return match
    return None
