# SPDX-License-Identifier: LGPL-2.1-or-later
"""What components may be already: items with the same name, or with the very same file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from silo.api.files import FileCalls
from silo.api.transport import Cancel
from silo.api.wire import Answer, Item, Wire
from silo.bom.errors import ServerFaultError
from silo.bom.naming import name_key


class LookAlikesBody(Wire):
    """``POST /api/items/look-alikes``: the name of each component, and the hash of its file ("": none)."""

    wanted: list[dict[str, str]]


class LookAlike(Answer):
    """An item that a component may be already. A suggestion only."""

    id: str
    part_number: str
    name: str = ""
    same_file: bool = False


class LookAlikesAnswer(Answer):
    """For each component, in the order asked, what it may be: the items with its very file first."""

    look_alikes: list[list[LookAlike]]


class LookAlikeCalls(FileCalls):
    """Looking for probable duplicates."""

    def find_look_alikes(
        self, wanted: Iterable[tuple[str, str]], /, *, cancelled: Cancel | None = None
    ) -> dict[tuple[str, str], list[LookAlike]]:
        """The items that have a component's name or its file, by (name, SHA-256 of the file or "").

        One request per 1000 where the server offers that, else searches for each.
        """

        def batch(some: Sequence[tuple[str, str]]) -> dict[tuple[str, str], list[LookAlike]]:
            asked = LookAlikesBody(wanted=[{"name": name, "sha256": digest} for name, digest in some])
            subject = f"items like {len(some)} components"
            reply = self._ask(subject, "items", "look-alikes", body=asked, cancelled=cancelled)
            answer = reply.model(LookAlikesAnswer).look_alikes
            if len(answer) != len(some):
                raise ServerFaultError(f"wanted {len(some)} lists of look-alikes, got {len(answer)}")
            return dict(zip(some, answer, strict=True))

        return self._many("look_alikes", wanted, batch, self._look_alikes, cancelled)

    def _look_alikes(self, wanted: tuple[str, str]) -> list[LookAlike]:
        name, digest = wanted
        # A server that does not search by content finds nothing; what has the name is compared all the same.
        with_file = self.search_items(digest, limit=4) if digest else []
        found = []
        for item in {one.id: one for one in (*with_file, *self.search_items(name, limit=8))}.values():
            same_file = bool(digest) and digest in self._checksums(item)
            if same_file or name_key(item.name) == name_key(name):
                found.append(
                    LookAlike(id=item.id, part_number=item.part_number, name=item.name, same_file=same_file)
                )
        return sorted(found, key=lambda one: not one.same_file)

    def _checksums(self, item: Item) -> set[str]:
        known = [r.file_checksum or "" for r in self.revisions(item.part_number)]
        return {str(item.properties.get("file_sha256", "")), *(c.removeprefix("sha256:") for c in known)}
