# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of items over HTTP: streamed both ways, checked by SHA-256, never in memory, never half-written."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import urljoin

from silo.api.caller import LISTS
from silo.api.items import ItemCalls
from silo.api.multipart import FileBody, FileForm, Progress, upload_fields
from silo.api.replies import error_of
from silo.api.transport import MAX_ERROR, Call, Cancel, Transport, as_json
from silo.api.wire import LinkedFile, Revision, Wire
from silo.bom.errors import (
    ConflictError,
    DocumentError,
    NotFoundError,
    RejectedError,
    RouteMissingError,
    ServerFaultError,
)
from silo.durable import replacing

MAX_DOWNLOAD = 4 << 30
_PAGE = 1000  # revisions in one answer


class Origin(Wire):
    """What a client says of a file that it sends: the fields of :class:`Revision` of these names."""

    base_revision: int | None = None
    file_path: str = ""
    links: list[LinkedFile] | None = None


class FileCalls(ItemCalls):
    """Revisions of items, and their files."""

    def revisions(self, part_number: str, /, *, newest: int | None = None, after: int = 0) -> list[Revision]:
        """The revisions of an item, newest first; those above the number ``after``.

        ``newest``: only so many. A server that knows neither sends all, and gets no further question.
        """
        found: list[Revision] = []
        params: dict[str, int] = {"limit": newest or _PAGE, **({"after": after} if after else {})}
        while True:
            subject = f"the revisions of {part_number}"
            reply = self._get(subject, "items", part_number, "revisions", params=params)
            page = reply.models(Revision, "revisions", *LISTS)
            lowest = found[-1].revision_number if found else None
            fresh = [r for r in page if r.revision_number > after]
            fresh = [r for r in fresh if lowest is None or r.revision_number < lowest]
            found += sorted(fresh, key=lambda revision: revision.revision_number, reverse=True)
            total = reply.headers.get("X-Total-Count", "")
            if newest is not None or not fresh or not total.isdecimal() or len(found) >= int(total):
                return found[:newest]
            params["before"] = found[-1].revision_number

    def get_revision(self, part_number: str, number: int, /) -> Revision:
        """One revision, with the files that its file links to."""
        subject = f"revision {number} of {part_number}"
        return self._get(subject, *_revision(part_number, number)).model(Revision)

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
        asked = self._get(f"revision {number} of {part_number}", *_revision(part_number, number)).mapping()
        if "properties" not in asked or not isinstance(asked["properties"], dict | None):
            raise ServerFaultError(
                f"{self._address.host} does not show the properties of {part_number}; nothing was written: "
                "it would replace properties that are not known here"
            )
        return dict(asked["properties"] or {})

    def upload_file(
        self,
        part_number: str,
        path: Path | str,
        comment: str = "",
        properties: Mapping[str, Any] | None = None,
        on_progress: Progress | None = None,
        *,
        file_name: str | None = None,
        idempotency_key: str | None = None,
        sha256: str | None = None,
        origin: Origin | None = None,
        cancelled: Cancel | None = None,
    ) -> Revision:
        """Send a file as a new revision, streamed; never repeated by itself (see :mod:`silo.outbox`).

        ``sha256`` is what must arrive: a server that knows the field makes no revision of anything else.
        ``origin`` says what the file was made from: :class:`silo.bom.errors.NewerRevisionError` where a newer
        one is there. A server that does not know this takes the file; one that takes no form gets the file in
        two steps. Raises :class:`silo.bom.errors.DocumentError` for a file that cannot be read, ConflictError
        where the server's checksum is another one.
        """
        path = Path(path)
        name = file_name or path.name
        subject = f"{name} for {part_number}"
        fields = upload_fields(comment, properties, sha256) | _origin_fields(origin)
        with FileForm(path, fields, file_name=name, on_progress=on_progress, cancelled=cancelled) as form:
            headers = {"Content-Type": form.content_type, "Accept": "application/json"}
            if idempotency_key:
                headers["Idempotency-Key"] = idempotency_key
            url = self._address.api("items", part_number, "file")
            call = Call("POST", url, subject, body=form.rewound, headers=headers, cancelled=cancelled)
            try:
                revision, sent = self._transport.send(call).model(Revision), form.sha256
            except (RouteMissingError, RejectedError) as error:
                if isinstance(error, RejectedError) and error.status != 415:
                    raise
                about = {"comment": comment, **({"properties": dict(properties)} if properties else {})}
                revision, sent = _in_two_steps(self._transport, call, path, name, about, on_progress)
        stored = (revision.file_checksum or sent).lower().removeprefix("sha256:")
        if stored != sent:
            # Sending it again by itself would make a revision each time.
            raise ConflictError(
                f"{self._address.host} stored another content than was sent for {subject} "
                f"(revision {revision.revision_number}); look at that revision, then send the file again"
            )
        return revision

    def download_file(
        self,
        part_number: str,
        path: Path | str,
        revision: int | None = None,
        on_progress: Progress | None = None,
        *,
        cancelled: Cancel | None = None,
    ) -> str:
        """Fetch the latest file of an item, or that of a revision, to ``path``; gives its SHA-256 in hex.

        ``path`` appears whole or not at all; what was there before is replaced only then. The bytes may
        differ from those uploaded: a server re-packs some formats.
        """
        segments = ("items", part_number, "file") + ((str(revision),) if revision is not None else ())
        call = Call(
            "GET",
            self._address.api(*segments),
            f"the file of {part_number}",
            headers={"Accept-Encoding": "identity"},
            max_bytes=MAX_DOWNLOAD,
            endless=True,
            cancelled=cancelled,
        )
        transport = self._transport
        with transport.opened(call) as response:
            if not 200 <= response.status_code < 300:
                raise error_of(transport.reply(response, replace(call, max_bytes=MAX_ERROR, endless=False)))
            total = response.headers.get("Content-Length", "")
            pieces = transport.pieces(response, call)
            return _write(Path(path), pieces, int(total) if total.isdigit() else 0, on_progress)

    def thumbnail(self, part_number: str, /) -> bytes | None:
        """The picture of an item as PNG; None where there is none, or the server keeps none."""
        try:
            return self._get(f"the picture of {part_number}", "items", part_number, "thumbnail").content
        except (NotFoundError, RejectedError, ServerFaultError):
            return None


def _revision(part_number: str, number: int) -> tuple[str, ...]:
    return ("items", part_number, "revisions", str(number))


def _origin_fields(origin: Origin | None) -> dict[str, str]:
    """Where the file came from; a server that knows none of these takes no notice."""
    said: dict[str, str] = {}
    if origin is None:
        return said
    if origin.base_revision is not None:
        said["base_revision"] = str(origin.base_revision)
    if origin.file_path:
        said["path"] = origin.file_path
    if origin.links is not None:
        said["links"] = as_json([link.model_dump() for link in origin.links]).decode()
    return said


def _in_two_steps(
    transport: Transport,
    call: Call,
    path: Path,
    name: str,
    said: Mapping[str, Any],
    on_progress: Progress | None,
) -> tuple[Revision, str]:
    """First the bytes to the server's store, then the revision (silo-contract §1.4, "presign").

    For a server that takes no forms. The store may be another host: it gets no token.
    """
    size = path.stat().st_size
    about = {"filename": name, "content_type": "application/octet-stream", "size": size}
    headers = {**call.headers, "Content-Type": "application/json"}
    asked = as_json(about)
    place = transport.send(
        replace(
            call,
            url=transport.address.api("uploads", "presign"),
            body=lambda: asked,
            headers=headers,
            repeatable=True,
        )
    ).mapping()
    key, url = place.get("object_key"), place.get("upload_url")
    if not isinstance(key, str) or not isinstance(url, str):
        raise ServerFaultError(f"{call.subject}: the server names no place to upload the file to")
    content = FileBody(path, on_progress=on_progress, cancelled=call.cancelled)
    with content:
        put = replace(
            call,
            method="PUT",
            url=urljoin(transport.address.web_root + "/", url),
            body=content.rewound,
            headers={"Content-Type": "application/octet-stream"},
            repeatable=True,
        )
        transport.send(put)
        sha256 = content.sha256
    final = as_json({**about, "object_key": key, **said, "file_checksum": sha256})
    return transport.send(replace(call, body=lambda: final, headers=headers)).model(Revision), sha256


def _write(path: Path, pieces: Iterator[bytes], total: int, on_progress: Progress | None) -> str:
    digest, done = hashlib.sha256(), 0
    with _replacing(path) as file:
        for piece in pieces:
            done += len(piece)
            digest.update(piece)
            file.write(piece)
            if on_progress is not None:
                on_progress(done, max(total, done))
    return digest.hexdigest()


@contextmanager
def _replacing(path: Path) -> Iterator[BinaryIO]:
    try:
        with replacing(path) as file:
            yield file
    except OSError as error:
        raise DocumentError(str(path), f"cannot be written ({error.strerror or error})") from error
