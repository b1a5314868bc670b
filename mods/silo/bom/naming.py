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

from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry

_MOST_READ = 2000
_SUFFIX = re.compile(r"\.fcstd$", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d_]{3,}")
# BasePlate is two words.
_HUMP = re.compile(r"(?<=[a-z])(?=[A-Z])")
# Labels that FreeCAD gives by itself say nothing of the part.
_GENERIC = re.compile(
    r"(?:body|part|assembly|model|unnamed|link|compound|solid|fusion|cut)[ _]?\d*$", re.IGNORECASE
)
_STANDARD_WORDS = ("fastener", "screw", "hardware", "standard part", "purchased", "bought")
# In the order of preference, for components whose name fits no category.
_PART_WORDS = ("part", "machin", "custom", "manufactur", "component", "mechanic")


@dataclass(frozen=True)
class Proposal:
    """How a component would be registered. ``shares_file``: its file gives other components too."""

    entry: BomEntry
    name: str
    item_type: str
    category: str
    shares_file: bool = False


def is_generic(label: str) -> bool:
    """True for a label that FreeCAD gave by itself, and for none."""
    return not label or _GENERIC.match(label) is not None


def clean_name(text: str) -> str:
    """A label as a name for people: no file suffix, no control characters, single spaces."""
    # A label may be megabytes long, and no more than the beginning of it is used.
    text = _SUFFIX.sub("", unicodedata.normalize("NFC", text[:_MOST_READ]))
    printable = "".join(" " if unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp") else c for c in text)
    return " ".join(printable.replace("_", " ").split())[:200]


def crowded_files(entries: Iterable[BomEntry]) -> frozenset[str]:
    """Files that give more than one component of this tree; standard parts need no place in a file."""
    files = Counter(entry.doc_path for entry in walk_entries(entries) if not entry.is_standard)
    return frozenset(path for path, count in files.items() if count > 1)


def proposed_name(entry: BomEntry, *, shares_file: bool = False) -> str:
    """The document's label (spec §2), or the object's where that says more.

    FreeCAD makes a document's label from its file's name; only one that a person chose (it differs) stands
    before an object's own label. Where a file gives several components, the object's label tells them apart.
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


def _stems(text: str) -> set[str]:
    words = {word.casefold() for word in _WORD.findall(_HUMP.sub(" ", text))}
    return {word[:-1] if word.endswith("s") and len(word) > 3 else word for word in words}


def proposed_category(entry: BomEntry, name: str, categories: Mapping[str, str]) -> str:
    """The category code that fits best; "" where there is none to choose from.

    categories
        code → description, in the schema's order.
    """
    of_assemblies = {code for code, text in categories.items() if "assembl" in text.casefold()}
    fitting = [code for code in categories if (code in of_assemblies) == entry.is_assembly]
    if not fitting:
        return next(iter(categories), "")
    for wanted in _STANDARD_WORDS if entry.standard else ():
        for code in fitting:
            if wanted in categories[code].casefold():
                return code
    words = _stems(name)
    scored = [(len(words & _stems(categories[code])), code) for code in fitting]
    best = max(score for score, _ in scored)
    if best and not entry.is_assembly:
        return next(code for score, code in scored if score == best)
    for wanted in () if entry.is_assembly else _PART_WORDS:
        for code in fitting:
            if wanted in categories[code].casefold():
                return code
    return fitting[0]


def propose(entry: BomEntry, categories: Mapping[str, str], *, shares_file: bool = False) -> Proposal:
    """Type from the document, name from the label, category from the schema."""
    name = proposed_name(entry, shares_file=shares_file)
    return Proposal(
        entry=entry,
        name=name,
        item_type="assembly" if entry.is_assembly else "part",
        category=proposed_category(entry, name, categories),
        shares_file=shares_file,
    )


def propose_all(
    entries: Iterable[BomEntry], tree: Iterable[BomEntry], categories: Mapping[str, str]
) -> list[Proposal]:
    """A proposal for each; ``tree`` is all that the assembly holds, and says which files are shared."""
    crowded = crowded_files(tree)
    return [propose(entry, categories, shares_file=entry.doc_path in crowded) for entry in entries]
