# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the Register Parts dialog shows and does, without the dialog (spec bom-sync §2 and §6).

A :class:`Candidate` is one component without a part number. Questions to the server run in the worker; the
identity is written into the document in the GUI thread, through a function that waits for it there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

from silo.api.revisions import other_name
from silo.bom.declare import Modelled
from silo.bom.errors import NotFoundError, SiloError
from silo.bom.findings import FindingCode
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.bom.naming import Proposal, clean_name, propose_all
from silo.registration import Journal, Registration, RegistrationApi, component_key, register, unclear
from silo.standard_items import register_standard
from silo.workbench.register.on_disk import changed_since, sha256_or_nothing
from silo.workbench.session.jobs import Control
from silo.workbench.words import translate

# Looking for look-alikes costs a request each; beyond this many nobody reads them.
MOST_LOOKED_UP = 100
_AT_ONCE = 6


class State(StrEnum):
    """How a component's file stands."""

    READY = "ready"
    EDITED = "edited"  # has unsaved edits, which are saved along with the identity
    ELSEWHERE = "elsewhere"  # another FreeCAD has it open, and may overwrite what is saved here
    READ_ONLY = "read-only"
    PARTIAL = "partial"  # unsaved edits in a partly loaded document: FreeCAD cannot save them
    NEWER = "newer"  # somebody else saved or registered the file since it was opened here
    MISSING = "missing"
    UNNAMED = "unnamed"  # never saved
    LOST = "lost"  # saving it in this FreeCAD would destroy its assemblies

    @property
    def usable(self) -> bool:
        """True where the identity can be written."""
        return self in (State.READY, State.EDITED, State.ELSEWHERE)


def state_words() -> dict[State, str]:
    """The states for people."""
    return {
        State.READY: "",
        State.EDITED: translate("Silo", "its unsaved edits are saved too"),
        State.ELSEWHERE: translate(
            "Silo", "open in another FreeCAD: close it there first, or saving there undoes this"
        ),
        State.READ_ONLY: translate("Silo", "the file is read-only"),
        State.PARTIAL: translate("Silo", "has edits, but is loaded only in part: open the file itself first"),
        State.NEWER: translate("Silo", "has changed on disk since you opened it: open it again first"),
        State.MISSING: translate("Silo", "the file is missing"),
        State.UNNAMED: translate("Silo", "has no file yet: save it first"),
        State.LOST: translate("Silo", "made by a newer FreeCAD: cannot be saved here"),
    }


@dataclass(frozen=True)
class Seen:
    """What the GUI thread saw of a component's file. ``saved_at`` is the open document's own time stamp."""

    state: State
    saved_at: str = ""


@dataclass(frozen=True)
class Similar:
    """An item on the server that this component may be already. A suggestion only."""

    part_number: str
    item_id: str
    name: str
    same_file: bool = False


@dataclass(frozen=True)
class Candidate:
    """One row of the dialog.

    same_as
        part number whose identity the file carries although another file has it too ("copied identity").
    twins
        labels of other rows whose files have the very same content.
    article
        what is modelled in the assembly's own file: counted once it has an identity.
    """

    proposal: Proposal
    state: State
    similar: tuple[Similar, ...] = ()
    twins: tuple[str, ...] = ()
    same_as: str = ""
    sha256: str = field(default="", repr=False)
    article: Modelled | None = None

    @property
    def declared(self) -> bool:
        """True for what is modelled in the assembly's file and a component already."""
        return self.article is not None and self.article.declared

    @property
    def entry(self) -> BomEntry:
        return self.proposal.entry

    @property
    def shares_file(self) -> bool:
        return self.proposal.shares_file

    @property
    def wanted(self) -> bool:
        """Checked to begin with? Not where a person has to look first."""
        fine = self.state.usable and self.state is not State.ELSEWHERE
        if self.proposal.is_guess or self.article is not None:
            return False
        return fine and not self.same_as and not any(s.same_file for s in self.similar)


@dataclass(frozen=True)
class Offer:
    """All rows, and what there is to choose from.

    numbers
        category → the number that its next item would get.
    """

    candidates: tuple[Candidate, ...]
    categories: Mapping[str, str]
    numbers: Mapping[str, str] = field(default_factory=dict)


# --- which components, and what of them -------------------------------------------------------------------


def copied(extraction: Extraction) -> tuple[BomEntry, ...]:
    """The components that carry an identity which another file carries too."""
    places = {
        (place.doc_path, place.obj)
        for finding in extraction.findings
        if finding.code is FindingCode.COPIED_IDENTITY
        for place in finding.where
    }
    return tuple(e for e in walk_entries((extraction.assembly, *extraction.entries)) if e.key in places)


def offer(
    extraction: Extraction,
    seen: Mapping[str, Seen],
    api: Any,
    schema: str,
    control: Control,
    begun: Mapping[str, str] | None = None,
) -> Offer:
    """What the dialog shows. Worker.

    begun
        registrations that were interrupted (:meth:`silo.registration.Journal.pending`): the item that such a
        one made is no look-alike of the component, it is its own.
    """
    from silo.bom_sync import resolve
    from silo.workbench.register.modelled import modelled_candidates

    resolved = resolve(extraction, api)
    schema = api.find_schema(schema)
    numbers = _numbers_by_identity(resolved)
    categories = api.categories(schema)
    tree = (extraction.assembly, *extraction.entries)
    copies = [
        entry
        for entry in _perhaps_copies(extraction, numbers, api)
        if (entry.silo_uuid or "").lower() in numbers
    ]
    candidates = [_candidate(p, seen) for p in propose_all(resolved.unregistered, tree, categories)]
    candidates += [
        _candidate(p, seen, same_as=numbers[(p.entry.silo_uuid or "").lower()])
        for p in propose_all(copies, tree, categories)
    ]
    candidates.sort(key=lambda candidate: candidate.entry.is_standard)
    candidates += modelled_candidates(extraction, seen, categories)
    control.check()
    looked = _with_look_alikes(candidates, api, control, begun or {})
    return Offer(_with_twins(looked), categories, _next_numbers(looked, api, schema))


def _perhaps_copies(extraction: Extraction, numbers: Mapping[str, str], api: Any) -> tuple[BomEntry, ...]:
    """The copied ones, and the document itself where its item's file has another name."""
    found, top = copied(extraction), extraction.assembly
    number = numbers.get((top.silo_uuid or "").lower())
    if number is None or any(entry.key == top.key for entry in found):
        return found
    try:
        return (*found, top) if other_name(top.doc_path, api.revisions(number)) else found
    except NotFoundError:
        return found


def _numbers_by_identity(resolved: Any) -> dict[str, str]:
    known = walk_entries((resolved.assembly, *resolved.entries))
    return {e.silo_uuid.lower(): e.part_number for e in known if e.silo_uuid and e.part_number}


def _candidate(proposal: Proposal, seen: Mapping[str, Seen], same_as: str = "") -> Candidate:
    entry = proposal.entry
    if entry.is_standard:  # no file is written for it
        return Candidate(proposal, State.READY, same_as=same_as)
    look = seen.get(entry.doc_path, Seen(State.MISSING))
    state, digest = look.state, ""
    if state.usable:
        if look.saved_at and changed_since(entry, look.saved_at):
            state = State.NEWER
        digest = sha256_or_nothing(entry.doc_path)
    return Candidate(proposal, state, same_as=same_as, sha256=digest)


def _with_look_alikes(
    candidates: Sequence[Candidate], api: Any, control: Control, begun: Mapping[str, str]
) -> list[Candidate]:
    first, rest = candidates[:MOST_LOOKED_UP], candidates[MOST_LOOKED_UP:]

    def one(candidate: Candidate) -> Candidate:
        # An item of a standard part's designation is joined, whoever made it.
        if candidate.entry.is_standard or candidate.declared:
            return candidate
        if control.cancelled.is_set():
            return candidate
        own = begun.get(component_key(candidate.entry), "")
        return replace(candidate, similar=_look_alikes(candidate, api, own))

    if not first:
        return list(rest)
    with ThreadPoolExecutor(_AT_ONCE, "silo-look-alikes") as pool:
        return [*pool.map(one, first), *rest]


def _look_alikes(candidate: Candidate, api: Any, own: str) -> tuple[Similar, ...]:
    name = candidate.proposal.name
    try:
        named = api.search_items(name, limit=8)
        # A server that does not search by content finds nothing; what has the name is compared all the same.
        with_file = api.search_items(candidate.sha256, limit=4) if candidate.sha256 else []
        told = []
        for item in {item.id: item for item in (*with_file, *named)}.values():
            same_name = clean_name(item.name).casefold() == name.casefold()
            same_file = bool(candidate.sha256) and candidate.sha256 in _checksums(item, api)
            if (same_name or same_file) and item.part_number != candidate.same_as and item.id != own:
                told.append(Similar(item.part_number, item.id, item.name, same_file))
    except SiloError:
        # Suggestions are a courtesy; registering must not fail for want of them.
        return ()
    return tuple(sorted(told, key=lambda similar: not similar.same_file))


def _checksums(item: Any, api: Any) -> set[str]:
    known = {str(item.properties.get("file_sha256", ""))}
    known.update((r.file_checksum or "").removeprefix("sha256:") for r in api.revisions(item.part_number))
    return known - {""}


def _with_twins(candidates: Iterable[Candidate]) -> tuple[Candidate, ...]:
    listed = list(candidates)
    by_content: dict[str, list[Candidate]] = {}
    for candidate in listed:
        if candidate.sha256:
            by_content.setdefault(candidate.sha256, []).append(candidate)
    told = []
    for candidate in listed:
        others = [
            c for c in by_content.get(candidate.sha256, ()) if c.entry.doc_path != candidate.entry.doc_path
        ]
        told.append(replace(candidate, twins=tuple(c.proposal.name for c in others)))
    return tuple(told)


def _next_numbers(candidates: Iterable[Candidate], api: Any, schema: str) -> dict[str, str]:
    numbers = {}
    for category in sorted({c.proposal.category for c in candidates if c.proposal.category}):
        numbers[category] = next_number(api, schema, category)
    return numbers


def next_number(api: Any, schema: str, category: str) -> str:
    """The number that the next item of a category would get; "" where the server does not say."""
    try:
        return str(api.generate_part_number(api.find_schema(schema), category))
    except SiloError:
        return ""


# --- registering -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Order:
    """A row that is to be registered, as the person left it.

    existing
        item to join instead of making a new one.
    apart
        of equal copies that are modelled in the file, each gets an item of its own.
    """

    candidate: Candidate
    name: str
    item_type: str
    category: str
    existing: Similar | None = None
    apart: bool = False

    @property
    def proposal(self) -> Proposal:
        return replace(
            self.candidate.proposal, name=self.name, item_type=self.item_type, category=self.category
        )


# Writes an identity into the component's document and saves it: (candidate, identity).
Write = Callable[[Candidate, str], None]


def carry_out(
    orders: Sequence[Order],
    api: RegistrationApi,
    journal: Journal,
    write: Write,
    *,
    schema: str,
    control: Control,
    done: Callable[[Order, Registration], None],
) -> None:
    """Register one after another; ``done`` is called with each result. Worker.

    One item's failure does not stop the rest. An error that concerns all of them does: a token that is not
    accepted, a server that is gone or busy (:mod:`silo.api.policy`).
    """
    from silo.api.policy import ends_run

    gone: SiloError | None = None
    for number, order in enumerate(orders):
        control.check()
        control.progress(order.name, number / len(orders))
        if gone is not None:
            done(order, Registration(order.proposal, error=gone))
            continue
        result = _carry_out(order, api, journal, write, schema)
        gone = result.error if result.error is not None and ends_run(result.error, api) else None
        done(order, result)


def _carry_out(
    order: Order, api: RegistrationApi, journal: Journal, write: Write, schema: str
) -> Registration:
    from silo.workbench.register.modelled import declare_article

    if order.candidate.entry.is_standard:
        return register_standard(order.proposal, api, schema=schema)
    if order.candidate.article is not None and order.existing is None:
        return declare_article(order, order.candidate.article, api, journal, write, schema)
    if order.existing is not None:
        try:
            write(order.candidate, order.existing.item_id)
        except SiloError as error:
            return Registration(order.proposal, error=error)
        return Registration(
            order.proposal, part_number=order.existing.part_number, item_id=order.existing.item_id
        )
    return register(
        order.proposal,
        api,
        journal,
        lambda _entry, identity: write(order.candidate, identity),
        schema=schema,
        properties={"file_sha256": order.candidate.sha256} if order.candidate.sha256 else None,
        ask=lambda proposal, found: seen_before(order, proposal, found),
    )


def seen_before(order: Order, proposal: Proposal, found: Sequence[Mapping[str, Any]]) -> None:
    """None (make a new item) where the person saw these items in the dialog and took none of them."""
    shown = {similar.item_id for similar in order.candidate.similar}
    if not all(str(item["id"]) in shown for item in found):
        unclear(proposal, found)
