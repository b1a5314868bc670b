# SPDX-License-Identifier: LGPL-2.1-or-later
"""Starting FreeCAD from outside, with stand-ins that do what a FreeCAD may do: work, die, hang."""

from __future__ import annotations

import json
import os
import stat
import sys
from pathlib import Path

import pytest
from fcstd_writer import Doc, locals_

from silo.bom.entry import BomEntry, Extraction
from silo.bom.errors import ConfigError, DocumentError, InputError
from silo.bom.snapshot import to_plain
from silo.cli.main import main
from silo.freecads.run import ask_inside, find_freecadcmd, freecad_for, run_freecad

# A stand-in for freecadcmd: it gets the same arguments and answers in the same file. What it does with a file
# stands in that file.
PRETENDER = f"""#!{sys.executable}
import json, os, signal, sys, time
assert sys.argv[1] == "-c" and "run_path" in sys.argv[2], sys.argv
assert not sys.stdin.read(), "FreeCAD must not wait for a terminal"
job = json.load(open(os.environ["SILO_ARGS_FILE"], encoding="utf-8"))
with open(job["lines"], "a") as out:
    def tell(data):
        out.write(json.dumps(data) + "\\n"); out.flush()
    for top in job["tops"]:
        what = open(top).read()
        if what == "never starts":
            print("Cannot load library"); sys.exit(4)
        tell({{"begun": top}})
        if what == "die":
            os.kill(os.getpid(), signal.SIGSEGV)
        if what == "die as FreeCAD":  # it catches the signal, says where it was, and ends with 1
            print("Program received signal SIGSEGV, Segmentation fault.\\n#0  one\\n#1  two\\n#2  three")
            sys.exit(1)
        if what == "leave":
            sys.exit(7)
        if what == "hang":
            time.sleep(60)
        if what == "refuse":
            tell({{"top": top, "error": {{"code": "x", "message": "m", "path": top, "reason": "bad"}}}})
        elif what == "ask":
            tell({{"top": top, "error": {{"code": "bad_input", "message": "which assembly?"}}}})
        else:
            plain = json.loads(what)
            plain["table"][0]["label"] = job.get("assembly", "")
            tell({{"top": top, "extraction": plain}})
"""

GOOD = Extraction(assembly=BomEntry(doc_path="top.FCStd", object_name="Top", is_assembly=True, level=0))


@pytest.fixture
def freecadcmd(tmp_path: Path) -> str:
    path = tmp_path / "freecadcmd"
    path.write_text(PRETENDER)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def tops(folder: Path, *contents: str) -> list[str]:
    found = []
    for number, content in enumerate(contents):
        path = folder / f"top{number}.FCStd"
        path.write_text(json.dumps(to_plain(GOOD)) if content == "good" else content)
        found.append(str(path))
    return found


def test_each_file_gives_its_extraction_in_order(tmp_path: Path, freecadcmd: str) -> None:
    """Results come in the order of the files, and name them as the caller did."""
    wanted = tops(tmp_path, "good", "good")
    results = list(run_freecad(wanted, "Main", command=freecadcmd))
    assert [top for top, _ in results] == wanted
    assert all(found == GOOD for _, found in results)
    assert isinstance(results[0][1], Extraction)
    assert results[0][1].assembly.label == "Main"


@pytest.mark.usefixtures("needs_modes")
def test_an_appimage_runs_the_program_that_its_first_argument_names(tmp_path: Path, freecadcmd: str) -> None:
    appimage = tmp_path / "FreeCAD_1.1.1-Linux-x86_64-py311.AppImage"
    appimage.write_text(f'#!/bin/sh\n[ "$1" = freecadcmd ] || exit 9\nshift\nexec {freecadcmd} "$@"\n')
    appimage.chmod(0o755)
    ((_, found),) = run_freecad(tops(tmp_path, "good"), command=str(appimage))
    assert found == GOOD


@pytest.mark.usefixtures("needs_modes")
def test_flatpak_starts_its_freecad_and_finds_the_job(
    tmp_path: Path, freecadcmd: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What Flatpak exports starts the window; and a Flatpak sees a part of the home, not our ``/tmp``."""
    exported = tmp_path / "flatpak" / "exports" / "bin" / "org.freecad.FreeCAD"
    exported.parent.mkdir(parents=True)
    exported.write_text("#!/bin/sh\nexit 9\n")
    exported.chmod(0o755)
    flatpak = tmp_path / "bin" / "flatpak"
    flatpak.parent.mkdir()
    flatpak.write_text(
        '#!/bin/sh\n[ "$*" != "${*#run --die-with-parent --command=FreeCADCmd org.freecad.FreeCAD -c}" ] '
        f'|| exit 8\ncase "$SILO_ARGS_FILE" in "$HOME"/.var/app/*) ;; *) exit 7 ;; esac\n'
        f'shift 4\nexec {freecadcmd} "$@"\n'
    )
    flatpak.chmod(0o755)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{flatpak.parent}{os.pathsep}{os.environ['PATH']}")
    ((_, found),) = run_freecad(tops(tmp_path, "good"), command=str(exported))
    assert found == GOOD


def test_a_file_that_kills_freecad_does_not_stop_the_rest(tmp_path: Path, freecadcmd: str) -> None:
    """FreeCAD is started again for what is left; the deadly files have an error that says how it died."""
    wanted = tops(tmp_path, "good", "die", "good", "leave", "die as FreeCAD")
    results = [found for _, found in run_freecad(wanted, command=freecadcmd)]
    assert [isinstance(found, Extraction) for found in results] == [True, False, True, False, False]
    died = "FreeCAD died while it read this file: it"
    assert str(results[1]) == f"{wanted[1]}: {died} crashed (SIGSEGV)"
    assert str(results[3]) == f"{wanted[3]}: {died} ended with exit code 7"
    assert str(results[4]) == f"{wanted[4]}: {died} crashed (SIGSEGV)"


def test_a_file_that_freecad_hangs_on_is_given_up(tmp_path: Path, freecadcmd: str) -> None:
    """After its time FreeCAD is ended, and started again for the rest."""
    wanted = tops(tmp_path, "hang", "good")
    results = [found for _, found in run_freecad(wanted, command=freecadcmd, timeout_s=5)]
    assert isinstance(results[0], DocumentError)
    assert "did not finish it within 5 s" in str(results[0])
    assert results[1] == GOOD


def test_errors_of_files_come_back_as_they_were(tmp_path: Path, freecadcmd: str) -> None:
    """A document's error keeps path and reason; another input error its sentence."""
    wanted = tops(tmp_path, "refuse", "ask")
    first, second = (found for _, found in run_freecad(wanted, command=freecadcmd))
    assert isinstance(first, DocumentError)
    assert (first.path, first.reason) == (wanted[0], "bad")
    assert isinstance(second, InputError)
    assert str(second) == "which assembly?"


def test_a_freecad_that_does_not_start_is_reported_once(tmp_path: Path, freecadcmd: str) -> None:
    """Not one error per file, but one that says what FreeCAD said."""
    with pytest.raises(ConfigError, match=r"did not work: it ended with exit code 4\..*Cannot load library"):
        list(run_freecad(tops(tmp_path, "never starts", "good"), command=freecadcmd))


def test_a_freecad_that_crashes_at_its_start_says_so(tmp_path: Path) -> None:
    """Whoever asks it something, such as doctor, reads of the crash and not of lines of a trace."""
    command = tmp_path / "freecadcmd"
    crash = "Cannot load library\\nProgram received signal SIGABRT, Aborted.\\n#0  one\\n#1  two\\n"
    command.write_text(f"#!/bin/sh\nprintf '{crash}'\nexit 1\n")
    command.chmod(0o755)
    with pytest.raises(ConfigError, match=r"it crashed \(SIGABRT\)\. It said: Cannot load library$"):
        ask_inside(str(command), "", {})
    with pytest.raises(ConfigError, match=r"it crashed \(SIGABRT\)\. It said: Cannot load library$"):
        list(run_freecad(tops(tmp_path, "good"), command=str(command)))


def test_a_reader_that_stops_early_ends_freecad(tmp_path: Path, freecadcmd: str) -> None:
    """Nothing is left running when the caller has seen enough."""
    results = run_freecad(tops(tmp_path, "good", "hang"), command=freecadcmd)
    assert next(results)[1] == GOOD
    results.close()  # would wait for the hanging program's minute if it were not ended


@pytest.mark.usefixtures("needs_modes")
@pytest.mark.parametrize(
    ("saved", "taken"), [((), "0.20"), ((0, 21), "1.0"), ((1, 1), "1.1"), ((1, 9), "1.1"), ((1, 0), "1.0")]
)
def test_a_freecad_that_can_open_the_file_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, saved: tuple[int, ...], taken: str
) -> None:
    """The first that is no older than the file, else the newest; one that crashes is passed over."""
    monkeypatch.delenv("SILO_FREECADCMD", raising=False)
    monkeypatch.setenv("PATH", os.pathsep.join((str(tmp_path), "/usr/bin", "/bin")))
    answers = {"freecadcmd": "0.20", "FreeCADCmd": "", "freecadcmd-daily": "1.0", "freecad.cmd": "1.1"}
    for name, version in answers.items():
        path = tmp_path / name
        told = f"[{version.replace('.', ', ')}]"
        path.write_text(f"#!/bin/sh\n[ -n '{version}' ] || exit 1\nprintf '{told}' > \"$SILO_OUT\"\n")
        path.chmod(0o755)
    command, version = freecad_for(saved)
    assert (version, answers[Path(command).name]) == (taken, taken)


@pytest.mark.usefixtures("needs_modes")
def test_a_freecad_that_can_open_the_linked_files_too_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An old assembly of a part that a newer FreeCAD saved; numbers of realthunder's branch say nothing."""
    monkeypatch.delenv("SILO_FREECADCMD", raising=False)
    monkeypatch.setenv("PATH", os.pathsep.join((str(tmp_path), "/usr/bin", "/bin")))
    for name, version in {"freecadcmd": "0, 20", "freecadcmd-daily": "1, 1"}.items():
        path = tmp_path / name
        path.write_text(f'#!/bin/sh\n[ -n "$SILO_OUT" ] || exit 3\nprintf "[{version}]" > "$SILO_OUT"\n')
        path.chmod(0o755)
    for program, taken in (("1.1", "1.1"), ("2022.1129", "0.20")):
        Doc(program=program).add("PartDesign::Body", "Body").save(tmp_path / "part.FCStd")
        top = Doc(program="0.20").link("Link", "part.FCStd", "Body")
        path = top.add("App::Part", "Top", Group=locals_("Link")).save(tmp_path / "top.FCStd")
        assert main(["bom", str(path), "--verify"]) == 2  # the stand-in only says its version
        assert f"Compared in FreeCAD {taken} (" in capsys.readouterr().err


def test_the_freecad_of_the_environment_is_taken(freecadcmd: str) -> None:
    """SILO_FREECADCMD decides; a given command comes before it."""
    assert find_freecadcmd(env={"SILO_FREECADCMD": freecadcmd}) == freecadcmd
    assert find_freecadcmd(freecadcmd, env={"SILO_FREECADCMD": "/nowhere"}) == freecadcmd


def test_a_wrong_freecad_is_one_plain_sentence() -> None:
    """The message names what was wanted and where it is set."""
    with pytest.raises(ConfigError, match="/nowhere/freecadcmd cannot be run; SILO_FREECADCMD must name"):
        find_freecadcmd(env={"SILO_FREECADCMD": "/nowhere/freecadcmd"})


def test_without_any_freecad_the_message_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither on the PATH nor in the usual places."""
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ConfigError, match="Install FreeCAD, or set SILO_FREECADCMD"):
        find_freecadcmd(env={})


def test_thousands_of_files_are_one_job(tmp_path: Path, freecadcmd: str) -> None:
    """More than an environment variable could hold, on any platform."""
    (wanted,) = tops(tmp_path, "good")
    folder = tmp_path / ("f" * 200)
    folder.mkdir()
    names = [str(folder / f"{number:04d}.FCStd") for number in range(700)]
    for name in names:
        Path(name).hardlink_to(wanted)
    results = list(run_freecad(names, command=freecadcmd))
    assert [top for top, _ in results] == names
    assert all(found == GOOD for _, found in results)
