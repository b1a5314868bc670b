# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reading in a child process: what is broken, too large or too slow is an error message (case 17)."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from silo.bom.errors import CancelledError, ConfigError, DocumentError
from silo.inertia.geometry import Progress, ReadOptions, read
from silo.inertia.geometry.child import run
from silo.inertia.notes import GeometryCode


def options(**more: Any) -> ReadOptions:
    """No cache, so that the child really runs."""
    return ReadOptions(cache=False, **more)


@pytest.mark.usefixtures("cold")
def test_a_child_reads_what_this_process_reads(box: Any, step_part: Any, read_in: Any) -> None:
    """The same numbers to the last bit, whoever reads; only the mesh travels in single precision."""
    path = step_part(box(10, 20, 30), "bracket")
    (there,) = read(path, options=options()).prototypes.values()
    (here,) = read_in(path).prototypes.values()
    assert there.volume_m3 == here.volume_m3
    assert there.com_m.tolist() == here.com_m.tolist()
    assert there.inertia_unit.tolist() == here.inertia_unit.tolist()
    assert (there.name, there.key, there.part_number) == (here.name, here.key, here.part_number)
    assert len(there.mesh) == len(here.mesh)


def test_progress_names_the_stages(box: Any, step_part: Any, capfd: pytest.CaptureFixture[str]) -> None:
    """A caller sees what is going on, and how far it is; the kernel's noise stays out of its output."""
    seen: list[Progress] = []
    path = step_part(box(1, 2, 3))
    capfd.readouterr()
    read(path, options=options(progress=seen.append))
    assert capfd.readouterr() == ("", "")
    assert [str(p) for p in seen] == ["reading", "measuring 1/1"]


BAD = [
    (b"", "empty"),
    (b"   \n", "empty"),
    (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
    (b'\xef\xbb\xbf<?xml version="1.0"?>\n<n0:Uos/>', "XML.* export the assembly as STEP text"),
    (b"\x1f\x8b\x08", "compressed .gzip.; unpack it"),
    (b"PK\x05\x06" + bytes(18), "zip archive, and no FreeCAD document"),
    (b"<!DOCTYPE html><html>404</html>", "named like a step file, but its content is not"),
    (b"ISO-10303-21;\nHEADER;\n", "ends in the middle"),
    (b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", "STEP|product|geometry"),
    (b"ISO-10303-21;\n" + bytes(range(256)) * 40 + b"\nEND-ISO-10303-21;\n", "STEP|product|geometry"),
]


@pytest.mark.parametrize(("content", "reason"), BAD, ids=range(len(BAD)))
def test_a_bad_file_is_a_plain_sentence(content: bytes, reason: str, tmp_path: Path) -> None:
    """Empty, LFS pointer, HTML, truncated, without content, binary noise: DocumentError, path first."""
    path = tmp_path / "bad.step"
    path.write_bytes(content)
    with pytest.raises(DocumentError, match=reason) as caught:
        read(path, options=options())
    assert str(caught.value).startswith(str(path))


def test_missing_files_and_folders_are_kept_apart(tmp_path: Path) -> None:
    """No such file, a folder, a format that nobody reads here."""
    with pytest.raises(DocumentError, match="cannot be opened"):
        read(tmp_path / "nowhere.step")
    with pytest.raises(DocumentError, match="is a folder"):
        read(tmp_path)
    (tmp_path / "drawing.dwg").write_bytes(b"AC1032")
    with pytest.raises(DocumentError, match="no geometry format that is read here"):
        read(tmp_path / "drawing.dwg")


@pytest.mark.usefixtures("cold")
def test_what_the_kernel_complains_of_is_counted(
    box: Any, step_part: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An unresolved reference is printed by the kernel to standard output; here it is a problem.

    Whether or not the user's Python writes its output at once.
    """
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    path = step_part(box(1, 2, 3))
    text = path.read_text("ascii")
    path.write_text(
        text.replace("ENDSEC;\nEND-ISO", "#90000=PRODUCT('x','x','',(#99999));\nENDSEC;\nEND-ISO"), "ascii"
    )
    assembly = read(path, options=options())
    assert [p.code for p in assembly.problems] == [GeometryCode.READER]
    assert "complained" in assembly.problems[0].message
    assert "\x1b" not in assembly.problems[0].message


def child(code: str) -> list[str]:
    """A child that does this instead of reading."""
    return [sys.executable, "-c", code]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import os; os.kill(os.getpid(), 11)", r"kernel crashed \(SIGSEGV\) on it"),
        ("raise RuntimeError('it is sad')", r"the reader stopped with an error: RuntimeError: it is sad\Z"),
    ],
)
def test_a_child_that_ends_is_an_error_message(code: str, words: str, tmp_path: Path) -> None:
    """A segmentation fault by its name; of a stack trace the last line."""
    (tmp_path / "part.step").write_bytes(b"ISO-10303-21;")
    with pytest.raises(DocumentError, match=words):
        run(tmp_path / "part.step", options(), tmp_path / "r", child(code))


def test_a_child_that_hangs_is_ended(box: Any, step_part: Any, tmp_path: Path) -> None:
    """After the time allowed, with what to do; and the child is gone."""
    pid = tmp_path / "pid"
    code = f"import os, time; open({str(pid)!r}, 'w').write(str(os.getpid())); time.sleep(600)"
    path = step_part(box(1, 2, 3))
    with pytest.raises(DocumentError, match=r"could not be read within 5 s; allow more time"):
        run(path, options(timeout_s=5), tmp_path / "r", child(code))
    assert not alive(int(pid.read_text()))


def test_cancelling_ends_the_child_at_once(box: Any, step_part: Any, tmp_path: Path) -> None:
    """The caller says stop: CancelledError, no failure of the file, and no process left behind."""
    pid = tmp_path / "pid"
    code = f"import os, time; open({str(pid)!r}, 'w').write(str(os.getpid())); time.sleep(600)"
    asked: list[int] = []

    def cancelled() -> bool:
        asked.append(1)
        return pid.is_file() and pid.read_text() != ""

    with pytest.raises(CancelledError, match="cancelled"):
        run(step_part(box(1, 2, 3)), options(timeout_s=60, cancelled=cancelled), tmp_path / "r", child(code))
    assert asked
    assert not alive(int(pid.read_text()))


@pytest.mark.skipif(sys.platform == "win32", reason="helpers end there when their input does")
def test_what_the_child_started_ends_with_it(box: Any, step_part: Any, tmp_path: Path) -> None:
    """Helpers of a child that is ended are no orphans."""
    pid = tmp_path / "pid"
    sleeper = f"import os, time; open({str(pid)!r}, 'w').write(str(os.getpid())); time.sleep(600)"
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {sleeper!r}])"
    with pytest.raises(CancelledError):
        run(
            step_part(box(1, 2, 3)),
            options(cancelled=lambda: pid.is_file() and pid.read_text() != ""),
            tmp_path / "r",
            child(code),
        )
    assert gone(int(pid.read_text()))


def gone(pid: int) -> bool:
    """True when there is no such process any more; it is waited for, since nobody here is its parent."""
    for _ in range(500):
        status = Path(f"/proc/{pid}/stat")
        if not alive(pid) or (status.is_file() and status.read_text().rpartition(")")[2].split()[0] == "Z"):
            return True
        threading.Event().wait(0.02)
    return False


def alive(pid: int) -> bool:
    """True while there is such a process."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no memory limit for a process")
@pytest.mark.usefixtures("cold")
def test_the_memory_limit_is_an_error_message(box: Any, step_part: Any) -> None:
    """A child that may have 300 MB cannot even load the kernel; the message names the limit."""
    with pytest.raises(DocumentError, match="needs more than the 300 MB allowed"):
        read(step_part(box(1, 2, 3)), options=options(memory_mb=300))


def test_a_wrong_mesh_unit_is_reported_before_anything_is_read(tmp_path: Path) -> None:
    """A configuration error crosses the process border as what it is."""
    path = tmp_path / "part.stl"
    corners = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    path.write_text(
        f"solid x\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid\n", "ascii"
    )
    with pytest.raises(ConfigError, match=r"mesh_unit: wanted one of .*, got 'furlong'"):
        read(path, options=options(mesh_unit="furlong"))


def test_reading_here_can_be_cancelled_too(box: Any, step_part: Any, read_in: Callable[..., Any]) -> None:
    """Without a child, between two stages."""
    with pytest.raises(CancelledError):
        read_in(step_part(box(1, 2, 3)), cancelled=lambda: True)
