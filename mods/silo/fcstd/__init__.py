# SPDX-License-Identifier: LGPL-2.1-or-later
"""FCStd files as FreeCAD-shaped document objects, without FreeCAD.

``open_document(path)`` gives a document whose objects the walker of :mod:`silo.bom` takes as it takes live
ones; linked files are opened when a link is followed. Input is hostile until proven otherwise. ``stamp``
writes an identity into a file, ``answer`` if an object counts.
"""

from silo.fcstd.document import FcstdDocument
from silo.fcstd.library import Library, open_document
from silo.fcstd.limits import Limits
from silo.fcstd.objects import FcstdObject
from silo.fcstd.stamp import answer, check_stampable, stamp, unstamp

__all__ = [
    "FcstdDocument",
    "FcstdObject",
    "Library",
    "Limits",
    "answer",
    "check_stampable",
    "open_document",
    "stamp",
    "unstamp",
]
