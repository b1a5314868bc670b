# SPDX-License-Identifier: LGPL-2.1-or-later
"""The Register Parts dialog as its flow sees it; :mod:`silo.workbench.register.dialog` is the real one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from silo.bom.errors import SiloError
from silo.registering.items import Registration
from silo.registering.offer import Candidate, Offer, Seen
from silo.registering.orders import Order
from silo.workbench.commit.desk import Desk
from silo.workbench.register.rows import EditedRow


@dataclass(frozen=True)
class Wishes:
    """What the dialog asks for; all in the GUI thread.

    same
        the person says that these copied identities are one part.
    number
        tell the next number of this category.
    undeclare
        this is no component any more; what is modelled in the assembly's own file.
    closed
        the dialog is gone.
    """

    register: Callable[[Sequence[Order]], None]
    same: Callable[[Sequence[EditedRow]], None]
    number: Callable[[str], None]
    ask_again: Callable[[bool], None]
    undeclare: Callable[[EditedRow], None]
    closed: Callable[[], object]


class Window(Protocol):
    """An open dialog."""

    def fill(self, offer: Offer, /) -> None: ...

    def fail(self, error: SiloError, /) -> None: ...

    def set_number(self, category: str, number: str, /) -> None: ...

    def registered(self, order: Order, result: Registration, /) -> None: ...

    def undeclared(self, row: EditedRow, /) -> None: ...

    def stopped(self) -> None: ...

    def tell(self, text: str, /) -> None: ...

    def show(self) -> None: ...

    def raise_(self) -> None: ...


class RegisterDesk(Desk, Protocol):
    """A desk that can open the dialog, look at components' files, and write identities into them."""

    def register_window(self, title: str, wishes: Wishes, /, *, asks: bool) -> Window: ...

    def look_at(self, paths: Iterable[str], /) -> dict[str, Seen]: ...

    def write_identity(self, candidate: Candidate, identity: str, /) -> None: ...

    def remove_identity(self, candidate: Candidate, /) -> None: ...

    def unedited(self) -> list[Any]:
        """The documents without unsaved edits, each after those that it links to."""

    def save_marked(self, doc: Any, /) -> None:
        """Save a document that was unedited, where FreeCAD has marked it for something below it."""
