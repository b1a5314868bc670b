# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client's questions about items, identities, numbers and schemas (silo-contract §1.3, §1.6)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from uuid import UUID

from pydantic import Field

from silo.api.caller import LISTS, Params, body
from silo.api.failures import translated
from silo.api.files import FileCalls
from silo.api.replies import Reply, WebPageError
from silo.api.revisions import checksum_of
from silo.api.transport import Cancel
from silo.api.wire import Answer, Item, Wire
from silo.bom.errors import (
    InputError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
)
from silo.bom.naming import Categories, categories_of, name_key, rules_of, schema_names
from silo.files import bare_checksum


class UuidsBody(Wire):
    """``POST /api/items/by-uuid``: many identities in one question."""

    uuids: list[str]


class ItemBody(Wire):
    """``POST /api/items``. The server makes the part number from schema and category.

    ``id``, a UUID of the client's choice, makes a repeat harmless where the server honours it.
    """

    schema_name: str = Field(alias="schema", default="kindred-rd")
    category: str = Field(min_length=1)
    description: str = ""
    name: str | None = None
    item_type: str = "part"
    id: str | None = None
    projects: list[str] | None = None
    sourcing_type: str | None = None
    long_description: str | None = None
    properties: dict[str, Any] | None = None


class ItemChanges(Wire):
    """``PUT /api/items/{partNumber}``. With ``properties`` it makes a new revision, else in place."""

    part_number: str | None = None
    description: str | None = None
    name: str | None = None
    item_type: str | None = None
    sourcing_type: str | None = None
    long_description: str | None = None
    properties: dict[str, Any] | None = None
    comment: str | None = None


class NumberBody(Wire):
    """``POST /api/generate-part-number``: a preview, it may be asked as often as one likes."""

    schema_name: str = Field(alias="schema", default="kindred-rd")
    category: str = Field(min_length=1)


class NumberAnswer(Answer):
    """The number that the next item of this category would get."""

    part_number: str


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


class ItemCalls(FileCalls):
    """Finding and making items."""

    _is_silo: bool | None = None

    def get_item_by_uuid(self, uuid: str, /) -> Item | None:
        """The item with this identity; None where the server has none (unknown, archived, or no UUID)."""
        if not uuid.strip(". ") or any(c in "/\\?#%" or c < " " for c in uuid):
            return None
        try:
            item = self._get(f"item {uuid}", "items", "by-uuid", uuid).model(Item)
        except WebPageError:
            if self._speaks_silo():
                return None
            raise
        except RouteMissingError:
            # "No such route" must not read as "not registered": people would register everything again.
            raise
        except (NotFoundError, RejectedError):
            return None
        if _written(item.id) != _written(uuid):
            raise ServerFaultError(f"item {uuid}: the server answered with the item {item.id}")
        return item

    def get_items_by_uuid(
        self, uuids: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, Item]:
        """The items of these identities, by the identity as it was given; unknown ones are left out.

        One request per 1000 where the server offers the batch look-up, else a bounded pool of single ones.
        """

        def batch(some: Sequence[str]) -> dict[str, Item]:
            asked = UuidsBody(uuids=list(some))
            reply = self._ask(f"{len(some)} items", "items", "by-uuid", body=asked, cancelled=cancelled)
            if reply.is_null(*LISTS):
                # Go's empty list, or no answer. Read as "not registered" it would have all registered again.
                raise RejectedError(f"{len(some)} items: the answer is null")
            known = {_written(item.id): item for item in reply.models(Item, *LISTS)}
            return {uuid: known[_written(uuid)] for uuid in some if _written(uuid) in known}

        wanted = [uuid for uuid in uuids if uuid]
        return self._many("batch", wanted, batch, self.get_item_by_uuid, cancelled)

    def _speaks_silo(self) -> bool:
        if self._is_silo is None:
            try:
                self._get("its items", "items", params={"limit": 1}).models(Item, *LISTS)
                self._is_silo = True
            except SiloError:
                self._is_silo = False
        return self._is_silo

    def get_item(self, part_number: str, /) -> Item:
        """The item with this part number; raises :class:`NotFoundError` where there is none."""
        return self._get(f"item {part_number}", "items", part_number).model(Item)

    def thumbnail(self, part_number: str, /) -> bytes | None:
        """The picture of an item as PNG; None where there is none, or the server keeps none."""
        try:
            return self._get(f"the picture of {part_number}", "items", part_number, "thumbnail").content
        except (NotFoundError, RejectedError, ServerFaultError):
            return None

    def search_items(
        self, query: str = "", *, item_type: str | None = None, limit: int = 50, offset: int = 0
    ) -> list[Item]:
        """Items that fit the words; without words all, page by page."""
        params: dict[str, str | int] = {"limit": limit, "offset": offset}
        if item_type:
            params["item_type"] = item_type
        if query and not item_type and not offset:
            try:
                asked: Params = {"q": query, "limit": limit}
                reply = self._get(f"items like {query!r}", "items", "search", params=asked)
                return reply.models(Item, *LISTS)
            except NotFoundError:
                pass  # A server without the fuzzy search may still filter its list.
        if query:
            params["search"] = query
        return self._get("its items", "items", params=params).models(Item, *LISTS)

    def create_item(
        self,
        schema: str,
        category: str,
        description: str = "",
        *,
        name: str | None = None,
        item_type: str = "part",
        properties: Mapping[str, Any] | None = None,
        projects: Sequence[str] | None = None,
        sourcing_type: str | None = None,
        long_description: str | None = None,
        idempotency_key: str | None = None,
    ) -> Item:
        """Create an item; the server makes its part number from schema and category.

        ``idempotency_key``, a new UUID, makes a repeat give the first one's item where the server honours it.
        """
        values = {
            "schema": schema,
            "category": category,
            "description": description or name or "",
            "name": name,
            "item_type": item_type,
            # Our server takes the identity from the client, which makes a repeat find the item.
            "id": idempotency_key if is_uuid(idempotency_key) else None,
            "properties": dict(properties) if properties is not None else None,
            "projects": list(projects) if projects is not None else None,
            "sourcing_type": sourcing_type,
            "long_description": long_description,
        }
        headers = {"Idempotency-Key": idempotency_key} if idempotency_key else {}
        reply = self._change(
            "POST",
            "a new item",
            "items",
            body=body(ItemBody, values, "an item"),
            headers=headers,
            extensions=("id", "name"),
        )
        item = self._made(reply)
        if values["id"] is not None:
            self.abilities.keeps_item_ids = item.id == values["id"]
        return item

    def _made(self, reply: Reply) -> Item:
        """The item of an answer to its creation, bare or wrapped; else asked for by its number."""
        said = reply.data()
        for wrapped in ("item", "data", "result"):
            if isinstance(said, dict) and "id" not in said and isinstance(said.get(wrapped), dict):
                said = said[wrapped]
        if isinstance(said, dict) and isinstance(said.get("part_number"), str) and "id" not in said:
            return self.get_item(said["part_number"])
        with translated(reply.where):
            return Item.model_validate(said)

    def get_properties(self, part_number: str, /) -> dict[str, Any]:
        """All properties of an item, from its newest revision where the item's own answer carries none.

        Raises :class:`silo.bom.errors.ServerFaultError` where they cannot be read: no answer is not "none".
        """
        item = self.get_item(part_number)
        if item.properties:
            return dict(item.properties)
        try:
            newest = next(iter(self.revisions(part_number, newest=1)), None)
        except RouteMissingError:
            newest = None
        if newest is None and ("properties" in item.model_fields_set or not item.current_revision):
            return {}
        number = newest.revision_number if newest is not None else item.current_revision
        if newest is not None and "properties" in newest.model_fields_set:
            return dict(newest.properties)
        subject = f"revision {number} of {part_number}"
        asked = self._get(subject, "items", part_number, "revisions", str(number)).mapping()
        if "properties" not in asked or not isinstance(asked["properties"], dict | None):
            raise ServerFaultError(
                f"{self._address.host} does not show the properties of {part_number}; nothing was written: "
                "it would replace properties that are not known here"
            )
        return dict(asked["properties"] or {})

    def update_item(self, part_number: str, /, **changes: Any) -> Item:
        """Change fields of an item (those of :class:`ItemChanges`).

        ``properties`` makes a new revision (with ``comment``); the rest changes in place.
        """
        content = body(ItemChanges, changes, "an item")
        reply = self._change("PUT", f"item {part_number}", "items", part_number, body=content)
        # Some servers answer a change with no content.
        if not reply.content.strip():
            return self.get_item(content.part_number or part_number)
        return reply.model(Item)

    def generate_part_number(self, schema: str, category: str) -> str:
        """The number that the next item of this category would get: a preview, nothing is reserved."""
        wanted = body(NumberBody, {"schema": schema, "category": category}, "a part number")
        reply = self._change("POST", f"a number in {category}", "generate-part-number", body=wanted)
        return reply.model(NumberAnswer).part_number

    def get_schema(self, name: str = "kindred-rd") -> dict[str, Any]:
        """The part-number schema as the server describes it."""
        return self._get(f"schema {name}", "schemas", name).mapping()

    def find_schema(self, wanted: str = "kindred-rd") -> str:
        """The name of the part-number schema to use: the wanted one, else the server's only one.

        Raises :class:`InputError` that lists the schemas where there are several others, or none.
        """
        if wanted in self.abilities.schemas:
            return self.abilities.schemas[wanted]
        try:
            self.get_schema(wanted)
            found = wanted
        except RouteMissingError:
            raise
        except NotFoundError as error:
            found = self._only_schema(wanted, error)
        self.abilities.schemas[wanted] = found
        return found

    def _only_schema(self, wanted: str, missing: NotFoundError) -> str:
        try:
            said = self._get("its schemas", "schemas").data()
        except NotFoundError:
            raise missing from None
        names = schema_names(said)
        if len(names) == 1:
            return names[0]
        host = self._address.host
        if not names:
            raise InputError(f"{host} has no part-number schema {wanted}, and lists no other") from missing
        raise InputError(
            f"{host} has no part-number schema {wanted}; it has {', '.join(names)}. Choose one of them with "
            "--schema, or in the Silo preferences"
        ) from missing

    def categories(self, name: str = "kindred-rd") -> Categories:
        """The categories of a schema: code → description, in the schema's order, with the site's rules."""
        schema = self.get_schema(name)
        problem = schema.get("category_rules_problem")
        return Categories(categories_of(schema), rules_of(schema), str(problem or ""))

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
        known = map(checksum_of, self.revisions(item.part_number))
        return {bare_checksum(str(item.properties.get("file_sha256", ""))), *known}


def _written(uuid: str) -> str:
    # CAD files hold identities in capitals, in braces, without dashes; the server answers with its own form.
    try:
        return str(UUID(uuid))
    except ValueError:
        return uuid.lower()


def is_uuid(text: str | None) -> bool:
    """True for a UUID in its usual form."""
    try:
        return text is not None and str(UUID(text)) == text.lower()
    except ValueError:
        return False
