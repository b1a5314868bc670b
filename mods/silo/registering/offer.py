# SPDX-License-Identifier: LGPL-2.1-or-later
"""What can be registered, and what a person should know of it first (spec bom-sync §2 and §6).

The Register Parts dialog in FreeCAD and ``silo-mod register`` both ask this module. A :class:`Candidate` is
one component without a part number.

What is modelled in an assembly's own file and can be declared a component there.

Nothing here counts: an identity on the object does, and a person gives it. The rules of this module:

* what is shown, how often, and what is used up, the count says (:mod:`silo.bom.roles`);
* equal copies are proposed as one article: the same shape, or the same label but for FreeCAD's number.
"""

from __future__ import annotations

import hashlib
import os
import re
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from silo.api.revisions import other_name
from silo.bom.document import label_of, located, object_name, own
from silo.bom.errors import (
    CancelledError,
    DocumentError,
    InputError,
    NotFoundError,
    ServerFaultError,
    SiloError,
)
from silo.bom.findings import FindingCode
from silo.bom.items.naming import is_generic
from silo.bom.items.proposal import Proposal, crowded_files, propose
from silo.bom.items.stems import stems
from silo.bom.model import BomEntry, Extraction, document_identity, meta_key, own_identity, walk_entries
from silo.bom.objects import survey_of
from silo.bom.roles import DECLARABLE
from silo.bom.roots import choose_assembly, silent_reader
from silo.fcstd import Library
from silo.fcstd.objects import FcstdObject
from silo.files import content_hash
from silo.platform import data_folder, one_path, read_memory, write_memory
from silo.registering.items import component_key

ITEM_TYPES = ("part", "assembly", "consumable", "tool")
# Servers without a request for many are asked for each; beyond this many nobody reads them in a dialog.
MOST_LOOKED_UP = 100
# How much a single file may offer.
MOST_MODELLED = 200
# Components that are looked up in one go, between two words of progress.
_IN_ONE = 500
# Of a folder, what people chose last.
MOST_LEARNT = 200
# What reading an entry of a file raises, if the file is no archive, is damaged, or does not have the entry.
_NOT_IN_ZIP = (OSError, KeyError, zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError)
_SAVED_AT = re.compile(rb'name="LastModifiedDate"[^>]*>\s*<String value="([^"]{0,40})"')


class RegisterControl(Protocol):
    """A running job's way to the outside."""

    def progress(self, detail: str = "", fraction: float | None = None) -> None: ...

    def check(self) -> None:
        """Raise CancelledError if somebody wants the job to stop."""


class ComponentState(StrEnum):
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
        """Return True if the identity can be written."""
        return self in (ComponentState.READY, ComponentState.EDITED, ComponentState.ELSEWHERE)


@dataclass(frozen=True)
class OpenedFile:
    """What the GUI thread saw of a component's file. ``saved_at`` is the open document's own time stamp."""

    state: ComponentState
    saved_at: str = ""


@dataclass(frozen=True)
class Similar:
    """An item on the server that this component may be already. A suggestion only."""

    part_number: str
    item_id: str
    name: str
    same_file: bool = False


@dataclass(frozen=True)
class LearntChoice:
    """What a person chose for a part, so for parts of the same words in the same folder."""

    words: tuple[str, ...]
    category: str
    sourcing: str = ""
    supplier: str = ""


class Learnt:
    """What people chose, by the folder of the part: one small file. Losing it costs questions."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path or data_folder() / "learnt-choices.json"
        self._folders = read_memory(self._path)

    def of(self, entry: BomEntry, name: str) -> LearntChoice | None:
        """Find the learnt choice for a part whose words are all in this name; the longest, and of those the
        newest.
        """
        words = set(stems(name))
        fitting = [
            choice
            for choice in self._choices_in(_folder(entry))
            if choice.words and words.issuperset(choice.words)
        ]
        return max(reversed(fitting), key=lambda choice: len(choice.words), default=None)

    @property
    def recent(self) -> tuple[str, ...]:
        """Return the categories that were chosen last, the newest first."""
        folder = self._folders.get("")
        return tuple(map(str, folder)) if isinstance(folder, list) else ()

    def learn(self, choices: Iterable[tuple[BomEntry, str, LearntChoice]]) -> None:
        """Remember what was chosen for parts of these names."""
        for entry, name, choice in choices:
            self._folders[""] = [choice.category, *(word for word in self.recent if word != choice.category)][
                :8
            ]
            if not (words := tuple(sorted(set(stems(name))))):
                continue
            choice, folder = replace(choice, words=words), _folder(entry)
            kept = [word for word in self._choices_in(folder) if word.words != words][-MOST_LEARNT + 1 :]
            self._folders[folder] = [asdict(word) for word in (*kept, choice)]
        write_memory(self._path, self._folders)

    def _choices_in(self, folder: str) -> list[LearntChoice]:
        choices = self._folders.get(folder)
        try:
            return [LearntChoice(**{**choice, "words": tuple(choice["words"])}) for choice in choices or ()]
        except (TypeError, KeyError):  # written by somebody else
            return []


def _folder(entry: BomEntry) -> str:
    return os.path.dirname(one_path(entry.doc_path)) if entry.doc_path else ""


@dataclass(frozen=True)
class Candidate:
    """One row of the dialog.

    same_as
        part number whose identity the file carries although another file has it too ("copied identity").
    twin
        label of another row whose file has the very same content; "" if there is none.
    article
        what is modelled in the assembly's own file: counted once it has an identity.
    learnt
        the category is what a person chose for a part of the same words in the same folder.
    """

    proposal: Proposal
    state: ComponentState
    similar: tuple[Similar, ...] = ()
    twin: str = ""
    same_as: str = ""
    sha256: str = field(default="", repr=False)
    article: Modelled | None = None
    learnt: bool = False

    @property
    def decided(self) -> bool:
        """Return True if the component is modelled in the assembly's file, and a person has decided
        about it.
        """
        return self.article is not None and self.article.decided

    @property
    def entry(self) -> BomEntry:
        return self.proposal.entry

    @property
    def foreign(self) -> bool:
        """Return True if the file carries an identity that the server does not know: of another server, or of
        another computer's run.
        """
        has_one = bool(self.entry.silo_uuid) and not self.entry.is_standard
        return has_one and not self.same_as and self.article is None

    @property
    def shares_file(self) -> bool:
        return self.proposal.shares_file

    @property
    def wanted(self) -> bool:
        """Return True if it is checked at the beginning, since no person has to look at it first."""
        fine = self.state.usable and self.state is not ComponentState.ELSEWHERE
        if self.proposal.is_guess or self.article is not None or self.foreign:
            return False
        return fine and not self.same_as and not any(s.same_file for s in self.similar)


class CandidateFiles:
    """The files of candidates by their content; two of each are enough to know another file."""

    def __init__(self) -> None:
        self._by_sha256: dict[str, list[Candidate]] = {}

    def add(self, candidate: Candidate) -> None:
        """Remember the file of a candidate."""
        same = self._by_sha256.setdefault(candidate.sha256, [])
        if not same or (len(same) == 1 and same[0].entry.doc_path != candidate.entry.doc_path):
            same.append(candidate)

    def twin(self, candidate: Candidate) -> Candidate | None:
        """Find the first candidate with the same content in another file."""
        same = self._by_sha256.get(candidate.sha256, ()) if candidate.sha256 else ()
        return next(
            (component for component in same if component.entry.doc_path != candidate.entry.doc_path),
            None,
        )


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


# --- which components, and what of them -------------------------------------------------------------------


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
    crowded, learnt = crowded_files(tree), learnt or Learnt()
    candidates = [
        _candidate(entry, seen, categories, crowded, learnt, numbers if entry in copies else {})
        for entry in (*resolved.unregistered, *copies)
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
    proposed = sorted({candidate.proposal.category for candidate in looked} - {""})
    numbers_next = {category: next_number(api, schema, category) for category in proposed}
    contents = CandidateFiles()
    for candidate in looked:
        contents.add(candidate)
    twins = [(candidate, contents.twin(candidate)) for candidate in looked]
    with_twins = tuple(
        replace(component, twin=twin.proposal.name) if twin else component for component, twin in twins
    )
    recent = tuple(code for code in learnt.recent if code in categories)
    return Offer(with_twins, categories, numbers_next, registered, unsearched, recent)


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


def changed_since(entry: BomEntry, saved_at: str) -> bool:
    """Return True if the file is no longer the one that was opened: somebody saved or registered it.

    saved_at
        the open document's own time stamp.
    """
    head, _ = _look_into(entry.doc_path)
    match = _SAVED_AT.search(head)
    if match and match[1].decode("ascii", "replace") != saved_at:
        return True
    # An identity that the command line has stamped into the file leaves FreeCAD's time stamp as it is.
    marks = (b'<Item key="%s" value="' % key.encode() for key in (meta_key(), meta_key(entry.object_name)))
    return not entry.silo_uuid and any(mark in head for mark in marks)


def fingerprint(path: str) -> str:
    """Return a text that changes whenever FreeCAD saves a file, but not when an identity is stamped; "" if
    unknown.
    """
    head, content = _look_into(path)
    match = _SAVED_AT.search(head)
    return hashlib.sha256(repr((match and match[1], content)).encode()).hexdigest()[:16] if head else ""


def _look_into(path: str) -> tuple[bytes, list[tuple[str, int]]]:
    """Read the document's own properties, which come first (a hostile file may never end), and list the other
    entries.
    """
    try:
        with zipfile.ZipFile(path) as file, file.open("Document.xml") as xml:
            beside = [
                (member.filename, member.CRC)
                for member in file.infolist()
                if member.filename != "Document.xml"
            ]
            return xml.read(1 << 18), sorted(beside)
    except _NOT_IN_ZIP:
        return b"", []


def picture_in(path: str) -> bytes:
    """Read the picture that FreeCAD keeps in a file (PNG); b"" if it has none."""
    try:
        with zipfile.ZipFile(path) as file, file.open("thumbnails/Thumbnail.png") as picture:
            return picture.read(1 << 20)
    except _NOT_IN_ZIP:
        return b""


def sha256_or_nothing(path: str) -> str:
    """Hash a file's content; "" if it cannot be read."""
    try:
        return content_hash(path)
    except OSError:
        return ""


def _with_look_alikes(
    candidates: Sequence[Candidate],
    api: Any,
    control: RegisterControl,
    begun: Mapping[str, str],
    most: int | None,
) -> tuple[list[Candidate], str]:
    """Add to the candidates the items that they may be; also say why nobody knows, if the server did not
    answer.
    """
    # An item of a standard part's designation is joined, no matter who made it.
    asked = [
        component
        for component in candidates[:most]
        if not component.entry.is_standard and not component.decided
    ]
    look_alikes: dict[tuple[str, str], list[Any]] = {}
    try:
        for start in range(0, len(asked), _IN_ONE):
            group = asked[start : start + _IN_ONE]
            control.check()
            control.progress(group[0].proposal.name, start / len(asked))
            look_alikes |= api.find_look_alikes(_searched(component) for component in group)
    except CancelledError:
        raise
    except SiloError as error:
        # Registering must not fail without suggestions; but then nobody knows that there are none.
        return list(candidates), str(error)

    def of(candidate: Candidate) -> tuple[Similar, ...]:
        own = begun.get(component_key(candidate.entry), "")
        return tuple(
            Similar(like.part_number, like.id, like.name, like.same_file)
            for like in look_alikes.get(_searched(candidate), ())
            if like.part_number != candidate.same_as and like.id != own
        )

    looked = {id(component) for component in asked}
    return [
        replace(component, similar=of(component)) if id(component) in looked else component
        for component in candidates
    ], ""


def _searched(candidate: Candidate) -> tuple[str, str]:
    return candidate.proposal.name, candidate.sha256


def next_number(api: Any, schema: str, category: str) -> str:
    """Ask for the number that the next item of a category would get; "" if the server does not tell it."""
    try:
        return str(api.generate_part_number(api.find_schema(schema), category))
    except SiloError:
        return ""


# FreeCAD numbers copies with three digits.
_NUMBER = re.compile(r"\d{3}$")


@dataclass(frozen=True)
class Modelled:
    """One article that is modelled in the file.

    entry
        its first object, as a BOM entry; ``quantity`` is what the BOM would count of all its objects.
    objects
        names of the objects that are equal, the first one first.
    alike
        why they are taken for equal: "shape" or "label"; "" for a single one.
    source
        the file that A2plus imported it from.
    no_part
        a person said that it is no part, and the file keeps that (``SiloBomExclude``).
    """

    entry: BomEntry
    objects: tuple[str, ...]
    alike: str = ""
    source: str = ""
    no_part: bool = False

    @property
    def decided(self) -> bool:
        """Return True if a person has said what it is: a component, or no part."""
        return self.declared or self.no_part

    @property
    def declared(self) -> bool:
        """Return True if it is a component already."""
        return self.entry.silo_uuid is not None

    def apart(self) -> tuple[Modelled, ...]:
        """Make each object an article of its own; the quantity of each is then unknown."""
        return tuple(
            replace(
                self, entry=replace(self.entry, object_name=name, label=name, quantity=1), objects=(name,)
            )
            for name in self.objects
        )


def modelled(path: str, assembly: str | None = None) -> list[Modelled]:
    """Find what is modelled in the file of an assembly, without FreeCAD. DocumentError, InputError."""
    with Library() as library:
        return modelled_in(choose_assembly(library.open(path), assembly), _shape_of)


def _shape_of(obj: object) -> str:
    try:
        return obj.shape_key() if isinstance(obj, FcstdObject) else ""
    except DocumentError:  # damaged: nothing is known of it
        return ""


def chosen(articles: Sequence[Modelled], names: Iterable[str], *, apart: bool = False) -> list[Modelled]:
    """Return the articles with these names (or labels), each once. InputError for a name that no
    article has.
    """
    by_chain: dict[tuple[str, ...], Modelled] = {}
    for name in names:
        fitting = [article for article in articles if name in article.objects] or [
            article for article in articles if name == article.entry.label
        ]
        if len(fitting) != 1:
            label_text = ", ".join(article.entry.object_name for article in articles) or "nothing"
            what = "nothing" if not fitting else f"{len(fitting)} things"
            raise InputError(f"{name!r} means {what} that is modelled in this file; there is: {label_text}")
        for article in fitting[0].apart() if apart else fitting:
            by_chain[article.objects] = article
    return list(by_chain.values())


def source_identity(article: Modelled) -> str | None:
    """Read the identity of the file from which A2plus imported an article; None if there is none."""
    if not article.source or not os.path.isfile(article.source):
        return None
    try:
        with Library() as library:
            return document_identity(library.open(article.source))
    except SiloError:
        return None


def modelled_in(top: Any, shape_of: Callable[[Any], str]) -> list[Modelled]:
    """Find the articles modelled in the file of an assembly (or of a single part); decided ones come last.

    shape_of
        a text that is equal for equal shapes, wherever they are placed; "" if that is not known.
    """
    contents = silent_reader().contents(top)
    shown: dict[str, tuple[Any, int]] = {}
    for count in () if contents.is_part else contents.own:
        name = object_name(count.target)
        shown[name] = (count.target, count.quantity + (shown[name][1] if name in shown else 0))
    articles = [
        _article(objects, alike, sum(shown[object_name(obj)][1] for obj in objects))
        for objects, alike in _alike([obj for obj, _ in shown.values()], shape_of)
    ]
    declared: dict[str, tuple[list[Any], int]] = {}
    for count in contents.counts:
        target = count.target
        is_here = getattr(target, "Document", None) is top.Document
        if is_here and (identity := own_identity(target)):
            objects, before = declared.get(identity, ([], 0))
            objects += [] if target in objects else [target]
            declared[identity] = (objects, before + count.quantity)
    for identity, (objects, quantity) in declared.items():
        article = _article(objects, "", quantity)
        articles.append(replace(article, entry=replace(article.entry, silo_uuid=identity)))
    of_file = survey_of(top.Document).of(DECLARABLE)
    no_parts = _alike([obj for obj, _ in of_file if own(obj, "SiloBomExclude") is True], shape_of)
    return articles + [
        replace(_article(objects, alike, len(objects)), no_part=True) for objects, alike in no_parts
    ]


def label_stem(label: str, labels: Set[str]) -> str:
    """Cut the number that FreeCAD gives to copies from a label; "" if the rest says nothing.

    labels
        all labels: a number is from FreeCAD only if the label without it exists too.
    """
    stem = _NUMBER.sub("", label)
    stem = stem if stem in labels else label
    return "" if is_generic(stem) else stem


def _alike(objects: Iterable[Any], shape_of: Callable[[Any], str]) -> list[tuple[list[Any], str]]:
    """Group equal objects: those with one shape, and those with one label whose shapes do not differ."""
    groups: list[tuple[list[Any], str]] = []
    by_shape: dict[tuple[str, str], int] = {}
    by_stem: dict[str, int] = {}
    offered = list(objects)
    labels = {label_of(obj) for obj in offered}
    for obj in offered:
        shape, stem = shape_of(obj), label_stem(label_of(obj), labels)
        keys: list[tuple[dict[Any, int], Any, str]] = []
        if shape:
            keys.append((by_shape, (getattr(obj, "TypeId", ""), shape), "shape"))
        if stem:
            keys.append((by_stem, stem, "label"))
        match = next(((positions[key], why) for positions, key, why in keys if key in positions), None)
        if match is None:
            groups.append(([obj], ""))
            place = len(groups) - 1
        else:
            place, why = match
            members, before = groups[place]
            members.append(obj)
            groups[place] = (members, "label" if "label" in (why, before) else "shape")
        for index, key, _ in keys:
            index.setdefault(key, place)
    return groups


def _article(objects: Sequence[Any], alike: str, quantity: int) -> Modelled:
    first = objects[0]
    path = getattr(first.Document, "FileName", "") or ""
    source = own(first, "sourceFile") or ""
    entry = BomEntry(
        path,
        quantity=quantity,
        object_name=object_name(first),
        label=label_of(first),
        document_label=getattr(first.Document, "Label", "") or "",
    )
    return Modelled(
        entry,
        tuple(map(object_name, objects)),
        alike,
        located(source, path) if isinstance(source, str) and source else "",
    )
