# SPDX-License-Identifier: LGPL-2.1-or-later
"""What can be registered, and what the user should know of it first (spec bom-sync §2 and §6).

The Register Parts dialog in FreeCAD and ``silo-mod register`` both ask this module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from typing import Any

from silo.api.revisions import other_name
from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.errors import (
    CancelledError,
    NotFoundError,
    ServerFaultError,
    SiloError,
)
from silo.bom.findings import FindingCode
from silo.bom.items.proposal import crowded_files, propose
from silo.bom.message import message
from silo.registering.candidate import Candidate, CandidateFiles, ComponentState, OpenedFile, Similar
from silo.registering.control import RegisterControl
from silo.registering.journal import component_key
from silo.registering.learnt import Learnt
from silo.registering.modelled import modelled
from silo.registering.saved_file import changed_since, sha256_or_nothing

# Servers without a request for many are asked for each; a dialog with more is not read.
MOST_LOOKED_UP = 100
# How much a single file may offer.
MOST_MODELLED = 200
# Components that are looked up in one go, between two reports of progress.
_IN_ONE = 500


@dataclass(frozen=True)
class Offer:
    """All rows, and what there is to choose from.

    numbers
        category → the number that its next item would get.
    registered
        key of a component (of a standard part: "" and its designation) → the number that it has.
    unsearched
        why probable duplicates could not be looked for; "" where they were.
    recent
        categories that were chosen last, the newest first.
    """

    candidates: tuple[Candidate, ...]
    categories: Mapping[str, str]
    numbers: Mapping[str, str] = field(default_factory=dict)
    registered: Mapping[tuple[str, str], str] = field(default_factory=dict)
    unsearched: str = ""
    recent: tuple[str, ...] = ()


def copied(extraction: Extraction) -> tuple[BomEntry, ...]:
    """Return the components with an identity that another file carries too."""
    places = {
        (place.doc_path, place.obj)
        for finding in extraction.findings
        if finding.code is FindingCode.COPIED_IDENTITY
        for place in finding.where
    }
    return tuple(e for e in walk_entries((extraction.assembly, *extraction.entries)) if e.key in places)


def offer(
    extraction: Extraction,
    seen: Mapping[str, OpenedFile],
    api: Any,
    schema: str,
    control: RegisterControl,
    begun: Mapping[str, str] | None = None,
    *,
    most: int | None = MOST_LOOKED_UP,
    own_file: bool = True,
    learnt: Learnt | None = None,
) -> Offer:
    """Find what can be registered of an assembly; a part is an extraction without entries.

    most
        for how many components look-alikes are searched; None for all.
    own_file
        with what is modelled in the assembly's own file.
    begun
        interrupted registrations (:meth:`Journal.pending`): an item that they made is the component's own,
        not a look-alike.
    """
    from silo.bom_sync.resolved import resolve

    resolved = resolve(extraction, api)
    schema = api.find_schema(schema)
    numbers = _numbers_by_identity(resolved)
    categories = api.categories(schema)
    if not categories:
        raise ServerFaultError(
            message("schema {schema} has no categories on this server; is it a Silo server?", schema=schema)
        )
    tree = (extraction.assembly, *extraction.entries)
    copies = [
        entry
        for entry in _perhaps_copies(extraction, numbers, api)
        if (entry.silo_uuid or "").lower() in numbers
    ]
    crowded, learnt = crowded_files(tree), learnt or Learnt()
    candidates = [
        _candidate(entry, seen, categories, crowded, learnt, numbers if entry in copies else {})
        for entry in (*resolved.unregistered, *copies)
        if not entry.is_own_item  # its links have its identity, and are offered as such
    ]
    candidates = _originals_first(candidates)
    candidates.sort(key=lambda candidate: candidate.entry.is_standard)
    candidates += _modelled(extraction, seen, categories) if own_file else []
    control.check()
    looked, unsearched = _with_look_alikes(candidates, api, control, begun or {}, most)
    registered = {
        (("", entry.standard) if entry.standard else entry.key): numbers[entry.silo_uuid.lower()]
        for entry in walk_entries(tree)
        if not entry.variant and entry.silo_uuid and entry.silo_uuid.lower() in numbers
    }
    proposed = sorted({candidate.proposal.category for candidate in looked} - {""})
    numbers_next = {category: next_number(api, schema, category) for category in proposed}
    contents = CandidateFiles()
    for candidate in looked:
        contents.add(candidate)
    twins = [(candidate, contents.twin(candidate)) for candidate in looked]
    with_twins = tuple(
        replace(candidate, twin=twin.proposal.name) if twin else candidate for candidate, twin in twins
    )
    recent = tuple(code for code in learnt.recent if code in categories)
    return Offer(with_twins, categories, numbers_next, registered, unsearched, recent)


def _originals_first(candidates: list[Candidate]) -> list[Candidate]:
    """Put of equal files the linked one before the others, then the one with the shortest name; the first
    gets the item. A sync tool's conflicted copy has a longer name, and nothing links to it.
    """
    equal: dict[str, list[int]] = {}
    for place, candidate in enumerate(candidates):
        if candidate.sha256:
            equal.setdefault(candidate.sha256, []).append(place)
    ordered = list(candidates)
    for places in equal.values():
        group = [candidates[place] for place in places]
        group.sort(key=lambda one: (one.entry.level == 0, len(one.entry.doc_path), one.entry.doc_path))
        for place, candidate in zip(places, group, strict=True):
            ordered[place] = candidate
    return ordered


def _perhaps_copies(extraction: Extraction, numbers: Mapping[str, str], api: Any) -> tuple[BomEntry, ...]:
    """Return the copied components, and the document itself if its item's file has another name."""
    entries, top = copied(extraction), extraction.assembly
    number = numbers.get((top.silo_uuid or "").lower())
    if number is None or any(entry.key == top.key for entry in entries):
        return entries
    try:
        return (*entries, top) if other_name(top.doc_path, api.revisions(number)) else entries
    except NotFoundError:
        return entries


def _numbers_by_identity(resolved: Any) -> dict[str, str]:
    entries = walk_entries((resolved.assembly, *resolved.entries))
    return {e.silo_uuid.lower(): e.part_number for e in entries if e.silo_uuid and e.part_number}


def _candidate(
    entry: BomEntry,
    seen: Mapping[str, OpenedFile],
    categories: Mapping[str, str],
    crowded: Set[str],
    learnt: Learnt,
    copied: Mapping[str, str],
) -> Candidate:
    """Make a candidate. ``copied``: the part number of each identity that another file carries too."""
    proposal, same_as = (
        propose(entry, categories, shares_file=entry.doc_path in crowded),
        copied.get((entry.silo_uuid or "").lower(), ""),
    )
    if entry.is_standard:  # no file is written for it
        return Candidate(proposal, ComponentState.READY, same_as=same_as)
    choice = learnt.of(entry, proposal.name)
    if is_learnt := choice is not None and choice.category in categories and not entry.is_assembly:
        proposal = replace(
            proposal,
            category=choice.category,
            sourcing=choice.sourcing,
            supplier=choice.supplier,
            is_guess=False,
        )
    look = seen.get(entry.doc_path, OpenedFile(ComponentState.MISSING))
    state, digest = look.state, ""
    if state.usable:
        if look.saved_at and changed_since(entry, look.saved_at):
            state = ComponentState.NEWER
        digest = sha256_or_nothing(entry.doc_path)
    return Candidate(proposal, state, same_as=same_as, sha256=digest, learnt=is_learnt)


def _modelled(
    extraction: Extraction, seen: Mapping[str, OpenedFile], categories: Mapping[str, str]
) -> list[Candidate]:
    """Find what the saved file of the assembly holds that is declared, or could be; decided ones come
    last.
    """
    top = extraction.assembly
    look = seen.get(top.doc_path, OpenedFile(ComponentState.MISSING))
    try:
        articles = modelled(top.doc_path, top.object_name or None) if look.state.usable else []
    except SiloError:  # the walk has said what is wrong with the file
        return []
    if look.saved_at and changed_since(top, look.saved_at):
        look = OpenedFile(ComponentState.NEWER)
    return [
        Candidate(propose(article.entry, categories, shares_file=True), look.state, article=article)
        for article in articles[:MOST_MODELLED]
    ]


def _with_look_alikes(
    candidates: Sequence[Candidate],
    api: Any,
    control: RegisterControl,
    begun: Mapping[str, str],
    most: int | None,
) -> tuple[list[Candidate], str]:
    """Add to the candidates the items that they may be; also say why they are not known, if the server
    did not answer.
    """
    # An item of a standard part's designation is joined, no matter who made it.
    asked = [
        candidate
        for candidate in candidates[:most]
        if not candidate.entry.is_standard and not candidate.decided
    ]
    look_alikes: dict[tuple[str, str], list[Any]] = {}
    try:
        for start in range(0, len(asked), _IN_ONE):
            group = asked[start : start + _IN_ONE]
            control.check()
            control.progress(group[0].proposal.name, start / len(asked))
            look_alikes |= api.find_look_alikes(_searched(candidate) for candidate in group)
    except CancelledError:
        raise
    except SiloError as error:
        # Registering must not fail without suggestions; but it is not known then that there are none.
        return list(candidates), str(error)

    def of(candidate: Candidate) -> tuple[Similar, ...]:
        own = begun.get(component_key(candidate.entry), "")
        return tuple(
            Similar(like.part_number, like.id, like.name, like.same_file)
            for like in look_alikes.get(_searched(candidate), ())
            if like.part_number != candidate.same_as and like.id != own
        )

    looked = {id(candidate) for candidate in asked}
    return [
        replace(candidate, similar=of(candidate)) if id(candidate) in looked else candidate
        for candidate in candidates
    ], ""


def _searched(candidate: Candidate) -> tuple[str, str]:
    return candidate.proposal.name, candidate.sha256


def next_number(api: Any, schema: str, category: str) -> str:
    """Ask for the number that the next item of a category would get; "" if the server does not tell it."""
    try:
        return str(api.generate_part_number(api.find_schema(schema), category))
    except SiloError:
        return ""
