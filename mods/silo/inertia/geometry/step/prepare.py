# SPDX-License-Identifier: LGPL-2.1-or-later
"""The text of a STEP file before the geometry kernel sees it: what is refused, what is rewritten.

Nothing here needs the kernel, so another process can do it while the kernel loads.
"""

from __future__ import annotations

import mmap
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from silo.bom.errors import DocumentError, InputError
from silo.inertia.geometry.helpers import WORTH_HELP, Helpers
from silo.inertia.geometry.labels import file_key, step_files
from silo.inertia.geometry.options import ReadOptions
from silo.inertia.geometry.step.part21 import scan
from silo.inertia.geometry.step.product_text import WANTED, Products, count_placed, read_products
from silo.inertia.geometry.step.regroup import regrouped

MANY_FACES = 3000
"""From so many on, measuring takes so long that a second processor is worth its start."""

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


def begin(path: Path, options: ReadOptions, helpers: Helpers) -> Callable[[], Prepared]:
    """Look through a STEP file before the kernel is loaded here; of a large one a helper does it meanwhile.

    Helpers that are worth their start then load the kernel, too. Raises DocumentError, now or when called.
    """
    large = path.stat().st_size >= WORTH_HELP and helpers.start()
    text = helpers.begin(prepare, path.resolve(), helpers.folder(), options.max_instances)

    def found() -> Prepared:
        prepared = text()
        beside = _bytes_beside(path, prepared.products, options)
        if beside >= WORTH_HELP:
            helpers.start()
        if beside >= WORTH_HELP or prepared.faces >= MANY_FACES:
            helpers.load_kernel()
        else:
            helpers.end()
        return prepared

    if large:
        return found
    prepared = found()
    return lambda: prepared


def _bytes_beside(path: Path, products: Products, options: ReadOptions) -> int:
    """How much geometry may lie in the files of a split assembly; :mod:`siblings` looks closer."""
    wanted = {file_key(name) for name in products.elsewhere()} if options.siblings else None
    if not wanted:
        return 0
    folder = Path(os.path.realpath(path)).parent
    found = (file for file in step_files(folder, options.sibling_depth) if file_key(file.stem) in wanted)
    return sum(file.stat().st_size for file in islice(found, options.max_siblings))


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
        changed, added = regrouped(text, products)
        products = replace(products, count=products.count + added)
        if text.ids.get("DOCUMENT_FILE"):
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
