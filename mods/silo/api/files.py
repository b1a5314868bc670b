# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files of items over HTTP: streamed both ways, checked by SHA-256, never in memory, never half-written."""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urljoin

from silo.api.address import Word
from silo.api.caller import LISTS, Caller, Params, as_json
from silo.api.multipart import FileBody, FileForm, Progress
from silo.api.replies import error_of
from silo.api.revisions import checksum_of
from silo.api.transport import MAX_ERROR, ApiCall, Cancel, Transport
from silo.api.wire import (
    Attachment,
    Document,
    HeldItem,
    KnownContent,
    LinkedFile,
    Release,
    Revision,
    Scene,
    Wire,
)
from silo.bom.errors import ConflictError, DocumentError, RejectedError, RouteMissingError, ServerFaultError
from silo.bom.message import message
from silo.bom.numbers import whole_number
from silo.bom.system_refusals import why_refused
from silo.bom.text import with_allowed_characters
from silo.file_kind import MODEL
from silo.platform.whole_files import remove_patiently, replacing

if TYPE_CHECKING:
    from silo.api.client import SiloClient


def download_revision(
    client: SiloClient,
    part_number: str,
    path: Path,
    revision: int,
    checksum: str,
    *,
    cancelled: Cancel | None = None,
) -> str:
    """Download a revision's file to ``path``; returns its SHA-256.

    Raises ServerFaultError if it is not the file that was committed (``checksum``; "" if the server names
    none): it was damaged in the store or on the way.
    """
    result = client.download_file(part_number, path, revision, cancelled=cancelled)
    if checksum and result != checksum:
        remove_patiently(path)
        raise ServerFaultError(
            message(
                "the file of {part_number}, revision {revision}, is not the one that was committed: its "
                "SHA-256 is {result}…, wanted {checksum}…. Nothing was written; the server's "
                "administrator can check its files",
                part_number=part_number,
                revision=revision,
                result=result[:12],
                checksum=checksum[:12],
            )
        )
    return result


class DocumentId(str):
    """The UUID of a document, wherever the part number of an item may stand: its file, its revisions."""

    __slots__ = ()


def _path_of(of: str) -> tuple[str, str]:
    return ("documents" if isinstance(of, DocumentId) else "items", of)


MAX_DOWNLOAD = 4 << 30
_PAGE = 1000  # revisions in one answer


class Origin(Wire):
    """What a client says of a file that it sends: the fields of :class:`Revision` of these names, the items
    in it, and the document that it was before."""

    base_revision: int | None = None
    file_path: str = ""
    links: list[LinkedFile] | None = None
    items: list[HeldItem] | None = None
    former: str = ""


class MissingModels(Wire):
    """The answer of ``POST /api/models/missing``: contents by their SHA-256."""

    sha256: list[str]


class FileCalls(Caller):
    """Revisions of items and documents, and their files; a document is named by its :class:`DocumentId`."""

    def lacking_models(self, sha256: Iterable[str], /) -> set[str]:
        """Return which of these contents are files of revisions without a model on the server.

        Raises RouteMissingError if the server keeps no models.
        """
        wanted, lacking = sorted(set(sha256)), set[str]()
        for at in range(0, len(wanted), _PAGE):
            reply = self._ask(message("the models"), "models", "missing", sha256=wanted[at : at + _PAGE])
            lacking.update(reply.model(MissingModels).sha256)
        return lacking & set(wanted)

    def put_model(self, sha256: str, part: str, body: bytes, /) -> None:
        """Send ``geometry`` or ``structure`` of a file's content, packed with gzip."""
        kind = "model/gltf-binary" if part == "geometry" else "application/json"
        headers = {"Accept": "application/json", "Content-Type": kind, "Content-Encoding": "gzip"}
        url = self._address.api("models", sha256, part)
        call = ApiCall(
            "PUT",
            url,
            message("the {part} of a file", part=part),
            body=lambda: body,
            headers=headers,
            repeatable=True,
        )
        self._transport.send(call)

    def get_scene(self, part_number: str, revision: int, /) -> Scene:
        """Return where each part of a product is placed, as a revision recorded its files.

        Raises RouteMissingError if the server keeps no models.
        """
        asked: Params = {"revision": revision}
        subject = message("the model of {part_number}", part_number=part_number)
        return self._get(subject, *_path_of(part_number), "scene", params=asked).model(Scene)

    def get_geometry(self, sha256: str, /) -> bytes:
        """Return the model (GLB) of a file's content."""
        body = self._get(message("the geometry of a file"), "models", sha256, "geometry").content
        return gzip.decompress(body) if body.startswith(b"\x1f\x8b") else body

    def get_documents(self, uuids: Iterable[str], /) -> dict[str, Document]:
        """Return the present documents with these UUIDs, by the UUID in lower case; unknown ones are left
        out.

        Raises RouteMissingError if the server knows no documents.
        """
        documents: dict[str, Document] = {}
        wanted = sorted({uuid.lower() for uuid in uuids if uuid})
        for at in range(0, len(wanted), _PAGE):
            reply = self._ask(
                message("the files"), "documents", Word("by-uuid"), uuids=wanted[at : at + _PAGE]
            )
            documents |= {model.id: model for model in reply.models(Document, "documents", *LISTS)}
        return documents

    def get_contents(self, sha256: Iterable[str], /) -> list[KnownContent]:
        """Return whose revisions have these contents, and which document each file is now.

        Raises RouteMissingError if the server knows no documents.
        """
        wanted, found = sorted(set(sha256)), list[KnownContent]()
        for at in range(0, len(wanted), _PAGE):
            reply = self._ask(message("the files"), "documents", "by-content", sha256=wanted[at : at + _PAGE])
            found += reply.models(KnownContent, "contents", *LISTS)
        return found

    def get_document(self, uuid: str, /) -> Document:
        """Return a document, with the documents that it links to and those that link to it."""
        return self._get(message("the document {uuid}", uuid=uuid), "documents", uuid).model(Document)

    def documents_of(self, part_number: str, /) -> list[Document]:
        """Return the documents that hold an item; its own comes first."""
        where = (
            message("the files of {part_number}", part_number=part_number),
            "items",
            part_number,
            "documents",
        )
        return [document for page, _ in self._all(Document, *where, keys=("documents",)) for document in page]

    def get_release(self, part_number: str, label: str, /) -> Release:
        """Return a revision of a product that is released or in review, with all its files as they were
        frozen.

        Raises NotFoundError, RouteMissingError if the server knows no releases.
        """
        subject = message("revision {label} of {part_number}", label=label, part_number=part_number)
        return self._get(subject, "items", part_number, "releases", label).model(Release)

    def revisions(self, part_number: str, /, *, newest: int | None = None, after: int = 0) -> list[Revision]:
        """Return the revisions of an item that are newer than number ``after``, newest first.

        ``newest``: at most so many. A server that knows neither option sends all, in any order and pages.
        """

        def read(limit: int) -> Iterator[tuple[list[Revision], int]]:
            more = {"after": after} if after else {}
            where = (*_path_of(part_number), "revisions")
            subject = message("the revisions of {part_number}", part_number=part_number)
            return self._all(Revision, subject, *where, keys=("revisions",), limit=limit, **more)

        pages = read(newest or _PAGE)
        earlier, total = next(pages)
        # Numbers rise from 1: oldest first, the newest is not here while its number is below their count.
        is_whole = max((revision.revision_number for revision in earlier), default=after) >= after + total
        if newest is None or not is_whole:
            earlier = [
                revision for page, _ in (read(_PAGE) if newest else pages) for revision in page
            ] + earlier
        by_number = {
            revision.revision_number: revision for revision in earlier if revision.revision_number > after
        }
        return [by_number[number] for number in sorted(by_number, reverse=True)][:newest]

    def get_revision(self, part_number: str, number: int, /) -> Revision:
        """Return a revision, with the files that its file links to."""
        subject = message("revision {number} of {part_number}", number=number, part_number=part_number)
        return self._get(subject, *_path_of(part_number), "revisions", str(number)).model(Revision)

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
        """Send a file as a new revision, as a stream. Never repeats that itself (see :mod:`silo.outbox`).

        ``sha256`` is what must arrive: a server that knows the field makes no revision of anything else.
        ``origin`` says what the file was made from: :class:`silo.bom.errors.NewerRevisionError` if there is a
        newer revision. A server that does not know this field takes the file; a server that takes no form
        gets the file in two steps. Raises :class:`silo.bom.errors.DocumentError` for a file that cannot be
        read, ConflictError if the server reports another checksum.
        """
        path = Path(path)
        name = file_name or path.name
        subject = message("{name} for {part_number}", name=name, part_number=part_number)
        fields = _upload_fields(comment, properties, sha256, origin)
        with closing(FileForm(path, fields, name, on_progress, cancelled)) as form:
            headers = {"Content-Type": form.content_type, "Accept": "application/json"}
            if idempotency_key:
                headers["Idempotency-Key"] = idempotency_key
            url = self._address.api(*_path_of(part_number), "file")
            call = ApiCall("POST", url, subject, body=form.rewound, headers=headers, cancelled=cancelled)
            try:
                revision, sent = self._transport.send(call).model(Revision), form.sha256
            except (RouteMissingError, RejectedError) as error:
                if isinstance(part_number, DocumentId):
                    raise
                if isinstance(error, RejectedError) and error.status != 415:
                    raise
                about = {"comment": comment, **({"properties": dict(properties)} if properties else {})}
                revision, sent = _in_two_steps(self._transport, call, path, name, about, on_progress)
        if (checksum_of(revision) or sent) != sent:
            # Sending it again automatically would make a revision each time.
            raise ConflictError(
                message(
                    "{host} stored other content than was sent for {subject} (revision {revision_number}); "
                    "look at that revision, then send the file again",
                    host=self._address.host,
                    subject=subject,
                    revision_number=revision.revision_number,
                )
            )
        return revision

    def attachments(self, part_number: str, /) -> list[Attachment]:
        """Return the attachments of an item as they are now.

        Raises RouteMissingError if the server lists none.
        """
        where = (
            message("the attachments of {part_number}", part_number=part_number),
            "items",
            part_number,
            "files",
        )
        return [
            attachment for page, _ in self._all(Attachment, *where, keys=("files",)) for attachment in page
        ]

    def attach_file(
        self,
        part_number: str,
        path: Path | str,
        file_name: str,
        *,
        kind: str = "",
        cancelled: Cancel | None = None,
    ) -> None:
        """Send a file as an attachment of an item; ``kind`` "": that of its content.

        A Silo without documents keeps no kinds of attachments, and no revisions.
        """
        fields = {"kind": kind} if kind else {}
        with closing(FileForm(Path(path), fields, file_name, None, cancelled)) as form:
            headers = {"Content-Type": form.content_type, "Accept": "application/json"}
            url = self._address.api("items", part_number, "files")
            subject = message(
                "{file_name} beside {part_number}", file_name=file_name, part_number=part_number
            )
            self._transport.send(
                ApiCall("POST", url, subject, body=form.rewound, headers=headers, cancelled=cancelled)
            )

    def download_file(
        self,
        part_number: str,
        path: Path | str,
        revision: int | None = None,
        on_progress: Progress | None = None,
        *,
        cancelled: Cancel | None = None,
    ) -> str:
        """Download the latest file of an item, or that of a revision, to ``path``; returns its SHA-256 in
        hex.

        ``path`` is written completely or not at all; only then is an old file replaced. The bytes may differ
        from those uploaded: a server re-packs some formats.
        """
        segments = (*_path_of(part_number), "file", *(() if revision is None else (str(revision),)))
        call = ApiCall(
            "GET",
            self._address.api(*segments),
            message("the file of {part_number}", part_number=part_number),
            headers={"Accept-Encoding": "identity"},
            max_bytes=MAX_DOWNLOAD,
            endless=True,
            cancelled=cancelled,
        )
        transport = self._transport
        with transport.opened(call) as response:
            if not 200 <= response.status_code < 300:
                raise error_of(transport.reply(response, replace(call, max_bytes=MAX_ERROR, endless=False)))
            total = whole_number(response.headers.get("Content-Length", "")) or 0
            return _write(Path(path), transport.pieces(response, call), total, on_progress)


def _upload_fields(
    comment: str, properties: Mapping[str, object] | None, sha256: str | None, origin: Origin | None
) -> dict[str, str]:
    """Make the text parts of an upload: comment, kind, properties, the hash that must arrive, and where the
    file came from.

    A server that does not know one of them ignores it.
    """
    fields = {"comment": with_allowed_characters(comment), "kind": MODEL}
    if properties:
        fields["properties"] = as_json(properties).decode()
    if sha256:
        fields["sha256"] = sha256
    if origin is None:
        return fields
    if origin.base_revision is not None:
        fields["base_revision"] = str(origin.base_revision)
    if origin.file_path:
        fields["path"] = with_allowed_characters(origin.file_path)
    if origin.links is not None:
        fields["links"] = as_json([link.model_dump(exclude_defaults=True) for link in origin.links]).decode()
    if origin.items:
        fields["items"] = as_json([item.model_dump(exclude_defaults=True) for item in origin.items]).decode()
    if origin.former:
        fields["former"] = origin.former
    return fields


def _in_two_steps(
    transport: Transport,
    call: ApiCall,
    path: Path,
    name: str,
    fields: Mapping[str, Any],
    on_progress: Progress | None,
) -> tuple[Revision, str]:
    """Send the bytes to the server's store first, then the revision (silo-contract §1.4, "presign").

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
        raise ServerFaultError(
            message("{subject}: the server names no place to upload the file to", subject=call.subject)
        )
    with closing(FileBody(path, on_progress, call.cancelled)) as content:
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
    final = as_json({**about, "object_key": key, **fields, "file_checksum": sha256})
    return transport.send(replace(call, body=lambda: final, headers=headers)).model(Revision), sha256


def _write(path: Path, pieces: Iterator[bytes], total: int, on_progress: Progress | None) -> str:
    digest, done = hashlib.sha256(), 0
    try:
        with replacing(path) as file:
            for piece in pieces:
                done += len(piece)
                digest.update(piece)
                file.write(piece)
                if on_progress is not None:
                    on_progress(done, max(total, done))
    except OSError as error:
        raise DocumentError(
            str(path), message("cannot be written ({error})", error=why_refused(error))
        ) from error
    return digest.hexdigest()
