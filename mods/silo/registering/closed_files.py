# SPDX-License-Identifier: LGPL-2.1-or-later
"""Registering the components of files that no FreeCAD has open: from the command line, and by the demo."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import DocumentError
from silo.bom.findings import Finding
from silo.bom.items.proposal import Proposal, propose_all
from silo.bom.message import message
from silo.bom_sync.resolved import resolve
from silo.fcstd import check_stampable, stamp
from silo.freecads.open_documents import OpenInFreecad, open_in_any
from silo.registering.candidate import Candidate, ComponentState, OpenedFile
from silo.registering.carry_out import carry_out
from silo.registering.control import RegisterControl
from silo.registering.items import Ask, Registration, unclear
from silo.registering.journal import Journal, begun_beside, component_key
from silo.registering.request import RegistrationRequest
from silo.registering.saved_file import on_disk

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.vault.plan import Plan
    from silo.vault.reading import VaultReader


OPEN = message(
    "it is open in FreeCAD, and saving it there would undo the registration. Close "
    "it there, or register it from there (Silo, Register Parts), then run this "
    "again; --even-if-open registers it anyway"
)


class _Nowhere:
    """Progress that goes nowhere."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None:
        return

    def check(self) -> None:
        return


_NOWHERE = _Nowhere()


def whole_folder(
    plan: Plan, reading: VaultReader, base: str, *, hardware: bool = True
) -> tuple[Extraction, frozenset[str]]:
    """Read all components of a folder's assemblies, and the files that no assembly uses.

    What no assembly links to has level 0.
    """
    from silo.vault.questions import Question

    entries: dict[tuple[str, str], BomEntry] = {}
    linked: set[tuple[str, str]] = set()
    findings: list[Finding] = []
    for node in (node for layer in plan.layers for node in layer):
        extraction = plan.extraction(node, reading)
        findings += extraction.findings
        linked.update(entry.key for entry in extraction.entries)
        for entry in (*extraction.entries, extraction.assembly):
            entries.setdefault(entry.key, replace(entry, children=()))
    used = {entry.doc_path for entry in entries.values()}  # a standard part's key has no file
    alone = [top for top in plan.tops if os.path.realpath(top) not in used and top not in plan.errors]
    for answer in reading.ask_many(Question(top, None, hardware) for top in alone):
        if isinstance(part := answer.found, Extraction):
            head = part.assembly
            entries.setdefault(head.key, replace(head, children=(), is_assembly=False))
    unused = frozenset(entry.doc_path for entry in entries.values()) - used
    head = BomEntry(base, object_name="", is_assembly=True, level=0)
    everything = (replace(entry, level=int(key in linked)) for key, entry in entries.items())
    return Extraction(head, tuple(everything), tuple(dict.fromkeys(findings))), unused


def seen_on_disk(paths: Iterable[str], *, even_if_open: bool) -> dict[str, OpenedFile]:
    """Find out how the files of components stand."""
    opened = None if even_if_open else open_in_any()
    return {path: OpenedFile(_state(path, opened)) for path in paths}


def _state(path: str, opened: OpenInFreecad | None) -> ComponentState:
    if not os.path.isfile(path):
        return ComponentState.MISSING
    if not os.access(path, os.W_OK):
        return ComponentState.READ_ONLY
    return ComponentState.ELSEWHERE if opened is not None and opened.has_file(path) else ComponentState.READY


def is_own(candidate: Candidate) -> bool:
    """Return True if the look-alike is the candidate's own item, made by a run that was interrupted or
    undone.
    """
    entry, component = candidate.entry, component_key(candidate.entry)
    uid = on_disk(entry)[0]
    record = Journal().find(component) or begun_beside(entry.doc_path, component, uid)
    if record is None:
        return False
    if candidate.foreign:
        return not record.finished and candidate.entry.silo_uuid in (record.wanted, record.item_id)
    return not record.finished or record.document_uid == uid


def carry_out_on_disk(
    requests: Sequence[RegistrationRequest],
    client: SiloClient,
    *,
    schema: str,
    ask: Ask = unclear,
    even_if_open: bool = True,
    done: list[Registration] | None = None,
    control: RegisterControl = _NOWHERE,
) -> list[Registration]:
    """Register the components, and write their identities into the files; ``done`` grows with each.

    even_if_open
        also write files that a running FreeCAD has open; otherwise they are left alone, and are an error.
    """
    results: list[Registration] = [] if done is None else done

    def places(candidate: Candidate) -> list[tuple[str | None, str | None]]:
        """Return (the object that the identity is for, the object that gets the property), each once."""
        if candidate.article is not None:
            return [(name, name) for name in candidate.article.objects]
        name = candidate.entry.object_name
        return [(name if candidate.shares_file else None, name or None)]

    def write(candidate: Candidate, identity: str) -> None:
        for own, item in places(candidate):
            again = bool(candidate.entry.silo_uuid)
            stamp(candidate.entry.doc_path, identity, object_name=own, item_object=item, replace=again)

    def check(candidate: Candidate) -> None:
        # Checked again for each file: users open files during a long run.
        if not even_if_open and open_in_any().has_file(candidate.entry.doc_path):
            raise DocumentError(candidate.entry.doc_path, OPEN)
        for own, item in places(candidate):
            again = bool(candidate.entry.silo_uuid)
            check_stampable(candidate.entry.doc_path, object_name=own, item_object=item, replace=again)

    carry_out(
        requests,
        client,
        Journal(),
        write,
        schema=schema,
        control=control,
        done=lambda _request, result: results.append(result),
        check=check,
        ask=lambda _request, proposal, items: ask(proposal, items),
    )
    return results


def proposals_for(extraction: Extraction, client: SiloClient, schema: str) -> list[Proposal]:
    """Propose items for the components without one, parts first; the assembly itself comes last."""
    wanted = resolve(extraction, client).unregistered
    tree = (extraction.assembly, *extraction.entries)
    return propose_all(wanted, tree, client.categories(schema)) if wanted else []


def register_all(
    proposals: Sequence[Proposal], client: SiloClient, *, schema: str, **more: Any
) -> list[Registration]:
    """Register these as they were proposed (:func:`carry_out_on_disk`)."""
    requests = [RegistrationRequest.of(Candidate(proposal, ComponentState.READY)) for proposal in proposals]
    return carry_out_on_disk(requests, client, schema=schema, **more)
