# SPDX-License-Identifier: LGPL-2.1-or-later
"""What can be registered, and what a person should know of it first (spec bom-sync §2 and §6).

The Register Parts dialog in FreeCAD and ``silo-mod register`` both ask this module. A :class:`Candidate` is
one component without a part number.
"""

from __future__ import annotations

import hashlib
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Protocol

from silo.api.files import other_name
from silo.bom.errors import CancelledError, NotFoundError, ServerFaultError, SiloError
from silo.bom.findings import FindingCode
from silo.bom.model import BomEntry, Extraction, meta_key, walk_entries
from silo.bom.resolve import Proposal, propose, propose_all
from silo.files import content_hash
from silo.registering.items import component_key
from silo.registering.modelled import Modelled, modelled

ITEM_TYPES = ("part", "assembly", "consumable", "tool")
# Servers without a request for many are asked for each; beyond this many nobody reads them in a dialog.
MOST_LOOKED_UP = 100
# What a single file may offer.
MOST_MODELLED = 200
# Components that are looked up in one go, between two words of progress.
_IN_ONE = 500
_SAVED_AT = re.compile(rb'name="LastModifiedDate"[^>]*>\s*<String value="([^"]{0,40})"')


class Control(Protocol):
    """A running job's way to the outside."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None: ...

    def check(self) -> None:
        """Raise CancelledError where somebody wants the job to stop."""


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
    LOST = "lost"  # saving it in this FreeCAD would destroy objects that it does not know

    @property
    def usable(self) -> bool:
        """True where the identity can be written."""
        return self in (State.READY, State.EDITED, State.ELSEWHERE)


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
    twin
        label of another row whose file has the very same content; "" if there is none.
    article
        what is modelled in the assembly's own file: counted once it has an identity.
    """

    proposal: Proposal
    state: State
    similar: tuple[Similar, ...] = ()
    twin: str = ""
    same_as: str = ""
    sha256: str = field(default="", repr=False)
    article: Modelled | None = None

    @property
    def decided(self) -> bool:
        """True for what is modelled in the assembly's file and a component already, or said to be no part."""
        return self.article is not None and self.article.decided

    @property
    def entry(self) -> BomEntry:
        return self.proposal.entry

    @property
    def foreign(self) -> bool:
        """True where the file carries an identity that the server does not know, from another server or from
        another computer's run."""
        has_one = bool(self.entry.silo_uuid) and not self.entry.is_standard
        return has_one and not self.same_as and self.article is None

    @property
    def shares_file(self) -> bool:
        return self.proposal.shares_file

    @property
    def wanted(self) -> bool:
        """Checked to begin with? Not where a person has to look first."""
        fine = self.state.usable and self.state is not State.ELSEWHERE
        if self.proposal.is_guess or self.article is not None or self.foreign:
            return False
        return fine and not self.same_as and not any(s.same_file for s in self.similar)


class Contents:
    """The files of candidates by their content; two of each are enough to know another file."""

    def __init__(self) -> None:
        self._by_sha256: dict[str, list[Candidate]] = {}

    def add(self, candidate: Candidate) -> None:
        """Remember the file of a candidate."""
        same = self._by_sha256.setdefault(candidate.sha256, [])
        if not same or (len(same) == 1 and same[0].entry.doc_path != candidate.entry.doc_path):
            same.append(candidate)

    def twin(self, candidate: Candidate) -> Candidate | None:
        """Return the first candidate with the same content in another file."""
        same = self._by_sha256.get(candidate.sha256, ()) if candidate.sha256 else ()
        return next((one for one in same if one.entry.doc_path != candidate.entry.doc_path), None)


@dataclass(frozen=True)
class Offer:
    """All rows, and what there is to choose from.

    numbers
        category → the number that its next item would get.
    registered
        key of a component (of a standard part: "" and its designation) → the number that it has.
    unsearched
        why probable duplicates could not be looked for; "" where they were.
    """

    candidates: tuple[Candidate, ...]
    categories: Mapping[str, str]
    numbers: Mapping[str, str] = field(default_factory=dict)
    registered: Mapping[tuple[str, str], str] = field(default_factory=dict)
    unsearched: str = ""


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
    *,
    most: int | None = MOST_LOOKED_UP,
    own_file: bool = True,
) -> Offer:
    """What can be registered of an assembly; a part is an extraction without entries.

    most
        look-alikes are searched for so many components; None for all.
    own_file
        with what is modelled in the assembly's own file.
    begun
        registrations that were interrupted (:meth:`Journal.pending`): the item that such a
        one made is no look-alike of the component, it is its own.
    """
    from silo.bom_sync import resolve

    resolved = resolve(extraction, api)
    schema = api.find_schema(schema)
    numbers = _numbers_by_identity(resolved)
    categories = api.categories(schema)
    if not categories:
        raise ServerFaultError(f"schema {schema} has no categories on this server; is it a Silo server?")
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
    candidates += _modelled(extraction, seen, categories) if own_file else []
    control.check()
    looked, unsearched = _with_look_alikes(candidates, api, control, begun or {}, most)
    registered = {
        (("", entry.standard) if entry.standard else entry.key): numbers[entry.silo_uuid.lower()]
        for entry in walk_entries(tree)
        if entry.silo_uuid and entry.silo_uuid.lower() in numbers
    }
    numbers_next = _next_numbers(looked, api, schema)
    contents = Contents()
    for candidate in looked:
        contents.add(candidate)
    twins = [(candidate, contents.twin(candidate)) for candidate in looked]
    found = tuple(replace(one, twin=twin.proposal.name) if twin else one for one, twin in twins)
    return Offer(found, categories, numbers_next, registered, unsearched)


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


def _modelled(
    extraction: Extraction, seen: Mapping[str, Seen], categories: Mapping[str, str]
) -> list[Candidate]:
    """What the saved file of the assembly holds that could be declared, or is; those come last."""
    top = extraction.assembly
    look = seen.get(top.doc_path, Seen(State.MISSING))
    try:
        articles = modelled(top.doc_path, top.object_name or None) if look.state.usable else []
    except SiloError:  # the walk has said what is wrong with the file
        return []
    if look.saved_at and changed_since(top, look.saved_at):
        look = Seen(State.NEWER)
    return [
        Candidate(propose(one.entry, categories, shares_file=True), look.state, article=one)
        for one in articles[:MOST_MODELLED]
    ]


def changed_since(entry: BomEntry, saved_at: str) -> bool:
    """True where the file is not the one that was opened: saved by somebody else, or registered meanwhile.

    saved_at
        the open document's own time stamp.
    """
    head, _ = _look_into(entry.doc_path)
    found = _SAVED_AT.search(head)
    if found and found[1].decode("ascii", "replace") != saved_at:
        return True
    # An identity that the command line has stamped into the file leaves FreeCAD's time stamp as it is.
    marks = (b'<Item key="%s" value="' % key.encode() for key in (meta_key(), meta_key(entry.object_name)))
    return not entry.silo_uuid and any(mark in head for mark in marks)


def fingerprint(path: str) -> str:
    """What changes whenever FreeCAD saves a file, and stays when an identity is stamped; "" where unknown."""
    head, content = _look_into(path)
    found = _SAVED_AT.search(head)
    return hashlib.sha256(repr((found and found[1], content)).encode()).hexdigest()[:16] if head else ""


def _look_into(path: str) -> tuple[bytes, list[tuple[str, int]]]:
    """The document's own properties, which come first (a hostile file may never end), and what is beside."""
    try:
        with zipfile.ZipFile(path) as file, file.open("Document.xml") as xml:
            beside = [(one.filename, one.CRC) for one in file.infolist() if one.filename != "Document.xml"]
            return xml.read(1 << 18), sorted(beside)
    except (OSError, KeyError, zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError):
        return b"", []


def sha256_or_nothing(path: str) -> str:
    """The hash of a file's content; "" where it cannot be read."""
    try:
        return content_hash(path)
    except OSError:
        return ""


def _with_look_alikes(
    candidates: Sequence[Candidate], api: Any, control: Control, begun: Mapping[str, str], most: int | None
) -> tuple[list[Candidate], str]:
    """The candidates with what they may be already; why nobody knows, where the server did not say."""
    # An item of a standard part's designation is joined, whoever made it.
    asked = [one for one in candidates[:most] if not one.entry.is_standard and not one.decided]
    found: dict[tuple[str, str], list[Any]] = {}
    try:
        for start in range(0, len(asked), _IN_ONE):
            some = asked[start : start + _IN_ONE]
            control.check()
            control.progress(some[0].proposal.name, start / len(asked))
            found |= api.find_look_alikes(_searched(one) for one in some)
    except CancelledError:
        raise
    except SiloError as error:
        # Registering must not fail for want of suggestions; but that there are none is no news of the server.
        return list(candidates), str(error)

    def of(one: Candidate) -> tuple[Similar, ...]:
        own = begun.get(component_key(one.entry), "")
        return tuple(
            Similar(like.part_number, like.id, like.name, like.same_file)
            for like in found.get(_searched(one), ())
            if like.part_number != one.same_as and like.id != own
        )

    looked = {id(one) for one in asked}
    return [replace(one, similar=of(one)) if id(one) in looked else one for one in candidates], ""


def _searched(candidate: Candidate) -> tuple[str, str]:
    return candidate.proposal.name, candidate.sha256


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
