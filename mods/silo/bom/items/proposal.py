# SPDX-License-Identifier: LGPL-2.1-or-later
"""The name, type and category that are proposed for the new item of a component (spec bom-sync §2).

Only a proposal: the user confirms it, or says ``--yes``. Part numbers are made by the server.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from silo.bom.entry import BomEntry, walk_entries
from silo.bom.items.categories import proposed_category
from silo.bom.items.naming import proposed_name


@dataclass(frozen=True)
class Proposal:
    """How a component would be registered.

    shares_file
        its file gives other components too.
    is_guess
        the category was found by little: a user has to look at it first.
    sourcing
        "manufactured" or "purchased"; "" while it is not stated.
    """

    entry: BomEntry
    name: str
    item_type: str
    category: str
    shares_file: bool = False
    is_guess: bool = False
    sourcing: str = ""
    supplier: str = ""
    supplier_part_number: str = ""

    @property
    def supply(self) -> dict[str, str]:
        """Return the properties of the new item that say where to buy it."""
        supply_facts = {"supplier": self.supplier, "supplier_part_number": self.supplier_part_number}
        return {name: text for name, text in supply_facts.items() if text}


def crowded_files(entries: Iterable[BomEntry]) -> frozenset[str]:
    """Return the files that hold several components of this tree; standard parts do not count, nor do
    variants of a part.
    """
    files = Counter(
        entry.doc_path for entry in walk_entries(entries) if not (entry.is_standard or entry.variant)
    )
    return frozenset(path for path, count in files.items() if count > 1)


def propose(entry: BomEntry, categories: Mapping[str, str], *, shares_file: bool = False) -> Proposal:
    """Propose the type by the document, the name by the label, and the category by the schema."""
    name = proposed_name(entry, shares_file=shares_file)
    guess = proposed_category(entry, name, categories)
    return Proposal(
        entry=entry,
        name=name,
        item_type="assembly" if entry.is_assembly else "part",
        category=guess.code,
        shares_file=shares_file,
        is_guess=not guess.is_sure,
        sourcing="purchased" if entry.is_standard else "",
    )


def propose_all(
    entries: Iterable[BomEntry], tree: Iterable[BomEntry], categories: Mapping[str, str]
) -> list[Proposal]:
    """Make a proposal for each entry; ``tree`` is the whole assembly, and shows which files hold several
    components.
    """
    crowded = crowded_files(tree)
    return [propose(entry, categories, shares_file=entry.doc_path in crowded) for entry in entries]
