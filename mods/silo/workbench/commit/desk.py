# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the flows need of FreeCAD and of the person in front of it; :mod:`silo.workbench.freecad.live_desk`
has it.

With a desk of a test's own the flows run without FreeCAD and Qt. All calls are made in the GUI thread.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from silo.workbench.commit.plan import Documents, Plan, Row
from silo.workbench.commit.snapshot import Snapshot
from silo.workbench.commit.theirs import Choice, Theirs

if TYPE_CHECKING:
    from silo.bom.findings import Finding
    from silo.bom.model import Extraction
    from silo.registering.offer import Candidate, Seen
    from silo.workbench.preview.flow import PreviewFlow
    from silo.workbench.preview.flow import Window as Preview
    from silo.workbench.register.flow import RegisterFlow
    from silo.workbench.register.flow import Window as Registering

Look = Callable[[Callable[[Mapping[str, Theirs]], None]], object]


@dataclass(frozen=True)
class Answer:
    """What a person says in the commit dialog.

    register
        give it a part number as well.
    choices
        what to do about files that colleagues have changed, beside committing.
    """

    rows: tuple[Row, ...]
    comment: str = ""
    register: bool = False
    choices: tuple[tuple[Row, Theirs, Choice], ...] = ()


class Account(Protocol):
    """One assembly's solids (:class:`silo.workbench.freecad.witness.Account`)."""

    @property
    def doc_path(self) -> str: ...

    @property
    def agrees(self) -> bool: ...

    @property
    def unexplained(self) -> tuple[str, ...]: ...

    def sentence(self) -> str: ...


class Desk(Protocol):
    """FreeCAD's documents, its window, and a person."""

    @property
    def documents(self) -> Documents: ...

    def snapshot(self, doc: Any, /) -> Snapshot:
        """Snapshot of a live document."""

    def find(self, path: str, /) -> Any | None:
        """The open document of a file; None where it is not open."""

    def save_as(self, doc: Any, /) -> None:
        """Let a person give a document its first name."""

    def identity(self, doc: Any, /) -> str | None:
        """The item that a document belongs to, without looking at its components."""

    def is_registered(self, doc: Any, /) -> bool:
        """True where a document belongs to an item."""

    def ask(self, planned: Plan, note: str, comment: str, look: Look, /) -> Answer | None:
        """Which documents to commit, with which comment; None where the person does not want to.

        comment
            what the person wrote before and is not in Silo yet.
        look
            begins to look at Silo, and calls back with what colleagues did meanwhile.
        """

    def warn(self, title: str, text: str, /) -> None:
        """A message that a person must have seen."""

    def later(self, call: Callable[[], None], /) -> None:
        """Run something in a turn of its own, once the present event is done."""

    # -- files ------------------------------------------------------------------------------------------

    def open(self, path: str, /) -> Any:
        """The document of a file, opened whole."""

    def close(self, doc: Any, /) -> None:
        """Close a document without saving."""

    def save_copy(self, doc: Any, path: Path, /) -> None:
        """Write a document, with its unsaved edits, to another file."""

    def open_paths(self) -> tuple[str, ...]:
        """The files that this FreeCAD has open."""

    def is_open_elsewhere(self, path: str, /) -> bool:
        """True where another FreeCAD of this user has the file open."""

    # -- previews ---------------------------------------------------------------------------------------

    def preview_window(self, title: str, path: str, flow: PreviewFlow, /) -> Preview:
        """Open the preview of a document."""

    def accounts(self, extraction: Extraction, /) -> Sequence[Account]:
        """The solids that FreeCAD shows, for the assembly and each sub-assembly."""

    def relink(self, finding: Finding, /) -> list[str]:
        """Set the live links of a finding to the file that was meant; their labels."""

    # -- registering ------------------------------------------------------------------------------------

    def register_window(self, title: str, path: str, flow: RegisterFlow, /, *, asks: bool) -> Registering:
        """Open the Register Parts dialog of a document."""

    def look_at(self, paths: Iterable[str], /) -> dict[str, Seen]:
        """How the files of components stand."""

    def write_identity(self, candidate: Candidate, identity: str, /) -> None:
        """Write an identity into a component's document and save it."""

    def remove_identity(self, candidate: Candidate, /) -> None:
        """Take the identity from what is modelled in an assembly's own file, and save it."""

    def unedited(self) -> list[Any]:
        """The documents without unsaved edits, each after those that it links to."""

    def save_marked(self, doc: Any, /) -> None:
        """Save a document that was unedited, where FreeCAD has marked it for something below it."""
