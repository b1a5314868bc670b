# SPDX-License-Identifier: LGPL-2.1-or-later
"""What is modelled in an assembly's own file and can be declared a component, read from the file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence

from silo.bom.declare import Modelled, modelled_in
from silo.bom.errors import DocumentError, InputError, SiloError
from silo.bom.identity import document_identity
from silo.bom.roots import choose_assembly
from silo.fcstd import Library
from silo.fcstd.objects import FcstdObject


def modelled(path: str, assembly: str | None = None) -> list[Modelled]:
    """What is modelled in the file of an assembly, read without FreeCAD. DocumentError, InputError."""
    with Library() as library:
        return modelled_in(choose_assembly(library.open(path), assembly), _shape_of)


def _shape_of(obj: object) -> str:
    try:
        return obj.shape_key() if isinstance(obj, FcstdObject) else ""
    except DocumentError:  # damaged: nothing is known of it
        return ""


def chosen(articles: Sequence[Modelled], names: Iterable[str], *, apart: bool = False) -> list[Modelled]:
    """The articles that these names (or labels) mean, each once. InputError for a name that means none."""
    found: dict[tuple[str, ...], Modelled] = {}
    for name in names:
        fitting = [one for one in articles if name in one.objects] or [
            one for one in articles if name == one.entry.label
        ]
        if len(fitting) != 1:
            known = ", ".join(one.entry.object_name for one in articles) or "nothing"
            what = "nothing" if not fitting else f"{len(fitting)} things"
            raise InputError(f"{name!r} means {what} that is modelled in this file; there is: {known}")
        for one in fitting[0].apart() if apart else fitting:
            found[one.objects] = one
    return list(found.values())


def source_identity(article: Modelled) -> str | None:
    """The identity of the file that A2plus imported an article from; None where there is none to be read."""
    if not article.source or not os.path.isfile(article.source):
        return None
    try:
        with Library() as library:
            return document_identity(library.open(article.source))
    except SiloError:
        return None
