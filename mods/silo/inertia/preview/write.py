# SPDX-License-Identifier: LGPL-2.1-or-later
"""Previews for people: a GLB to turn round, a PNG for the report. Needs no graphics card."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import InputError
from silo.inertia.model import Assembly
from silo.inertia.output.files import write_whole
from silo.inertia.preview.glb import write_glb
from silo.inertia.preview.picture import write_picture
from silo.inertia.preview.scene import LinkView, views_of

if TYPE_CHECKING:
    from silo.inertia.report import InertiaReport

__all__ = ["LinkView", "preview_bytes", "write_preview"]


def write_preview(report: InertiaReport, assembly: Assembly, path: Path) -> None:
    """Draw the links of a report with their centres of mass and ellipsoids: ``.glb`` or ``.png`` by suffix.

    Raises InputError for another suffix and where the file cannot be written.
    """
    write_whole(path, preview_bytes(assembly, views_of(report, assembly), path.suffix))


def preview_bytes(assembly: Assembly, views: Sequence[LinkView], suffix: str) -> bytes:
    """The preview as ``.glb`` or ``.png``. InputError for another suffix."""
    if suffix.lower() == ".glb":
        return write_glb(assembly, views)
    if suffix.lower() == ".png":
        return write_picture(assembly, views)
    raise InputError(f"a preview is a .glb or a .png file, got '{suffix}'")
