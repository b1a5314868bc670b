# SPDX-License-Identifier: LGPL-2.1-or-later
"""The calls that send a table to Silo: a BOM, a list of parts, a price list. The server reads it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from silo.api.address import Word
from silo.api.caller import Caller
from silo.api.transport import ApiCall
from silo.bom.message import message


class TableCalls(Caller):
    """Imports of tables; each answers with what became, or would become, of each row."""

    def import_bom(self, part_number: str, data: bytes, /, **asked: str) -> dict[str, Any]:
        """Import a BOM with its levels. RejectedError lists all problems; then nothing was changed."""
        return self._import(
            data,
            asked,
            message("the BOM of {part_number}", part_number=part_number),
            "items",
            part_number,
            "bom",
            Word("import"),
        )

    def import_parts(self, data: bytes, /, **asked: str) -> dict[str, Any]:
        """Import a list of parts. RejectedError lists all problems; then nothing was changed."""
        return self._import(data, asked, message("the items"), "items", Word("import"))

    def import_prices(self, data: bytes, /, **asked: str) -> dict[str, Any]:
        """Import a price list. RejectedError lists all problems; then nothing was changed."""
        return self._import(data, asked, message("the suppliers"), "suppliers", Word("import"))

    def import_categories(self, data: bytes, /, **asked: str) -> dict[str, Any]:
        """Let a list of categories be the site's. RejectedError lists all problems."""
        return self._import(data, asked, message("the categories"), "categories", Word("import"))

    def undo_import(self, number: int, /) -> dict[str, Any]:
        """Take an import back. ConflictError names what was changed since; then nothing was changed."""
        where = self._address.api("imports", str(number), "undo")
        call = ApiCall("POST", where, message("import {number}", number=number))
        return dict(self._transport.send(call).mapping())

    def _import(
        self, data: bytes, asked: Mapping[str, str], subject: str, /, *segments: str
    ) -> dict[str, Any]:
        call = ApiCall(
            "POST",
            self._address.api(*segments),
            subject,
            params=asked,
            body=lambda: data,
            headers={"Accept": "application/json", "Content-Type": "application/octet-stream"},
            repeatable="dry_run" in asked,
        )
        return dict(self._transport.send(call).mapping())
