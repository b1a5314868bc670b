# SPDX-License-Identifier: LGPL-2.1-or-later
"""FreeCAD files on disk: which are meant, and their content's hash. Standard library only."""

from __future__ import annotations

import glob
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path

from silo.bom.errors import ConfigError, DocumentError, InputError
from silo.spelling import Spelling

IGNORE_FILE = ".siloignore"


def documents_in(tops: Iterable[str]) -> list[str]:
    """The files that are meant, each once: a folder stands for all FCStd files below it, backups left out.

    What the folder's ``.siloignore`` names (in the syntax of ``.gitignore``) is left out. A pattern
    (``*.FCStd``) stands for what fits it: the shells of Windows hand patterns over as they are. InputError
    names all that is not there.
    """
    meant = list(chain.from_iterable(map(_meant, tops)))
    must_exist(*meant)
    spelling = Spelling()
    once: dict[str, str] = {}
    for top in meant:
        real = spelling.real(top)  # a file may be named in several ways
        if not os.path.isdir(top):
            once.setdefault(real, top)
        for path in sorted(_below(top)):
            once.setdefault(os.path.join(real, os.path.relpath(path, top)), path)
    return list(once.values())


def must_exist(*paths: str) -> None:
    """InputError for files and folders that are not there, before anything is done; it names all of them."""
    lost = [path for path in paths if not os.path.exists(path)]
    if len(lost) == 1:
        raise InputError(f"{_quoted(lost[0])}: there is no such file or folder")
    if lost:
        raise InputError(f"{len(lost)} of {len(paths)} files are not there; nothing was done", lost)


def _quoted(path: str) -> str:
    return path if path.strip() else repr(path)


def _below(folder: str) -> Iterator[str]:
    ignored = _ignored(os.path.join(folder, IGNORE_FILE))
    for here, folders, names in os.walk(folder):
        inner = os.path.relpath(here, folder)
        inner = "" if inner == os.curdir else inner.replace(os.sep, "/") + "/"
        folders[:] = sorted(name for name in folders if name != ".git" and not ignored(f"{inner}{name}/"))
        for name in names:
            path = os.path.join(here, name)
            if name.lower().endswith(".fcstd") and not ignored(inner + name) and os.path.isfile(path):
                yield path


def _ignored(path: str) -> Callable[[str], bool]:
    """What a file of patterns leaves out."""
    if not os.path.isfile(path):
        return lambda _name: False
    try:
        from pathspec import GitIgnoreSpec
    except ImportError as error:  # inside FreeCAD
        raise ConfigError(
            f"{path} is there, but the Python package pathspec, which reads it, is not"
        ) from error
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
        return GitIgnoreSpec.from_lines(lines).match_file
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}") from error


def _meant(top: str) -> list[str]:
    if glob.has_magic(top) and not os.path.lexists(top):
        return sorted(glob.glob(top)) or [top]
    return [top]


def job_text(env: Mapping[str, str]) -> str | None:
    """The arguments of a job inside FreeCAD: the file that ``SILO_ARGS_FILE`` names, else ``SILO_ARGS``.

    An environment variable ends at 32 767 characters on Windows, and at 128 KiB on Linux. Raises OSError.
    """
    if name := env.get("SILO_ARGS_FILE"):
        return Path(name).read_text(encoding="utf-8")
    return env.get("SILO_ARGS")


def check_writable(*paths: str | None) -> None:
    """Raise InputError for a file that cannot be written, before a long run ends with that news."""
    for path in filter(None, paths):
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise InputError(f"{path} cannot be written: there is no folder {folder}")
        if os.path.isdir(path) or not os.access(path if os.path.exists(path) else folder, os.W_OK):
            raise InputError(f"{path} cannot be written: it is a folder, or may not be changed")


def content_hash(path: Path | str) -> str:
    """The SHA-256 of a file's content, in hexadecimal. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_of(path: str) -> str:
    """The hash of a document that must be readable; DocumentError where it is not."""
    try:
        return content_hash(path)
    except OSError as error:
        raise DocumentError(path, error.strerror or str(error)) from error


def shipped() -> Path:
    """The folder with the example and the add-on's own files: the checkout, or what the wheel holds of it."""
    wheel = Path(__file__).parent / "shipped"
    return wheel if wheel.is_dir() else Path(__file__).resolve().parents[2]
