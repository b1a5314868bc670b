# SPDX-License-Identifier: LGPL-2.1-or-later
"""What to propose for a component that has no item yet: name, type and category (spec bom-sync §2, §6).

Only a proposal: a person confirms it, or says ``--yes``. Part numbers are made by the server.
"""

from __future__ import annotations

import os.path
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from silo.bom.categories import proposed_category
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry

_MOST_READ = 2000
_SUFFIX = re.compile(r"\.fcstd$", re.IGNORECASE)
# Labels that FreeCAD gives by itself say nothing of the part.
_GENERIC = re.compile(
    r"(?:body|part|assembly|model|unnamed|link|compound|solid|fusion|cut)[ _]?\d*$", re.IGNORECASE
)


@dataclass(frozen=True)
class Proposal:
    """How a component would be registered.

    shares_file
        its file gives other components too.
    is_guess
        the category was found by little: a person has to look at it first.
    """

    entry: BomEntry
    name: str
    item_type: str
    category: str
    shares_file: bool = False
    is_guess: bool = False


def is_generic(label: str) -> bool:
    """True for a label that FreeCAD gave by itself, and for none."""
    return not label or _GENERIC.match(label) is not None


def clean_name(text: str) -> str:
    """A label as a name for people: no file suffix, no control characters, single spaces."""
    # A label may be megabytes long, and no more than the beginning of it is used.
    text = _SUFFIX.sub("", unicodedata.normalize("NFC", text[:_MOST_READ]))
    printable = "".join(" " if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") else c for c in text)
    return " ".join(printable.replace("_", " ").split())[:200]


def name_key(text: str) -> str:
    """What two names have in common that read as one: cleaned, in any case."""
    return clean_name(text).casefold()


def crowded_files(entries: Iterable[BomEntry]) -> frozenset[str]:
    """Files that give more than one component of this tree; standard parts need no place in a file."""
    files = Counter(entry.doc_path for entry in walk_entries(entries) if not entry.is_standard)
    return frozenset(path for path, count in files.items() if count > 1)


def proposed_name(entry: BomEntry, *, shares_file: bool = False) -> str:
    """The document's label (spec §2), or the object's where that says more.

    FreeCAD makes a document's label from its file's name; only one that a person chose (it differs) stands
    before an object's own label. Where a file gives several components, the object's label decides.
    """
    if entry.standard:
        return entry.standard
    of_document, of_object = clean_name(entry.document_label), clean_name(entry.label)
    stem = clean_name(os.path.splitext(os.path.basename(entry.doc_path))[0])
    chosen = of_document not in ("", stem)
    if of_object and not _GENERIC.match(of_object) and (shares_file or not chosen):
        return of_object
    return of_document or of_object or "Unnamed component"


def display_name(entry: BomEntry) -> str:
    """What to call a component before people: its own label, or its document's where that says nothing.

    A standard part is called by its designation.
    """
    if entry.standard:
        return entry.standard
    label = clean_name(entry.label)
    return label if label and not _GENERIC.match(label) else clean_name(entry.document_label) or label


def propose(entry: BomEntry, categories: Mapping[str, str], *, shares_file: bool = False) -> Proposal:
    """Type from the document, name from the label, category from the schema."""
    name = proposed_name(entry, shares_file=shares_file)
    guess = proposed_category(entry, name, categories)
    return Proposal(
        entry=entry,
        name=name,
        item_type="assembly" if entry.is_assembly else "part",
        category=guess.code,
        shares_file=shares_file,
        is_guess=not guess.is_sure,
    )


def propose_all(
    entries: Iterable[BomEntry], tree: Iterable[BomEntry], categories: Mapping[str, str]
) -> list[Proposal]:
    """A proposal for each; ``tree`` is all that the assembly holds, and says which files are shared."""
    crowded = crowded_files(tree)
    return [propose(entry, categories, shares_file=entry.doc_path in crowded) for entry in entries]
