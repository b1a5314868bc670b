# SPDX-License-Identifier: LGPL-2.1-or-later
"""Previews for people: a GLB to turn round, a PNG for the report. Needs no graphics card."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from silo.bom.errors import InputError
from silo.inertia.geometry.glb import write_glb
from silo.inertia.geometry.picture import write_picture
from silo.inertia.geometry.scene import LinkView, views_of
from silo.inertia.model import Assembly

if TYPE_CHECKING:
    from silo.inertia.report import InertiaReport

__all__ = ["LinkView", "preview_bytes", "write_preview"]


def write_preview(report: InertiaReport, assembly: Assembly, path: Path) -> None:
    """Draw the links of a report with their centres of mass and ellipsoids: ``.glb`` or ``.png`` by suffix.

    Raises InputError for another suffix and where the file cannot be written.
    """
    data = preview_bytes(assembly, views_of(report, assembly), path.suffix)
    try:
        handle, name = tempfile.mkstemp(dir=path.absolute().parent, suffix=".tmp")
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError as error:
        raise InputError(f"{path}: the preview cannot be written: {error.strerror or error}") from error


def preview_bytes(assembly: Assembly, views: Sequence[LinkView], suffix: str) -> bytes:
    """The preview as ``.glb`` or ``.png``. InputError for another suffix."""
    if suffix.lower() == ".glb":
        return write_glb(assembly, views)
    if suffix.lower() == ".png":
        return write_picture(assembly, views)
    raise InputError(f"a preview is a .glb or a .png file, got '{suffix}'")
