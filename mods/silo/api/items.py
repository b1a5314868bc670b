# SPDX-License-Identifier: LGPL-2.1-or-later
"""The client's questions about items, identities, numbers and schemas (silo-contract §1.3, §1.6)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import Field

from silo.api.address import Word
from silo.api.caller import LISTS, Params, body
from silo.api.files import FileCalls
from silo.api.foreign import translated
from silo.api.replies import Reply, WebPageError
from silo.api.revisions import checksum_of
from silo.api.transport import Cancel
from silo.api.wire import Answer, FactSource, Item, ItemTexts
from silo.bom.errors import (
    InputError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
    SiloError,
)
from silo.bom.items.schema import Categories, categories_of, rules_of, schema_names
from silo.bom.message import message
from silo.bom.text import name_key
from silo.bom.walk.identity import as_uuid
from silo.checksums import bare_checksum

USUAL_SCHEMA = "kindred-rd"


class ItemBody(ItemTexts):
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
    properties: dict[str, Any] | None = None


class ItemChanges(ItemTexts):
    """``PUT /api/items/{partNumber}``. With ``properties`` it makes a new revision, else in place."""

    part_number: str | None = None
    description: str | None = None
    name: str | None = None
    item_type: str | None = None
    properties: dict[str, Any] | None = None
    comment: str | None = None
    source: FactSource | None = None


class NumberAnswer(Answer):
    """The number that the next item of this category would get."""

    part_number: str


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
        """Return the item with this identity; None if the server has none (unknown, archived, or no UUID)."""
        if not uuid.strip(". ") or any(c in "/\\?#%" or c < " " for c in uuid):
            return None
        try:
            item = self._get(message("item {uuid}", uuid=uuid), "items", Word("by-uuid"), uuid).model(Item)
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
            raise ServerFaultError(
                message("item {uuid}: the server answered with the item {id}", uuid=uuid, id=item.id)
            )
        return item

    def get_items_by_uuid(
        self, uuids: Iterable[str], /, *, cancelled: Cancel | None = None
    ) -> dict[str, Item]:
        """Return the items of these identities, each under the identity as it was given; unknown ones are
        left out.

        Sends one request per 1000 items if the server offers the batch look-up, else single ones from a
        bounded pool.
        """

        def batch(some: Sequence[str]) -> dict[str, Item]:
            where = (message("{count} items", count=len(some)), "items", Word("by-uuid"))
            reply = self._ask(*where, uuids=list(some), cancelled=cancelled)
            if reply.is_null(*LISTS):
                # Go's empty list, or no answer. As "not registered", it would make people register again.
                raise RejectedError(message("{count} items: the answer is null", count=len(some)))
            models = {_written(item.id): item for item in reply.models(Item, *LISTS)}
            if reply.next or reply.total > len(models):
                # Taken as "not registered", the items of the other pages would be made once more.
                raise RejectedError(
                    message(
                        "{count} items: the answer has {answered}, and is not the whole",
                        count=len(some),
                        answered=len(models),
                    )
                )
            return {uuid: models[_written(uuid)] for uuid in some if _written(uuid) in models}

        wanted = [uuid for uuid in uuids if uuid]
        return self._many("batch", wanted, batch, self.get_item_by_uuid, cancelled)

    def _speaks_silo(self) -> bool:
        if self._is_silo is None:
            try:
                self._get(message("its items"), "items", params={"limit": 1}).models(Item, *LISTS)
                self._is_silo = True
            except SiloError:
                self._is_silo = False
        return self._is_silo

    def get_item(self, part_number: str, /) -> Item:
        """Return the item with this part number; raises :class:`NotFoundError` if there is none."""
        return self._get(message("item {part_number}", part_number=part_number), "items", part_number).model(
            Item
        )

    def thumbnail(self, part_number: str, /) -> bytes | None:
        """Return the picture of an item as PNG; None if the item has none or the server keeps none."""
        try:
            return self._get(
                message("the picture of {part_number}", part_number=part_number),
                "items",
                part_number,
                "thumbnail",
            ).content
        except (NotFoundError, RejectedError, ServerFaultError):
            return None

    def search_items(
        self, query: str = "", *, item_type: str | None = None, limit: int = 50, offset: int = 0
    ) -> list[Item]:
        """Return the items that fit the words, page by page; all items if there are no words."""
        params: dict[str, str | int] = {"limit": limit, "offset": offset}
        if item_type:
            params["item_type"] = item_type
        if query and not item_type and not offset:
            try:
                asked: Params = {"q": query, "limit": limit}
                reply = self._get(
                    message("items like {query}", query=repr(query)), "items", Word("search"), params=asked
                )
                return reply.models(Item, *LISTS)
            except NotFoundError:
                pass  # A server without the fuzzy search may still filter its list.
        if query:
            params[Word("search")] = query
        return self._get(message("its items"), "items", params=params).models(Item, *LISTS)

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
        idempotency_key: str | None = None,
        **texts: str | None,
    ) -> Item:
        """Create an item; the server makes its part number from schema and category.

        texts
            the fields of :class:`silo.api.wire.ItemTexts`.

        ``idempotency_key``, a new UUID, makes a repeated request return the item of the first, if the server
        supports it.
        """
        values = {
            "schema": schema,
            "category": category,
            "description": description or name or "",
            "name": name,
            "item_type": item_type,
            # Our server takes the identity from the client, which makes a repeat find the item.
            "id": as_uuid(idempotency_key or "") or None,
            "properties": dict(properties) if properties is not None else None,
            "projects": list(projects) if projects is not None else None,
            **texts,
        }
        headers = {"Idempotency-Key": idempotency_key} if idempotency_key else {}
        reply = self._change(
            "POST",
            message("a new item"),
            "items",
            body=body(ItemBody, values, message("an item")),
            headers=headers,
            extensions=("id", "name"),
        )
        item = self._made(reply)
        if values["id"] is not None:
            self.abilities.keeps_item_ids = item.id == values["id"]
        return item

    def _made(self, reply: Reply) -> Item:
        """Read the new item from the answer to its creation, bare or wrapped; if it is not there, get it by
        its number.
        """
        data = reply.data()
        for wrapped in ("item", "data", "result"):
            if isinstance(data, dict) and "id" not in data and isinstance(data.get(wrapped), dict):
                data = data[wrapped]
        if isinstance(data, dict) and isinstance(data.get("part_number"), str) and "id" not in data:
            return self.get_item(data["part_number"])
        with translated(reply.where):
            return Item.model_validate(data)

    def get_properties(self, part_number: str, /) -> dict[str, Any]:
        """Return all properties of an item; those of its newest revision if the item's own answer has none.

        Raises :class:`silo.bom.errors.ServerFaultError` if they cannot be read: no answer is not "none".
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
        subject = message("revision {number} of {part_number}", number=number, part_number=part_number)
        asked = self._get(subject, "items", part_number, "revisions", str(number)).mapping()
        if "properties" not in asked or not isinstance(asked["properties"], dict | None):
            raise ServerFaultError(
                message(
                    "{host} does not show the properties of {part_number}; nothing was written: it would "
                    "replace properties that are not known here",
                    host=self._address.host,
                    part_number=part_number,
                )
            )
        return dict(asked["properties"] or {})

    def update_item(self, part_number: str, /, **changes: Any) -> Item:
        """Change fields of an item (those of :class:`ItemChanges`).

        ``properties`` makes a new revision (with ``comment``); the rest changes in place.
        """
        content = body(ItemChanges, changes, message("an item"))
        extensions = ("source",) if content.source else ()
        subject = message("item {part_number}", part_number=part_number)
        reply = self._change("PUT", subject, "items", part_number, body=content, extensions=extensions)
        # Some servers answer a change with no content.
        if not reply.content.strip():
            return self.get_item(content.part_number or part_number)
        return reply.model(Item)

    def archive_item(self, part_number: str, /) -> None:
        """Archive an item; the server keeps it, and everything that refers to it."""
        self._delete(message("item {part_number}", part_number=part_number), "items", part_number)

    def generate_part_number(self, schema: str, category: str) -> str:
        """Return the number that the next item of this category would get. Reserves nothing."""
        wanted = {"schema": schema, "category": category}
        reply = self._change(
            "POST", message("a number in {category}", category=category), "generate-part-number", body=wanted
        )
        return reply.model(NumberAnswer).part_number

    def get_schema(self, name: str = "kindred-rd") -> dict[str, Any]:
        """Return the part-number schema as the server describes it."""
        return self._get(message("schema {name}", name=name), "schemas", name).mapping()

    def find_schema(self, wanted: str = USUAL_SCHEMA) -> str:
        """Find the name of the part-number schema to use: the wanted one; if that is the usual one, also
        the server's only one.

        Raises :class:`InputError` that lists the schemas if there are several others, or none.
        """
        if wanted in self.abilities.schemas:
            return self.abilities.schemas[wanted]
        try:
            self.get_schema(wanted)
            schema = wanted
        except RouteMissingError:
            raise
        except NotFoundError as error:
            schema = self._only_schema(wanted, error)
        self.abilities.schemas[wanted] = schema
        return schema

    def _only_schema(self, wanted: str, missing: NotFoundError) -> str:
        try:
            data = self._get(message("its schemas"), "schemas").data()
        except NotFoundError:
            raise missing from None
        names = schema_names(data)
        if len(names) == 1 and wanted == USUAL_SCHEMA:
            return names[0]
        host = self._address.host
        if not names:
            raise InputError(
                message(
                    "{host} has no part-number schema {wanted}, and lists no other", host=host, wanted=wanted
                )
            ) from missing
        raise InputError(
            message(
                "{host} has no part-number schema {wanted}; it has {names}. Choose one of them with "
                "--schema, or in the Silo preferences",
                host=host,
                wanted=wanted,
                names=", ".join(names),
            )
        ) from missing

    def categories(self, name: str = "kindred-rd") -> Categories:
        """Return the categories of a schema (code → description, in the schema's order) with the site's
        rules.
        """
        schema = self.get_schema(name)
        problem = schema.get("category_rules_problem")
        return Categories(categories_of(schema), rules_of(schema), str(problem or ""))

    def find_look_alikes(
        self, wanted: Iterable[tuple[str, str]], /, *, cancelled: Cancel | None = None
    ) -> dict[tuple[str, str], list[LookAlike]]:
        """Find the items with a component's name or file, by (name, SHA-256 of the file or "").

        Sends one request per 1000 components if the server offers that, else searches for each.
        """

        def batch(some: Sequence[tuple[str, str]]) -> dict[tuple[str, str], list[LookAlike]]:
            asked = [{"name": name, "sha256": digest} for name, digest in some]
            where = (message("items like {count} components", count=len(some)), "items", "look-alikes")
            reply = self._ask(*where, wanted=asked, cancelled=cancelled)
            answer = reply.model(LookAlikesAnswer).look_alikes
            if len(answer) != len(some):
                raise ServerFaultError(
                    message(
                        "wanted {count} lists of look-alikes, got {answered}",
                        count=len(some),
                        answered=len(answer),
                    )
                )
            return dict(zip(some, answer, strict=True))

        return self._many("look_alikes", wanted, batch, self._look_alikes, cancelled)

    def _look_alikes(self, wanted: tuple[str, str]) -> list[LookAlike]:
        name, digest = wanted
        # A server that does not search by content finds nothing; items with the name are compared anyway.
        with_file = self.search_items(digest, limit=4) if digest else []
        matches = []
        for item in {part.id: part for part in (*with_file, *self.search_items(name, limit=8))}.values():
            same_file = bool(digest) and digest in self._checksums(item)
            if same_file or name_key(item.name) == name_key(name):
                matches.append(
                    LookAlike(id=item.id, part_number=item.part_number, name=item.name, same_file=same_file)
                )
        return sorted(matches, key=lambda match: not match.same_file)

    def _checksums(self, item: Item) -> set[str]:
        checksums = map(checksum_of, self.revisions(item.part_number))
        return {bare_checksum(str(item.properties.get("file_sha256", ""))), *checksums}


def _written(uuid: str) -> str:
    return as_uuid(uuid) or uuid.lower()
