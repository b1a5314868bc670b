# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a STEP file before the geometry kernel sees it: what is refused, what is rewritten.

Nothing here needs the kernel, so another process can do it while the kernel loads.
"""

from __future__ import annotations

import mmap
import re
from dataclasses import dataclass, replace
from pathlib import Path

from silo.bom.errors import DocumentError, InputError
from silo.inertia.geometry.step.part21 import scan
from silo.inertia.geometry.step.product_text import WANTED, Products, count_placed, read_products
from silo.inertia.geometry.step.regroup import regrouped

_FACE = re.compile(rb"ADVANCED_FACE")
_EXTERNAL = re.compile(
    rb"((?:DOCUMENT_FILE|APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT|EXTERNALLY_DEFINED\w*)\s*\(\s*)'(?:[^']|'')*'"
)


@dataclass(frozen=True)
class Prepared:
    """What the text says of products, which file the kernel shall read, and how many faces there are."""

    products: Products
    source: Path
    faces: int


def prepare(path: Path, folder: Path, max_instances: int) -> Prepared:
    """Look through a STEP file; where it is rewritten, the copy lies in ``folder``. Raises DocumentError."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        text = scan(data, WANTED)
        if not text.complete:
            raise DocumentError(
                str(path), "the file ends in the middle (no END-ISO-10303-21); export or copy it again"
            )
        products = read_products(text)
        _refuse_bombs(path, products, max_instances)
        changed, added = regrouped(data, products)
        products = replace(products, count=products.count + added)
        if "DOCUMENT_FILE" in text.keywords.values():
            # The kernel would open the files that are named, in any folder, without asking.
            changed = _EXTERNAL.sub(rb"\1'silo-looks-for-it'", data[:] if changed is None else changed)
        faces = sum(1 for _ in _FACE.finditer(data))
    if changed is None:
        return Prepared(products, path, faces)
    source = folder / "part.step"
    source.write_bytes(changed)
    return Prepared(products, source, faces)


def _refuse_bombs(path: Path, products: Products, most: int) -> None:
    # Before the kernel sees it: a kilobyte of assemblies of assemblies keeps it busy for ever.
    try:
        count = count_placed(products)
    except InputError as error:
        raise DocumentError(str(path), str(error)) from error
    if count > most:
        raise DocumentError(str(path), f"it unfolds to {count} placed parts, more than the {most} allowed")
