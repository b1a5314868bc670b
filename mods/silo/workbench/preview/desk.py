# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a preview asks of FreeCAD and its user, beside what all flows ask (:mod:`silo.workbench.desk`)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from silo.workbench.desk import Desk

if TYPE_CHECKING:
    from silo.bom.entry import Extraction
    from silo.bom.findings import Finding
    from silo.bom.key import Key
    from silo.workbench.preview.flow import PreviewFlow, PreviewWindow


class CountedSolids(Protocol):
    """One assembly's solids (:class:`silo.workbench.freecad.witness.SolidCount`)."""

    @property
    def doc_path(self) -> str: ...

    @property
    def agrees(self) -> bool: ...

    @property
    def unexplained(self) -> tuple[str, ...]: ...

    def sentence(self) -> str: ...


class PreviewDesk(Desk, Protocol):
    """The desk as a preview needs it."""

    def preview_window(self, title: str, path: str, flow: PreviewFlow, /) -> PreviewWindow:
        """Open the preview of a document."""

    def accounts(self, extraction: Extraction, /) -> Sequence[CountedSolids]:
        """Count the solids that FreeCAD shows, for the assembly and each sub-assembly."""

    def why(self, doc: Any, assembly: str, parts: Collection[Key], /) -> list[str]:
        """Say why an assembly of a document has this quantity of a part: the number, then each chain to
        it.
        """

    def write_answer(self, doc: Any, names: Collection[str], /, *, counts: bool) -> list[str]:
        """Keep in the objects of a document if they count; returns their labels."""

    def relink(self, finding: Finding, /) -> list[str]:
        """Set the live links of a finding to the file that was meant; returns their labels."""
