# SPDX-License-Identifier: LGPL-2.1-or-later
"""Live links that lead nowhere, led to the file that was meant. GUI thread; the user saves them."""

from __future__ import annotations

from typing import Any

from silo.bom.errors import DocumentError
from silo.bom.findings import Finding
from silo.bom.message import message
from silo.bom.walk.document import LinkProblem, located
from silo.workbench.freecad import host, live
from silo.workbench.freecad.opening import open_fully
from silo.workbench.freecad.stored_links import stored_sub_name


def relink(finding: Finding) -> list[str]:
    """Set the links that a finding names to the file that it says was meant; labels of what was repaired.

    Makes one undo step per document. Raises DocumentError if the file lacks an object that a link wants; then
    nothing is changed.
    """
    meant = open_fully(finding.did_you_mean)
    inspect = live.LinkInspector()
    mended: list[tuple[Any, Any, str]] = []
    for place in finding.where:
        document = host.find_document(place.doc_path)
        link = document.getObject(place.obj) if document is not None else None
        problem = inspect(link) if link is not None else None
        if link is None or problem is None or located(problem.file, document.FileName) != finding.file:
            continue  # repaired meanwhile
        mended.append((link, _target(meant, problem), stored_sub_name(link)))
    for document in {link.Document.Name: link.Document for link, _, _ in mended}.values():
        document.openTransaction("Silo: relink")
    for link, target, sub in mended:
        link.LinkedObject = (target, sub) if sub else target
    for document in {link.Document.Name: link.Document for link, _, _ in mended}.values():
        document.commitTransaction()
        document.recompute()
    return [link.Label for link, _, _ in mended]


def _target(meant: Any, problem: LinkProblem) -> Any:
    target = meant.getObject(problem.obj)
    if target is None:
        raise DocumentError(
            meant.FileName,
            message("it holds no object named {obj}; nothing was changed", obj=repr(problem.obj)),
        )
    return target
