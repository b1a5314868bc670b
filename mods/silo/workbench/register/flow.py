# SPDX-License-Identifier: LGPL-2.1-or-later
"""From the command to the Register Parts dialog, and from its buttons to documents and server. GUI thread.

::

    start ── a worker looks ──▶ the dialog is filled ──▶ the user confirms ──▶ a worker registers, one by one
                                       ▲                                          │ identities: GUI thread
                                       ╰─────────────── next numbers ◀── commits ◀┘

FreeCAD and Qt come in through the :class:`~silo.workbench.register.desk.RegisterDesk` only.

The rows of the Register Parts dialog while a person edits them. Pure; the dialog only draws them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, Protocol

from silo.bom.entry import BomEntry, Extraction, walk_entries
from silo.bom.errors import SiloError
from silo.bom_sync.activity_text import rules_text
from silo.registering.candidate import Candidate, ComponentState, Similar
from silo.registering.carry_out import carry_out, take_back
from silo.registering.items import Registration
from silo.registering.journal import Journal
from silo.registering.offer import Offer, next_number, offer
from silo.registering.request import CHOSEN, RegistrationRequest
from silo.registering.saved_file import picture_in
from silo.workbench.commit.flow import CommitFlow
from silo.workbench.documents.snapshot import Snapshot
from silo.workbench.register.desk import RegisterDesk
from silo.workbench.session.session import Session
from silo.workbench.settings import Preferences
from silo.workbench.tone import Tone
from silo.workbench.words import counted, filled, plain, translate

NEW = "new"
SAME = "same"
ASK = "ask"
APART = "apart"


def section_words() -> dict[str, str]:
    """Return the names of the dialog's sections, for people."""
    return {
        "": translate("Silo", "Components"),
        "standard": translate("Silo", "Standard parts"),
        "modelled": translate("Silo", "Modelled in this file, not counted"),
        "declared": translate("Silo", "Modelled in this file, and counted"),
        "no part": translate("Silo", "Modelled in this file, not a part"),
    }


def type_words() -> dict[str, str]:
    """Return the names of item types, for people."""
    return {
        "part": translate("Silo", "Part"),
        "assembly": translate("Silo", "Assembly"),
        "consumable": translate("Silo", "Consumable"),
        "tool": translate("Silo", "Tool"),
    }


def source_words() -> dict[str, str]:
    """Return the words for where a part comes from."""
    return {
        "manufactured": translate("Silo", "made here"),
        "purchased": translate("Silo", "bought"),
        "": translate("Silo", "not stated"),
    }


class Filter(StrEnum):
    """Which rows are shown."""

    ALL = "all"
    UNSURE = "unsure"  # a person has to look at them first
    NEW = "new"  # Silo has nothing like them
    DUPLICATES = "duplicates"  # Silo, or another row, has them probably


def filter_words() -> dict[str, str]:
    """Return the names of the filters by their values, for people."""
    return {
        Filter.ALL.value: translate("Silo", "all rows"),
        Filter.UNSURE.value: translate("Silo", "unsure"),
        Filter.NEW.value: translate("Silo", "new"),
        Filter.DUPLICATES.value: translate("Silo", "probable duplicates"),
    }


def state_words() -> dict[ComponentState, str]:
    """Return the words for the states, for people."""
    return {
        ComponentState.READY: "",
        ComponentState.EDITED: translate("Silo", "its unsaved edits are saved too"),
        ComponentState.ELSEWHERE: translate(
            "Silo", "open in another FreeCAD: close it there first, or saving there undoes this"
        ),
        ComponentState.READ_ONLY: translate("Silo", "the file is read-only"),
        ComponentState.PARTIAL: translate(
            "Silo", "has edits, but is loaded only in part: open the file itself first"
        ),
        ComponentState.NEWER: translate(
            "Silo", "has changed on disk since you opened it: open it again first"
        ),
        ComponentState.MISSING: translate("Silo", "the file is missing"),
        ComponentState.UNNAMED: translate("Silo", "has no file yet: save it first"),
        ComponentState.LOST: translate("Silo", "made by a newer FreeCAD: cannot be saved here"),
    }


@dataclass
class EditedRow:
    """A component with what the person chose for it.

    file
        the name of its file, such that no other row has it.
    number
        NEW for a new item, else the part number of an item to join. A copied identity begins with ASK, until
        the person says NEW or SAME (keep it).
    result
        what became of it; None while it is not registered.
    """

    candidate: Candidate
    name: str
    item_type: str
    category: str
    file: str
    sourcing: str = ""
    supplier: str = ""
    supplier_part_number: str = ""
    number: str = NEW
    checked: bool = True
    running: bool = False
    result: Registration | None = None

    @classmethod
    def of(cls, candidate: Candidate, file: str = "") -> EditedRow:
        """Make a row of a candidate."""
        return cls(
            candidate,
            **{name: getattr(candidate.proposal, name) for name in CHOSEN},
            file=file or os.path.basename(candidate.entry.doc_path),
            number=ASK if candidate.same_as else NEW,
            checked=candidate.wanted,
        )

    @property
    def section(self) -> str:
        """Return the section of the row, a key of :func:`section_words`."""
        if (article := self.candidate.article) is not None:
            return "no part" if article.no_part else "declared" if article.declared else "modelled"
        return "standard" if self.candidate.entry.is_standard else ""

    @property
    def finished(self) -> bool:
        """Return True if the component has its number."""
        return self.result is not None and self.result.error is None

    @property
    def editable(self) -> bool:
        """Return True while something can still be chosen."""
        usable = self.candidate.state.usable and not self.candidate.decided
        return usable and not self.finished and not self.running

    @property
    def can_undeclare(self) -> bool:
        """Return True if it is modelled in the file, and the decision about it can be undone."""
        return self.candidate.decided and self.candidate.state.usable and not self.running

    @property
    def can_be_no_part(self) -> bool:
        """Return True if a person can say that it is no part."""
        return self.section == "modelled" and self.editable

    @property
    def can_choose(self) -> bool:
        """Return True while its number can be chosen; a copied identity can be kept without writing the
        file.
        """
        return self.editable or (bool(self.candidate.same_as) and not self.finished and not self.running)

    @property
    def can_register(self) -> bool:
        """Return True if pressing Register gives it a number."""
        return self.editable and bool(self.name.strip()) and self.number not in (SAME, ASK)

    @property
    def can_keep(self) -> bool:
        """Return True if pressing the button keeps the identity that it has."""
        return self.can_choose and self.number == SAME

    def keep(self) -> None:
        """Leave the row unchanged."""
        self.result = Registration(self.candidate.proposal, part_number=self.candidate.same_as)
        self.checked = False

    def request(self) -> RegistrationRequest:
        """Make a request of the row, for the worker."""
        existing = next((s for s in self.candidate.similar if s.part_number == self.number), None)
        chosen = {name: getattr(self, name).strip() for name in CHOSEN}
        if self.sourcing != "purchased":
            chosen |= {"supplier": "", "supplier_part_number": ""}
        return RegistrationRequest(self.candidate, existing=existing, apart=self.number == APART, **chosen)

    def fits(self, only: Filter, words: str) -> bool:
        """Return True if a filter shows the row, and the row contains all of these words."""
        text = f"{self.component()} {self.name} {self.category} {self.supplier} {self.note()[0]}".casefold()
        similar = bool(self.candidate.similar or self.candidate.twin or self.candidate.same_as)
        shown = {
            Filter.ALL: True,
            Filter.UNSURE: not (self.candidate.wanted or self.checked or self.finished),
            Filter.NEW: not similar and not self.finished,
            Filter.DUPLICATES: similar,
        }
        return shown[only] and all(word in text for word in words.casefold().split())

    @property
    def guesses(self) -> bool:
        """Return True while its category is a guess that nobody has looked at."""
        same = self.category == self.candidate.proposal.category
        return (
            self.candidate.proposal.is_guess and same and not (self.checked or self.finished or self.running)
        )

    def component(self) -> str:
        """Return the name of the component."""
        return self._component

    @cached_property
    def _component(self) -> str:
        entry = self.candidate.entry
        if entry.standard:
            return plain(translate("Silo", "Standard part: {name}", name=entry.standard), 80)
        if (article := self.candidate.article) is not None:
            text = plain(entry.label, 60)
            copies = translate("Silo", "{name} ({n} copies)", n=len(article.objects), name=text)
            return copies if len(article.objects) > 1 else text
        return plain(f"{self.file} · {entry.label}" if self.candidate.shares_file else self.file, 80)

    def number_text(self, numbers: Mapping[str, str], taken: int) -> str:
        """Return the number that it has, or would get; ``taken``: how many rows before it want one of the
        same category.
        """
        if self.finished and self.result is not None:
            return self.result.part_number or ""
        if self.number == SAME:
            return translate("Silo", "{number} (kept)", number=self.candidate.same_as)
        if self.number == ASK:
            return translate("Silo", "same or new part?")
        if self.number == APART:
            return translate("Silo", "one for each")
        if self.candidate.decided:
            return ""
        if self.number != NEW:
            return self.number
        if not self.candidate.state.usable:
            return ""
        following = numbers.get(self.category, "")
        if not following:
            return translate("Silo", "new")
        text = translate("Silo", "{number} or later") if taken else translate("Silo", "{number} (new)")
        return text.replace("{number}", following)

    def choices(self) -> dict[str, str]:
        """Return the choices for its number."""
        texts = {}
        if self.candidate.same_as:
            texts[SAME] = translate("Silo", "same part: keep {number}", number=self.candidate.same_as)
        if not self.candidate.state.usable:
            return texts
        new = translate("Silo", "new part: a new number")
        texts[NEW] = new if self.candidate.same_as else translate("Silo", "a new number")
        if self.candidate.article is not None and len(self.candidate.article.objects) > 1:
            texts[APART] = translate("Silo", "different parts: a number for each copy")
        for similar in self.candidate.similar:
            texts[similar.part_number] = f"{similar.part_number} {plain(similar.name, 60)}"
        return texts

    def note(self) -> tuple[str, Tone]:
        """Write the last column: what happened, what is in the way, or what to look at."""
        if self.result is not None and self.result.error is not None:
            return plain(str(self.result.error), 300), Tone.ERROR
        if self.finished:
            kept, registered = translate("Silo", "stays as it is"), translate("Silo", "registered")
            return kept if self.number == SAME else registered, Tone.GOOD
        if self.running:
            return translate("Silo", "registering…"), Tone.QUIET
        if not self.candidate.state.usable and not self.candidate.same_as:
            return state_words()[self.candidate.state], Tone.WARNING
        notes = [*self._suspicions(), *self._about_the_article(), state_words()[self.candidate.state]]
        text = "; ".join(filter(None, notes))
        if self.candidate.learnt and self.category == self.candidate.proposal.category:
            text = "; ".join(filter(None, (translate("Silo", "as you chose in this folder before"), text)))
        doubtful = bool(self._suspicions()) or self.candidate.state is ComponentState.ELSEWHERE
        return text, Tone.WARNING if doubtful else Tone.QUIET

    def _about_the_article(self) -> list[str]:
        article = self.candidate.article
        if article is None:
            return []
        if article.no_part:
            return [translate("Silo", "not a part: not listed again")]
        if article.declared:
            text, many = translate("Silo", "counts once"), translate("Silo", "counts {n} times")
        else:
            text = translate("Silo", "would count once; check it if it is a part")
            many = translate("Silo", "would count {n} times; check it if it is a part")
        texts = [counted(article.entry.quantity, text, many)]
        if article.source:
            source = translate("Silo", "imported from {file}", file=os.path.basename(article.source))
            texts.append(source)
        if article.alike == "label":
            texts.append(translate("Silo", "equal by their labels only"))
        return texts

    def _suspicions(self) -> list[str]:
        suspicions = []
        if self.candidate.same_as:
            number = self.candidate.same_as
            suspicions.append(
                translate("Silo", "carries the identity of {number}, as another file does", number=number)
            )
        if self.candidate.foreign:
            suspicions.append(translate("Silo", "registered at another server: it keeps its identity"))
        suspicions += [_similar_words(similar) for similar in self.candidate.similar[:2]]
        if self.candidate.twin:
            name = plain(self.candidate.twin, 40)
            suspicions.append(translate("Silo", "the same content as {name}", name=name))
        return suspicions


def _similar_words(similar: Similar) -> str:
    if similar.same_file:
        text = translate("Silo", "Silo has this very file as {number}")
    else:
        text = translate("Silo", "Silo has {number} with the same name")
    return text.replace("{number}", similar.part_number)


def group(rows: Sequence[EditedRow], row: EditedRow) -> list[EditedRow]:
    """Return the rows that carry the same identity as this one, including itself."""
    if not row.candidate.same_as:
        return [row]
    return [other for other in rows if other.candidate.same_as == row.candidate.same_as]


def choose(rows: Sequence[EditedRow], row: EditedRow, number: str) -> None:
    """Take over the number that the person chose for a row, and what follows from it for its group."""
    row.number, row.checked = number, True
    asked = [other for other in group(rows, row) if other.number == ASK and not other.finished]
    last = len(asked) == 1 and all(
        other.number != SAME for other in group(rows, row) if other is not asked[0]
    )
    # "The same part" holds for all of them; once all others are new parts, the last one is the part itself.
    for other in asked if number == SAME or last else ():
        other.number, other.checked = SAME, True


def set_all(rows: Iterable[EditedRow], column: str, value: str, categories: Mapping[str, str]) -> None:
    """Take over one value for all of these rows; a category that a person chose is no guess.

    column
        of :data:`silo.registering.request.CHOSEN`. In a name ``{name}`` is the present name, ``{n}`` counts.
    """
    for number, row in enumerate((row for row in rows if row.editable), start=1):
        if column == "name":
            if not row.candidate.entry.is_standard:
                row.name = filled(value, name=row.name, n=number)
        elif column == "item_type":
            retype(row, value, categories)
        else:
            setattr(row, column, value)
            if column.startswith("supplier") and value:
                row.sourcing = "purchased"
            row.checked = row.checked or (column == "category" and row.can_register)


def grouped(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Group the components by folder, in the order of their first ones. The assembly's folder comes last,
    then the components without a folder.
    """
    plain_ones = [candidate for candidate in candidates if _folder_of(candidate)]
    folders = list(dict.fromkeys(_folder_of(candidate) for candidate in plain_ones))
    if plain_ones:
        folders.append(_folder_of(plain_ones[-1]))
    order = {folder: number for number, folder in enumerate(folders)}
    others = [candidate for candidate in candidates if not _folder_of(candidate)]
    return [*sorted(plain_ones, key=lambda candidate: order[_folder_of(candidate)]), *others]


def _folder_of(candidate: Candidate) -> str:
    is_plain = candidate.article is None and not candidate.entry.is_standard
    return os.path.dirname(candidate.entry.doc_path) if is_plain else ""


def headings(rows: Sequence[EditedRow]) -> list[str]:
    """Return the heading above each row; a component has that of its folder if there are several folders."""
    folders = {_folder_of(row.candidate) for row in rows} - {""}
    words = section_words()
    base = os.path.dirname(os.path.commonpath(folders)) if folders else ""
    return [
        plain(os.path.relpath(folder, base), 120)
        if (folder := _folder_of(row.candidate)) and len(folders) > 1
        else words[row.section]
        for row in rows
    ]


def retype(row: EditedRow, item_type: str, categories: Mapping[str, str]) -> None:
    """Take over the chosen type; the category follows if it is still the one that was proposed.

    categories
        code → description, as the schema has them.
    """
    request = row.request().retyped(item_type, categories)
    row.item_type, row.category = request.item_type, request.category


def number_texts(rows: list[EditedRow], numbers: Mapping[str, str]) -> list[str]:
    """Write the number column of all rows."""
    taken: dict[str, int] = {}
    texts = []
    for row in rows:
        texts.append(row.number_text(numbers, taken.get(row.category, 0)))
        if row.number == NEW and row.checked and not row.finished:
            taken[row.category] = taken.get(row.category, 0) + 1
    return texts


def notices(offer: Offer) -> str:
    """Write the notices about the whole offer: mistakes in the site's rules, and that Silo was not
    searched.
    """
    texts = [rules_text(getattr(offer.categories, "problem", ""), translate)]
    if offer.unsearched:
        texts.append(
            translate(
                "Silo",
                "Silo was not searched for parts that look alike: {problem}",
                problem=plain(offer.unsearched, 300),
            )
        )
    return "\n".join(filter(None, texts))


def heading(rows: Sequence[EditedRow], title: str, more: int) -> str:
    """Write the text above the rows; ``more``: how many rows are not shown."""
    components = [row for row in rows if row.candidate.article is None]
    if not components:
        return translate(
            "Silo", "All components of {name} have their Silo part number.", name=plain(title, 80)
        )
    left = [row for row in components if not row.finished]
    if not left:
        return translate("Silo", "All of these have their part number now.")
    copied = sum(1 for row in left if row.candidate.same_as)
    lines = [_unregistered(len(left) - copied)] if len(left) > copied else []
    if copied:
        lines.append(
            translate(
                "Silo",
                "Where files carry one identity, choose in the column Part number: the same part, or a "
                "new one?",
            )
        )
    if more > 0:
        lines.append(translate("Silo", "({n} more after these)", n=more))
    return "\n".join(lines)


def _unregistered(left: int) -> str:
    text = translate(
        "Silo",
        "The following component has no Silo part number and will be excluded from the BOM until registered:",
    )
    many = translate(
        "Silo",
        "The following components have no Silo part number and will be excluded from the BOM until "
        "registered:",
    )
    return counted(left, text, many)


class RegisterWindow(Protocol):
    """An open dialog; :mod:`silo.workbench.register.dialog` is the real one."""

    def fill(self, offer: Offer, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def set_number(self, category: str, number: str, /) -> None: ...

    def registered(self, request: RegistrationRequest, result: Registration, /) -> None: ...

    def undeclared(self, row: EditedRow, /, *, no_part: bool) -> None: ...

    def taken_back(self, request: RegistrationRequest, error: SiloError | None, /) -> None: ...

    def show_pictures(self, pictures: Mapping[str, bytes], /) -> None: ...

    def stopped(self) -> None: ...

    def tell(self, text: str, /) -> None: ...

    def raise_(self) -> None: ...


class RegisterFlow:
    """Opens the dialog, one per document, and carries out what it asks for."""

    def __init__(
        self,
        session: Session,
        preferences: Preferences,
        commits: CommitFlow,
        desk: RegisterDesk,
        *,
        journal: Journal | None = None,
    ) -> None:
        self._session, self._preferences, self._commits = session, preferences, commits
        self._desk = desk
        self._journal = journal or Journal()
        self._open: dict[str, RegisterWindow] = {}
        # Path → what the last press of Register did there.
        self._last: dict[str, list[tuple[RegistrationRequest, Registration]]] = {}

    def start(self, doc: Any) -> None:
        """Open a dialog with the components of a document that have no number."""
        try:
            taken = self._commits.snapshot(doc)
        except SiloError as error:
            self._desk.warn(translate("Silo", "Register Components"), str(error))
            return
        self._dialog(taken)
        extraction = whole(taken)
        seen = self._desk.look_at(
            entry.doc_path for entry in walk_entries((extraction.assembly, *extraction.entries))
        )
        schema = self._preferences.text("Schema")
        self._session.ask(
            translate("Silo", "Looking for components without a part number"),
            lambda client, control: offer(extraction, seen, client, schema, control, self._journal.pending()),
            done=lambda new_offer: self._show_offer(taken.path, new_offer),
            failed=lambda error: self._with_dialog(taken.path, lambda dialog: dialog.fail(error)),
        )

    def _show_offer(self, path: str, new_offer: Offer) -> None:
        self._with_dialog(path, lambda dialog: dialog.fill(new_offer))
        files = {candidate.entry.doc_path for candidate in new_offer.candidates if candidate.entry.doc_path}

        def show(pictures: Mapping[str, bytes]) -> None:
            self._with_dialog(path, lambda dialog: dialog.show_pictures(pictures))

        self._session.aside(
            translate("Silo", "Reading pictures"),
            lambda _control: {file: picture for file in files if (picture := picture_in(file))},
            done=show,
            failed=lambda _error: None,  # the rows are shown without them
        )

    def _dialog(self, taken: Snapshot) -> None:
        if taken.path in self._open:
            self._open[taken.path].raise_()
            return
        asks = self._preferences.flag("AskRegister")
        self._open[taken.path] = self._desk.register_window(taken.label, taken.path, self, asks=asks)

    def closed(self, path: str) -> None:
        """Forget the closed dialog of this document."""
        self._open.pop(path, None)
        self._last.pop(path, None)

    def ask_again(self, on: bool) -> None:
        """Set if a person wants to be asked after each commit."""
        self._preferences.set("AskRegister", on)

    def _with_dialog(self, path: str, call: Callable[[RegisterWindow], None]) -> None:
        if path in self._open:
            call(self._open[path])

    def number(self, path: str, category: str) -> None:
        """Ask for the next number of a category."""
        schema = self._preferences.text("Schema")
        self._session.ask(
            translate("Silo", "Asking for the next number"),
            lambda client, _control: next_number(client, schema, category),
            done=lambda number: self._with_dialog(path, lambda d: d.set_number(category, number)),
            failed=lambda _error: None,
        )

    def undeclare(self, path: str, row: EditedRow, *, no_part: bool = False) -> None:
        """Undo decisions about what is modelled in the assembly's file; an item stays.

        no_part
            a person says that it is no part, and the file records that.
        """
        clean = self._desk.unedited()
        try:
            self._desk.remove_identity(row.candidate, no_part=no_part)
        except SiloError as error:
            message = str(error)
            self._with_dialog(path, lambda dialog: dialog.tell(message))
            return
        self._with_dialog(path, lambda dialog: dialog.undeclared(row, no_part=no_part))
        self._save_parents(clean, lambda: self._send(path, [row.candidate]))

    def same(self, rows: Sequence[EditedRow]) -> None:
        """Accept that these files are one part on purpose."""
        files: dict[str, list[str]] = {}
        for row in rows:
            if identity := row.candidate.entry.silo_uuid:
                files.setdefault(identity, []).append(row.candidate.entry.doc_path)
        for identity, paths in files.items():
            if len(set(paths)) > 1:
                self._commits.accept(identity, paths)

    # -- registering ------------------------------------------------------------------------------------

    def register(self, path: str, requests: Sequence[RegistrationRequest]) -> None:
        """Give these components their numbers, one after another."""
        schema = self._preferences.text("Schema")
        registered: list[Candidate] = []
        last = self._last[path] = []
        clean = self._desk.unedited()

        def run(client: Any, control: Any) -> None:
            def tell(request: RegistrationRequest, result: Registration) -> None:
                if result.error is None:
                    registered.append(request.candidate)
                    last.append((request, result))
                self._session.in_gui(lambda: self._show_registered(path, request, result), control)

            carry_out(
                requests,
                client,
                self._journal,
                lambda candidate, identity: self._session.in_gui(
                    lambda: self._desk.write_identity(candidate, identity), control
                ),
                schema=client.find_schema(schema),
                control=control,
                done=tell,
            )

        def finished(_result: Any = None) -> None:
            self._with_dialog(path, lambda dialog: dialog.stopped())
            # The numbers that were shown before are used now.
            for category in sorted({request.category for request in requests}):
                self.number(path, category)
            self._save_parents(clean if registered else [], lambda: self._send(path, registered))

        def failed(error: SiloError) -> None:
            if error.code != "cancelled":
                self._with_dialog(path, lambda dialog: dialog.tell(str(error)))
            finished()

        self._session.ask(translate("Silo", "Registering"), run, done=finished, failed=failed)

    def can_take_back(self, path: str) -> bool:
        """Return True if the last press of Register did something that can be undone."""
        return any(not request.candidate.entry.is_standard for request, _ in self._last.get(path, ()))

    def take_back(self, path: str) -> None:
        """Undo the last press of Register: new items are archived, and the files forget them."""
        done = self._last.pop(path, [])
        ids = {result.item_id for _, result in done}
        clean = self._desk.unedited()
        for entry in self._session.shown.waiting:  # not sent yet, and of an item that goes
            if entry.identity in ids:
                self._session.discard(entry.id)

        def run(client: Any, control: Any) -> None:
            def back(request: RegistrationRequest, error: SiloError | None) -> None:
                def tell() -> None:
                    self._with_dialog(path, lambda dialog: dialog.taken_back(request, error))

                self._session.in_gui(tell, control)

            take_back(
                done,
                client,
                self._journal,
                lambda candidate: self._session.in_gui(
                    lambda: self._desk.restore_identity(candidate), control
                ),
                control=control,
                back=back,
            )

        def finished(_result: Any = None) -> None:
            self._with_dialog(path, lambda dialog: dialog.stopped())
            top = self._desk.find(path)
            self._save_parents(clean, lambda: self._commits.sync_only(top) if top is not None else None)

        def failed(error: SiloError) -> None:
            self._with_dialog(path, lambda dialog: dialog.tell(str(error)))
            finished()

        self._session.ask(translate("Silo", "Undoing"), run, done=finished, failed=failed)

    def _save_parents(self, clean: list[Any], then: Callable[[], None]) -> None:
        """Save, one in a turn, the documents that FreeCAD marked because their parts were saved."""
        if not clean:
            then()
            return
        with suppress(ReferenceError):  # closed meanwhile
            self._desk.save_marked(clean[0])
        self._desk.later(lambda: self._save_parents(clean[1:], then))

    def _show_registered(self, path: str, request: RegistrationRequest, result: Registration) -> None:
        self._with_dialog(path, lambda dialog: dialog.registered(request, result))

    def _send(self, path: str, registered: Sequence[Candidate]) -> None:
        """Upload the files that have an item now, and sync the assembly's BOM with the new lines."""
        if not registered:
            return
        # A copy that became a separate part needs no decision any more.
        own = {candidate.entry.doc_path for candidate in registered}
        self._session.answered(lambda asked: not own.isdisjoint(asked.objects))
        registered_now = translate("Silo", "Registered")

        def comment(file: str) -> str:
            return self._commits.comment_of(file) or registered_now

        # A file that gives several parts is no single item's.
        for part in dict.fromkeys(c.entry.doc_path for c in registered if not c.shares_file):
            doc = self._desk.find(part)
            if doc is not None and part != path:
                self._commits.send(doc, comment(part))
        top = self._desk.find(path)
        if top is None:
            return
        if any(candidate.entry.doc_path == path for candidate in registered):
            self._commits.send(top, comment(path))
        else:
            self._commits.sync_only(top)


def whole(taken: Snapshot) -> Extraction:
    """Return the extraction of a snapshot; for a part, an extraction of the part alone."""
    if taken.extraction is not None:
        return taken.extraction
    label = taken.label or os.path.basename(taken.path)
    return Extraction(
        BomEntry(taken.path, silo_uuid=taken.identity, label=label, document_label=label, level=0)
    )
