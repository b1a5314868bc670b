# SPDX-License-Identifier: LGPL-2.1-or-later
"""The preview window as its flow sees it; :mod:`silo.workbench.preview.dialog` is the real one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from silo.bom.errors import SiloError
from silo.workbench.commit.desk import Desk
from silo.workbench.preview.rows import Preview


@dataclass(frozen=True)
class Wishes:
    """What the window asks for; all in the GUI thread.

    sync
        (preview, sub-assemblies too, although links are broken).
    show
        select instances: (document, objects).
    closed
        the window is gone.
    """

    refresh: Callable[[], None]
    sync: Callable[[Preview, bool, bool], None]
    register: Callable[[Preview], None]
    show: Callable[[str, tuple[str, ...]], None]
    view: Callable[[Preview], None]
    closed: Callable[[], object]


class Window(Protocol):
    """An open preview."""

    def busy(self) -> None: ...

    def fill(self, preview: Preview, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def show(self) -> None: ...

    def raise_(self) -> None: ...


class PreviewDesk(Desk, Protocol):
    """A desk that can open previews."""

    def preview_window(self, title: str, wishes: Wishes, /) -> Window: ...
