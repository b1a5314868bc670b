# SPDX-License-Identifier: LGPL-2.1-or-later
"""A component without a part number, and what is known of it before it is registered.

A look-alike on the server (:class:`Similar`) is a suggestion only: the user decides.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from silo.bom.entry import BomEntry
from silo.bom.items.proposal import Proposal
from silo.registering.modelled import Modelled


class ComponentState(StrEnum):
    """How a component's file stands."""

    READY = "ready"
    EDITED = "edited"  # has unsaved edits, which are saved along with the identity
    ELSEWHERE = "elsewhere"  # another FreeCAD has it open, and may overwrite what is saved here
    READ_ONLY = "read-only"
    PARTIAL = "partial"  # unsaved edits in a partly loaded document: FreeCAD cannot save them
    NEWER = "newer"  # saved or registered elsewhere since it was opened here
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
class Candidate:
    """One row of the dialog.

    same_as
        part number whose identity the file carries although another file has it too ("copied identity").
    twin
        label of another row whose file has the very same content; "" if there is none.
    article
        what is modelled in the assembly's own file: counted once it has an identity.
    learnt
        the category is what the user chose for a part of the same words in the same folder.
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
        """Return True if the component is modelled in the assembly's file, and the user has decided
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
        """Return True if it is checked at the beginning, since the user need not look at it first."""
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
            (other for other in same if other.entry.doc_path != candidate.entry.doc_path),
            None,
        )
