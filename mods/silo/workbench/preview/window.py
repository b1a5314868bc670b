# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview window as its flow sees it; :mod:`silo.workbench.preview.dialog` is the real one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from silo.bom.errors import SiloError
from silo.bom.findings import Finding
from silo.bom.model import Extraction
from silo.workbench.commit.desk import Desk
from silo.workbench.preview.rows import Preview


class Account(Protocol):
    """One assembly's solids (:class:`silo.workbench.freecad.witness.Account`)."""

    @property
    def doc_path(self) -> str: ...

    @property
    def agrees(self) -> bool: ...

    @property
    def unexplained(self) -> tuple[str, ...]: ...

    def sentence(self) -> str: ...


@dataclass(frozen=True)
class Wishes:
    """What the window asks for; all in the GUI thread.

    sync
        (preview, sub-assemblies too, although links are broken).
    show
        select instances: (document, objects).
    verify
        compare the BOM with what the 3D view shows.
    relink
        lead broken links to the files that were meant.
    closed
        the window is gone.
    """

    refresh: Callable[[], None]
    sync: Callable[[Preview, bool, bool], None]
    register: Callable[[Preview], None]
    show: Callable[[str, tuple[str, ...]], None]
    view: Callable[[Preview], None]
    verify: Callable[[Preview], None]
    relink: Callable[[Preview], None]
    closed: Callable[[], object]


class Window(Protocol):
    """An open preview."""

    def busy(self) -> None: ...

    def fill(self, preview: Preview, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def tell_view(self, text: str, /, *, agrees: bool) -> None: ...

    def show(self) -> None: ...

    def raise_(self) -> None: ...


class PreviewDesk(Desk, Protocol):
    """A desk that can open previews."""

    def preview_window(self, title: str, wishes: Wishes, /) -> Window: ...

    def accounts(self, extraction: Extraction, /) -> Sequence[Account]:
        """The solids that FreeCAD shows, for the assembly and each sub-assembly."""

    def relink(self, finding: Finding, /) -> list[str]:
        """Set the live links of a finding to the file that was meant; their labels."""
