# SPDX-License-Identifier: LGPL-2.1-or-later
"""What to call a component (spec bom-sync §2, §6)."""

from __future__ import annotations

import os.path
import re

from silo.bom.entry import BomEntry
from silo.bom.message import message
from silo.bom.text import clean_name

# Labels that FreeCAD or an import gives by itself say nothing of the part.
_GENERIC = re.compile(
    r"(?:body|part(?:[_ ]+feature)?|assembly|model|unnamed|link|compound|solid|shell|shape|fusion|cut"
    r"|open cascade step translator.*)[ _]?\d*$|.*\.(?:stp|step|igs|iges|brp|brep)[ _]?\d*$",
    re.IGNORECASE,
)


def is_generic(label: str) -> bool:
    """Return True if FreeCAD gave the label by itself, or if it is empty."""
    return not label or _GENERIC.match(label) is not None


def proposed_name(entry: BomEntry, *, shares_file: bool = False) -> str:
    """Return the document's label (spec §2), the object's if it says more, or the file's name.

    FreeCAD makes a document's label from its file's name; only a label that a user chose (it differs) comes
    before an object's own label. If a file gives several components, the object's label decides.
    """
    if entry.standard:
        return entry.standard
    of_document, of_object = clean_name(entry.document_label), clean_name(entry.label)
    stem = clean_name(os.path.splitext(os.path.basename(entry.doc_path))[0])
    of_document = stem if of_document and is_generic(of_document) else of_document
    chosen = of_document not in ("", stem)
    if of_object and not _GENERIC.match(of_object) and (shares_file or not chosen):
        return of_object
    return of_document or of_object or message("Unnamed component")


def own_part_name(entry: BomEntry) -> str:
    """Return the name of a part modelled in an assembly's own file: its label, with the file's name where
    FreeCAD gave the label, so that the lines of six bodies differ.
    """
    label = clean_name(entry.label) or entry.object_name
    named = display_name(entry)
    return named if not is_generic(label) or entry.standard or named == label else f"{named}: {label}"


def display_name(entry: BomEntry) -> str:
    """Return the name of a component for people: its own label, or its document's if that says nothing.

    A standard part has its designation as its name.
    """
    if entry.standard:
        return entry.standard
    label = clean_name(entry.label)
    name = label if label and not _GENERIC.match(label) else clean_name(entry.document_label) or label
    return with_values(name, entry.variant)


def with_values(name: str, values: str) -> str:
    """Add the values of a variant to a name, as in "Profile, L = 300 mm", unless the name has them."""
    return f"{name}, {values}" if values and not name.endswith(values) else name
