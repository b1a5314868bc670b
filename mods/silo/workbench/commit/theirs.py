# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a colleague did to a file since it was opened here: the look at Silo, and its words. No widgets.

The look belongs in a worker; what it finds are values.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from silo.bom.changes import Assembly, ThreeLines
from silo.bom.errors import NotFoundError, RouteMissingError, SiloError
from silo.bom.naming import display_name
from silo.workbench.commit.opened import Base
from silo.workbench.words import counted, plain, quantity, translate

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.revisions import Standing
    from silo.api.transport import Cancel
    from silo.outbox.entry import Entry
    from silo.outbox.store import Store
    from silo.workbench.session.colleagues import Newer


class Choice(StrEnum):
    """What a person wants to be done about a file that a colleague has changed."""

    LEAVE = "leave"  # leave mine out of this commit
    OPEN = "open"  # open theirs beside mine
    TAKE = "take"  # take theirs; mine is kept aside
    ON_TOP = "on top"  # commit mine on top of theirs


def choice_texts() -> dict[Choice, str]:
    """The choices in words, the harmless one first."""
    return {
        Choice.LEAVE: translate("Silo", "leave out"),
        Choice.OPEN: translate("Silo", "open theirs beside mine"),
        Choice.TAKE: translate("Silo", "take theirs"),
        Choice.ON_TOP: translate("Silo", "commit mine on top"),
    }


@dataclass(frozen=True)
class Theirs:
    """A colleague's state of a file.

    part_number, revision
        theirs in Silo; "" and 0 where it is only the file on disk that is another one.
    base
        the number of the revision that mine was made from; None where nobody knows.
    lines
        the BOM base → theirs → mine, for assemblies.
    """

    path: str
    part_number: str = ""
    revision: int = 0
    who: str = ""
    when: float | None = None
    comment: str = ""
    base: int | None = None
    lines: tuple[ThreeLines, ...] = ()
    newer: Mapping[str, Any] | None = None

    @property
    def headline(self) -> str:
        """Who committed which revision, and what mine was made from."""
        if not self.revision:
            return translate("Silo", "the file on disk was changed since you opened it")
        text = translate("Silo", "{who} committed revision {n}; yours was made from {base}")
        if self.base is None:
            base = translate("Silo", "a file that is no revision in Silo")
        else:
            base = translate("Silo", "revision {n}").replace("{n}", str(self.base))
        who = plain(self.who, 60) or translate("Silo", "Somebody")
        return text.replace("{base}", base).replace("{n}", str(self.revision)).replace("{who}", who)


def of_held(entry: Entry) -> Theirs:
    """The revision that a held commit of the outbox would undo, as it was when the commit was to be sent."""
    newer = entry.newer
    return Theirs(
        entry.path,
        entry.part_number,
        newer["revision_number"],
        newer.get("created_by") or "",
        comment=newer.get("comment") or "",
        newer=newer,
    )


def line_words(line: ThreeLines, *, known: bool = True) -> str:
    """``Bolt: 6 → 4 by them, 8 by you``; ``known``: the base is."""
    base, theirs, mine = (quantity(value) for value in line.quantities)
    name = plain(display_name(line.entry) or line.entry.object_name, 60)
    if not known:
        text = translate("Silo", "{name}: {theirs} in theirs, {mine} in yours")
    elif line.by_them and line.by_me and theirs == mine:
        text = translate("Silo", "{name}: {base} → {mine} by both of you")
    elif line.by_them and line.by_me:
        text = translate("Silo", "{name}: {base} → {theirs} by them, {mine} by you")
    elif line.by_them:
        text = translate("Silo", "{name}: {base} → {theirs} by them, as before in yours")
    else:
        text = translate("Silo", "{name}: {base} → {mine} by you, as before in theirs")
    for key, value in (("{base}", base), ("{theirs}", theirs), ("{mine}", mine)):
        text = text.replace(key, value)
    return text.replace("{name}", name)


def line_texts(theirs: Theirs, most: int | None = None) -> list[str]:
    """Its lines in words; not more than ``most``."""
    return [line_words(line, known=theirs.base is not None) for line in theirs.lines[:most]]


def more_text(left: int) -> str:
    """The text of the button that shows the rest."""
    return counted(left, translate("Silo", "… and {n} more line"), translate("Silo", "… and {n} more lines"))


@dataclass(frozen=True)
class Asked:
    """A file to look at: its path, the identity of its item, and what the document was made from."""

    path: str
    identity: str
    base: Base


def look(
    client: SiloClient,
    outbox: Store,
    asked: Iterable[Asked],
    mine: Callable[[str], Assembly | None],
    cancelled: Cancel | None = None,
) -> dict[str, Theirs]:
    """Path → what a colleague committed since, for the files where that is so. For a worker.

    mine
        the BOM of the document of a path as it is now.
    """
    files = [one for one in asked if one.identity]
    items = client.get_items_by_uuid([one.identity for one in files], cancelled=cancelled)
    found: dict[str, Theirs] = {}
    for one in files:
        if (item := items.get(one.identity)) is None:
            continue
        file = _File(one.path, item.part_number, one.identity, one.base.settle(outbox))
        if (stands := file.standing(client, outbox)) is not None:
            lines: tuple[ThreeLines, ...] = ()
            with suppress(SiloError):  # the question stands without its details
                lines = file.lines(client, stands, mine(one.path), cancelled)
            found[one.path] = file.theirs(stands, lines)
    return found


def gone(client: SiloClient, announced: Mapping[str, Newer], cancelled: Cancel | None = None) -> list[str]:
    """The items of which the server no longer has the announced commit. For a worker: a request for each."""
    from silo.api.revisions import newest_number
    from silo.api.transport import stop_if

    found = []
    for identity, newer in announced.items():
        stop_if(cancelled)
        try:
            known = client.revisions(newer.part_number, newest=1)
        except RouteMissingError:
            continue
        except NotFoundError:
            known = []
        if newest_number(known) < newer.revision:
            found.append(identity)
    return found


def look_held(
    client: SiloClient, outbox: Store, entry: Entry, cancelled: Cancel | None = None
) -> Theirs | None:
    """The newest revision that a held commit would undo, with the BOM base → theirs → mine; None for a part,
    for another server's, and where nothing would be undone any more. For a worker.

    Raises SiloError where the server or a file does not answer.
    """
    from silo.api.address import canonical
    from silo.bom.report import from_plain
    from silo.vault.revisions import top_of

    extraction = outbox.bom(entry.id)[0]
    if not extraction or entry.server != canonical(client.base_url):
        return None
    try:
        mine = top_of(from_plain(json.loads(extraction)))
    except ValueError:
        return None  # sending it says so
    file = _File(entry.path, entry.part_number, entry.identity, entry.origin)
    stands = file.standing(client, outbox)
    return None if stands is None else file.theirs(stands, file.lines(client, stands, mine, cancelled))


@dataclass(frozen=True)
class _File:
    path: str
    part_number: str
    identity: str
    origin: str

    def standing(self, client: SiloClient, outbox: Store) -> Standing | None:
        """None where the file would undo nothing."""
        from silo.api.revisions import is_newest, standing

        # The newest one decides it nearly always; an item may have hundreds.
        if is_newest(self.origin, client.revisions(self.part_number, newest=1)):
            return None
        known = outbox.known_revision(client.base_url, self.origin, self.identity)
        stands = standing(client.revisions(self.part_number), self.origin, known)
        return None if stands.newer is None else stands

    def lines(
        self, client: SiloClient, stands: Standing, mine: Assembly | None, cancelled: Cancel | None
    ) -> tuple[ThreeLines, ...]:
        from silo.vault.revisions import RevisionBoms

        if mine is None:
            return ()
        with RevisionBoms(client, self.part_number, self.path, cancelled) as boms:
            return boms.three(stands, mine)

    def theirs(self, stands: Standing, lines: tuple[ThreeLines, ...]) -> Theirs:
        newest = stands.newest
        assert newest is not None  # something is newer
        return Theirs(
            self.path,
            self.part_number,
            newest.revision_number,
            newest.created_by or "",
            newest.created_at.timestamp() if newest.created_at else None,
            newest.comment,
            stands.base.revision_number if stands.base is not None else None,
            lines,
            newest.model_dump(mode="json", exclude={"properties", "links"}),
        )
