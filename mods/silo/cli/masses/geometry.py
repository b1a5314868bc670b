# SPDX-License-Identifier: LGPL-2.1-or-later
"""The geometry of a model, read with the options of a command and with its progress shown."""

from __future__ import annotations

import argparse
import codecs
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import spoken
from silo.bom.errors import InputError
from silo.bom.message import message
from silo.cli.progress import set_step

if TYPE_CHECKING:
    from silo.inertia.assembly import Assembly
    from silo.inertia.geometry import ReadOptions


def read_options(args: argparse.Namespace, **more: Any) -> ReadOptions:
    """Make the options for reading geometry from the arguments."""
    from silo.inertia.geometry import ReadOptions

    return ReadOptions(
        mesh_unit=args.mesh_unit,
        step_encoding=_known_encoding(args.step_encoding or getattr(args, "encoding", None)),
        timeout_s=args.timeout,
        processes=args.geometry_jobs,
        siblings=not args.no_siblings,
        cache=not args.no_cache,
        **more,
    )


def _known_encoding(name: str | None) -> str | None:
    """Return the encoding; InputError for a name that Python does not know."""
    try:
        codecs.lookup(name or "utf-8")
    except LookupError as error:
        text = "there is no encoding {name}; usual are utf-8, cp1252, shift_jis, gbk, cp1251 and euc_kr"
        raise InputError(message(text, name=name)) from error
    return name


def read_model(path: str, args: argparse.Namespace, **more: Any) -> Assembly:
    """Read the geometry, and show the progress on standard error; Ctrl-C stops it at once."""
    from silo.inertia.calculator import read_geometry

    with _progress(Path(path).name) as progress:
        assembly = read_geometry(path, read_options(args, progress=progress, **more))
    set_step("calculating")
    return assembly


# The stages of a reader, in words of ours.
_STAGES = {"reading": message("reading"), "measuring": message("measuring")}


def _how_far(progress: Any) -> str:
    stage: str = _STAGES.get(progress.stage, progress.stage)
    if not progress.total:
        return stage
    return message("{stage} {done}/{total}", stage=stage, done=progress.done, total=progress.total)


@contextmanager
def _progress(name: str) -> Iterator[Any]:
    if not sys.stderr.isatty():
        yield lambda progress: set_step(message("{name}: {progress}", name=name, progress=_how_far(progress)))
        return
    set_step("")  # the bar says it
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn("{task.fields[file]}: {task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with bar:
        task = bar.add_task(spoken(_STAGES["reading"]), total=None, file=name)

        def told(progress: Any) -> None:
            bar.update(
                task,
                description=spoken(_how_far(progress)),
                completed=progress.done,
                total=progress.total or None,
            )

        yield told
