# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rows of the Register Parts dialog while they are edited. Pure; the dialog only draws them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from silo.bom_sync.activity_text import rules_text
from silo.registering.candidate import Candidate, ComponentState, Similar
from silo.registering.items import Registration
from silo.registering.offer import Offer
from silo.registering.request import CHOSEN, RegistrationRequest
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
        "variant": translate("Silo", "Configured copies of parts"),
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
    UNSURE = "unsure"  # a user has to look at them first
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
            if article.variant_of:
                return "variant"
            return "no part" if article.no_part else "declared" if article.declared else "modelled"
        return "standard" if self.candidate.entry.is_standard else ""

    @property
    def is_modelled(self) -> bool:
        """Return True if it is modelled in the assembly's own file; a configured copy is not."""
        article = self.candidate.article
        return article is not None and not article.variant_of

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
        """Return True if a user can say that it is no part."""
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
        """Return True while its category is a guess that was not looked at."""
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
        article = self.candidate.article
        if article is not None and len(article.objects) > 1 and not article.variant_of:
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
        if article.variant_of and not article.declared:
            text = translate("Silo", "counts as {name}; check it to give it a number of its own")
            return [text.replace("{name}", plain(article.variant_of, 60))]
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
    """Take over one value for all of these rows; a category that a user chose is no guess.

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
