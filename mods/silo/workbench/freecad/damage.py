# SPDX-License-Identifier: LGPL-2.1-or-later
"""Damaged files, which FreeCAD opens without a word."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from silo.bom.message import message

if TYPE_CHECKING:
    from silo.fcstd.errors import FcstdError


DAMAGED = message(
    "FreeCAD opens what it can of a damaged file, and saving that would make the "
    "loss final: fetch the file again, or check that nothing is missing and save it "
    "in FreeCAD yourself"
)

# File and object → the file's state when all that the object needs could be read.
_SOUND: dict[tuple[str, str], object] = {}

_REMEMBERED = 20_000


def damage(path: str, name: str = "") -> FcstdError | None:
    """Find why a file cannot be read as far as an object in it needs ("": to its end); None if it can.

    FreeCAD reads a file from its beginning and opens what it finds: objects without shapes if the file is cut
    short, some of the objects if its Document.xml is damaged. At most it says so in the report view. A file
    that is missing or may not be read is no damage: the session keeps what it has.
    """
    from silo.bom.findings import FindingCode
    from silo.fcstd import Library
    from silo.fcstd.container import FileStat
    from silo.fcstd.errors import FcstdError
    from silo.fcstd.expat_reader import Refused
    from silo.fcstd.limits import ANY_SIZE

    if not path or not os.access(path, os.R_OK):
        return None
    try:
        state = FileStat.of(os.stat(path))
        if _SOUND.get((path, name)) == state:
            return None
        with Library(limits=ANY_SIZE) as library:
            document = library.glance(path)
            if not name:
                document.complete()
            elif (obj := document.getObject(name)) is not None:
                document.check(obj)
    except FcstdError as error:
        sound = error.finding is FindingCode.MISSING_FILE or isinstance(error.__cause__, Refused)
        return None if sound else error
    except OSError:
        return None
    if len(_SOUND) >= _REMEMBERED:
        _SOUND.clear()
    _SOUND[path, name] = state
    return None
