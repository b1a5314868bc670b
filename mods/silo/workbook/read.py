# SPDX-License-Identifier: LGPL-2.1-or-later
"""A workbook (XLSX, ODS, XLS) → its sheets.

XLSX and ODS are read from their XML, XLS by xlrd. Readers that give values alone lose what decides a mass: an
error, or a formula that was not calculated, looks like an empty cell, and "12.5 g" is 12.5.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from xml.etree.ElementTree import Element, fromstring

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.workbook.encoding import STARTS
from silo.workbook.limits import MAX_UNPACKED
from silo.workbook.ods import read_ods
from silo.workbook.sheet import Grid
from silo.workbook.xls import read_xls
from silo.workbook.xlsx import read_xlsx


def read_workbook(data: bytes, source: str) -> list[Grid]:
    """Read every sheet; those that are hidden come last. InputError if the workbook cannot be read."""
    try:
        grids = list(read_xls(data) if data.startswith(STARTS[1]) else _zipped(data))
    except InputError as error:
        raise InputError(message("{source}: {error}", source=source, error=error)) from error
    except ImportError as error:
        raise InputError(
            message("{source}: this is a workbook; export it as CSV, or install xlrd", source=source)
        ) from error
    except Exception as error:  # any error that a broken file causes in a reader
        raise InputError(
            message(
                "{source}: the workbook cannot be read ({name})",
                source=source,
                name=error or type(error).__name__,
            )
        ) from error
    return sorted(grids, key=lambda grid: not grid.visible)


def _zipped(data: bytes) -> Iterator[Grid]:
    archive = zipfile.ZipFile(io.BytesIO(data))
    if sum(info.file_size for info in archive.infolist()) > MAX_UNPACKED:
        raise InputError(
            message(
                "unpacked, the workbook is larger than {max_unpacked} MB",
                max_unpacked=f"{MAX_UNPACKED / 1000000.0:.0f}",
            )
        )
    parts = {info.filename.replace("\\", "/").casefold(): info for info in archive.infolist()}

    def read(path: str) -> Element:
        part = parts.get(path.casefold())
        content = archive.read(part) if part is not None else b"<none/>"
        # No workbook has a document type. Without one there are no entities, which could grow without end.
        if b"<!DOCTYPE" in content or b"\0" in content[:64]:
            raise InputError(
                message("its {path} has a document type or is not UTF-8; save the workbook again", path=path)
            )
        return fromstring(content)  # noqa: S314 - see above

    return read_ods(read) if "content.xml" in parts else read_xlsx(read)
