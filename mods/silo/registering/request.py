# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the user asks for one component: a new item with these values, or an item that is there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from silo.bom.errors import InputError, NotFoundError
from silo.bom.items.categories import proposed_category
from silo.bom.items.proposal import Proposal
from silo.bom.message import message
from silo.registering.candidate import Candidate, Similar

ITEM_TYPES = ("part", "assembly", "consumable", "tool")
# What the user may change of a proposal.
CHOSEN = ("name", "item_type", "category", "sourcing", "supplier", "supplier_part_number")


@dataclass(frozen=True)
class RegistrationRequest:
    """What is to be registered, as the user left it.

    existing
        item to join instead of making a new one.
    apart
        of equal copies that are modelled in the file, each gets an item of its own.
    sourcing
        "manufactured" or "purchased"; "" if it is not known.
    """

    candidate: Candidate
    name: str
    item_type: str
    category: str
    existing: Similar | None = None
    apart: bool = False
    sourcing: str = ""
    supplier: str = ""
    supplier_part_number: str = ""

    @classmethod
    def of(cls, candidate: Candidate) -> RegistrationRequest:
        """Make a request of a candidate, as it was proposed."""
        return cls(candidate, **{name: getattr(candidate.proposal, name) for name in CHOSEN})

    @property
    def proposal(self) -> Proposal:
        return replace(self.candidate.proposal, **{name: getattr(self, name) for name in CHOSEN})

    @property
    def teaches(self) -> bool:
        """Return True if the user chose something that is proposed for the next part with such a name."""
        before, entry = self.candidate.proposal, self.candidate.entry
        changed = (self.category, self.sourcing) != (before.category, before.sourcing)
        return changed and not entry.is_standard and not entry.is_assembly and self.existing is None

    def retyped(self, item_type: str, categories: Mapping[str, str]) -> RegistrationRequest:
        """Change the type of the request; the category follows if it is one that was proposed.

        categories
            code → description, as the schema has them.
        """

        def proposed(kind: str) -> str:
            entry = replace(self.candidate.entry, is_assembly=kind == "assembly")
            return proposed_category(entry, self.name, categories).code

        follows = self.category in (self.candidate.proposal.category, proposed(self.item_type))
        return replace(self, item_type=item_type, category=proposed(item_type) if follows else self.category)


AS_UTF_8 = message("save the table as CSV (UTF-8)")


def wrong_name(name: str, candidate: Candidate) -> str:
    """Say what is wrong with an item's name; "" if nothing is."""
    if not name:
        return message("name: it is empty")
    if candidate.entry.standard and name != candidate.entry.standard:
        return message(
            "name: a standard part is called by its designation, {standard}",
            standard=candidate.entry.standard,
        )
    try:
        name.encode("utf-8")
    except UnicodeEncodeError:
        return message("name: {name} is no UTF-8; {advice}", name=repr(name), advice=AS_UTF_8)
    if "\ufffd" in name:
        return message("name: {name} has lost letters (�); {advice}", name=repr(name), advice=AS_UTF_8)
    if len(name) > 200 or not name.isprintable():
        return message(
            "name: wanted one line of at most 200 characters that can be seen, got {name}",
            name=repr(name[:50]),
        )
    return ""


def find_item(number: str, candidate: Candidate, api: Any) -> Similar:
    """Find the item that a component joins. InputError if it cannot."""
    if candidate.entry.is_standard:
        raise InputError(message("a standard part has its item by its designation; leave this empty"))
    try:
        item = api.get_item(number)
    except NotFoundError:
        raise InputError(
            message("there is no item {number}; leave it empty for a new one", number=number)
        ) from None
    if (item.item_type == "assembly") != (candidate.proposal.item_type == "assembly"):
        raise InputError(
            message(
                "{number} is an item of type {item_type}; the file holds another type",
                number=number,
                item_type=item.item_type,
            )
        )
    return Similar(item.part_number, item.id, item.name)
