# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod bom``, ``where-used`` and ``relink``: what files hold, which link to which, and mending that."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from dataclasses import replace

from silo.batch import ask_for_moved
from silo.bom.document import relative
from silo.bom.errors import DocumentError, Exit, InputError, SiloError, did_you_mean
from silo.bom.identity import walk_entries
from silo.bom.model import BomEntry, Extraction
from silo.bom.report import base_of, bom_json, flat_json
from silo.bom.resolve import consolidation_findings
from silo.bom_sync import resolve
from silo.cli import common
from silo.cli.common import Commands
from silo.files import documents_in
from silo.open_in_freecad import open_in_any


def register(commands: Commands) -> None:
    """Add the commands."""
    _add_bom(commands)
    _add_where_used(commands)
    _add_relink(commands)


def _add_bom(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "bom",
        "show the BOM of a FreeCAD assembly, read from its files without FreeCAD",
        "silo-mod bom examples/gearbox/TopAssembly.FCStd --flat",
    )
    common.add_assembly_options(parser, folders=True)
    parser.add_argument(
        "--flat", action="store_true", help="quantities multiplied down the tree, each part once"
    )
    parser.add_argument(
        "--verify",
        action="store_true",
        help="have freecadcmd compare the BOM with the solids that FreeCAD shows; 1 where they differ",
    )
    parser.add_argument("--resolve", action="store_true", help="ask the server for part numbers and names")
    common.add_json_option(parser)
    common.add_server_options(parser)
    common.only_with(parser, "--resolve", "--server", "--token")
    common.not_with(parser, "--verify", "--flat", "--resolve", *common.READING)
    parser.set_defaults(run=run_bom)


def run_bom(args: argparse.Namespace) -> int:
    """Print the BOM; 1 where an error says that it is not the whole one."""
    if args.verify:
        return _verify(args)
    if os.path.isdir(args.top):
        return _folder(args)
    extraction = common.read_top(args)
    if args.resolve:
        with common.client_of(args) as client:
            common.reach(client, extraction)
            resolved = ask_for_moved(resolve(extraction, client), client)
        known = {entry.key: entry for entry in resolved.unresolved}
        head = _whole(replace(resolved.assembly, children=resolved.entries), known)
        extraction = Extraction(resolved.assembly, head.children, resolved.findings)
    else:
        told = consolidation_findings(extraction.entries)
        extraction = replace(extraction, findings=(*extraction.findings, *told))
    if args.json:
        common.print_json(flat_json(extraction) if args.flat else bom_json(extraction))
        return Exit.UNDONE if extraction.blocked else Exit.DONE
    from silo.cli import show

    out = show.console()
    out.print(show.flat_table(flat_json(extraction)) if args.flat else show.bom_tree(extraction))
    if extraction.findings:
        out.print()
        out.print(show.findings_text(extraction.findings, base_of(extraction)))
    return Exit.UNDONE if extraction.blocked else Exit.DONE


def _folder(args: argparse.Namespace) -> int:
    """Each assembly of a folder with its own lines, children first; 1 where one is not whole."""
    if args.flat or args.resolve:
        raise InputError("--flat and --resolve are for one assembly; name its file.")
    from silo.cli import show

    out, fine, data = show.console(), True, []
    with common.plan_of(args) as (plan, reading, base):
        for node in (node for layer in plan.layers for node in layer):
            found = plan.extraction(node, reading)
            fine = fine and not found.blocked
            if args.json:
                data.append(bom_json(found))
                continue
            out.print(show.bom_tree(found))
            if found.findings:
                out.print(show.findings_text(found.findings, base))
            out.print()
    errors = {relative(top, base): str(error) for top, error in plan.errors.items()}
    if args.json:
        common.print_json({"assemblies": data, "errors": errors})
    for path, words in errors.items() if not args.json else ():
        out.print(f"✗ {show.plain(path)}: {show.plain(words)}", style="red", markup=False)
    return Exit.DONE if fine and not errors else Exit.UNDONE


def _verify(args: argparse.Namespace) -> int:
    """The geometry as witness: the BOM as live FreeCAD has it, against the solids shown."""
    from silo.freecadcmd.run import verify_in_freecad

    if os.path.isdir(args.top):
        raise InputError("--verify is for one assembly; name its file.")
    ((_, found),) = verify_in_freecad([args.top], args.assembly, hardware=not args.no_hardware)
    if isinstance(found, SiloError):
        raise found
    fine = found.agrees and not found.extraction.blocked
    if args.json:
        common.print_json({**bom_json(found.extraction), "witness": list(found.accounts)})
        return Exit.DONE if fine else Exit.UNDONE
    from silo.cli import show

    out = show.console()
    for account in found.accounts:
        mark = "✓" if account["agrees"] else "✗"
        out.print(f"{mark} {show.plain(account['sentence'])}", markup=False)
    if found.extraction.blocked:
        out.print(show.findings_text(found.extraction.findings, base_of(found.extraction)))
    return Exit.DONE if fine else Exit.UNDONE


def _whole(entry: BomEntry, unresolved: Mapping[tuple[str, str], BomEntry]) -> BomEntry:
    """The entry with all its children again, those without a part number too."""
    found = (*entry.children, *(unresolved.get(child.key, child) for child in entry.unregistered))
    children = (
        replace(_whole(one, unresolved), quantity=child.quantity, level=child.level)
        for one, child in zip(found, (*entry.children, *entry.unregistered), strict=True)
    )
    return replace(entry, children=tuple(children))


def _add_where_used(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "where-used",
        "show which files of a vault link to a file, and which tops a change of it touches",
        "silo-mod where-used vault/parts/Bracket.FCStd vault/",
    )
    parser.add_argument("part", metavar="PART.FCStd", help="the file; it need not be there any more")
    parser.add_argument(
        "vault", metavar="VAULT", nargs="?", default=".", help="the folder (default: this one)"
    )
    common.add_json_option(parser)
    common.add_reading_options(parser)
    parser.set_defaults(run=run_where_used)


def run_where_used(args: argparse.Namespace) -> int:
    """Print the files; those of an unchanged vault are known from the index."""
    from silo.vault.session import Question

    if not os.path.isdir(args.vault):
        raise InputError(f"{args.vault} is no folder. Name the folder of the vault.")
    base, part = os.path.realpath(args.vault), os.path.realpath(args.part)
    if not os.path.lexists(part) and os.path.lexists(inner := os.path.join(base, args.part)):
        part = os.path.realpath(inner)  # as the other commands print it
    tops = documents_in([base])
    if part not in tops and not os.path.lexists(part) and not os.path.isdir(os.path.dirname(part)):
        raise InputError(f"{args.part}: there is no such file, nor its folder.")
    users: dict[str, set[str]] = {}
    unread = []
    with common.reading_of(args) as reading:
        reading.index.expect(base)
        for top, answer in zip(tops, reading.ask_many(map(Question, tops)), strict=True):
            if "document" in answer.plain:
                unread.append(top)
            for used in answer.known.links:
                users.setdefault(used, set()).add(top)
    if part not in users and not os.path.lexists(part):
        known = {relative(one, base) for one in (*tops, *users)}
        meant = did_you_mean(relative(part, base), sorted(known)) or "."
        raise InputError(f"{args.part}: there is no such file, and none in {args.vault} links to one{meant}")
    above = _above(part, users)
    found = {
        "direct": users.get(part, ()),
        "all": above,
        "tops": [top for top in above if not users.get(top)],
        "unreadable": unread,
    }
    said = {name: [relative(path, base) for path in sorted(paths)] for name, paths in found.items()}
    if args.json:
        common.print_json({"part": relative(part, base), **said})
        return Exit.UNDONE if unread else Exit.DONE
    from silo.cli import show

    out = show.console()
    lines = said["direct"] or [f"No file of {args.vault} links to it."]
    if said["tops"]:
        lines.append(f"Tops that a change touches: {', '.join(said['tops'])}")
    lines += [f"✗ {path} could not be read, so its links are not known." for path in said["unreadable"]]
    for line in lines:
        out.print(show.plain(line), markup=False)
    return Exit.UNDONE if unread else Exit.DONE


def _above(part: str, users: Mapping[str, set[str]]) -> set[str]:
    """All files that use one, directly or not."""
    found: set[str] = set()
    left = [part]
    while left:
        for user in users.get(left.pop(), ()):
            if user not in found and user != part:
                found.add(user)
                left.append(user)
    return found


def _add_relink(commands: Commands) -> None:
    parser = common.add_command(
        commands,
        "relink",
        "let the links of an assembly and its sub-assemblies lead to a file that has moved",
        "silo-mod relink TopAssembly.FCStd --from parts/Bolt.FCStd --to hardware/Bolt.FCStd --dry-run",
    )
    parser.add_argument("top", metavar="TOP.FCStd", help="the assembly's file")
    parser.add_argument(
        "--from",
        dest="old",
        metavar="OLD",
        required=True,
        help="the file that the links record; relative to TOP's folder, as `silo-mod bom` prints it",
    )
    parser.add_argument("--to", dest="new", metavar="NEW", required=True, help="the file that is meant")
    parser.add_argument(
        "--even-if-open",
        action="store_true",
        help="also files that a running FreeCAD has open; whoever saves them there undoes this",
    )
    parser.add_argument("--dry-run", action="store_true", help="show what would change and write nothing")
    common.add_json_option(parser)
    parser.set_defaults(run=run_relink)


def run_relink(args: argparse.Namespace) -> int:
    """Mend the links; 2 where no link records OLD, or NEW does not hold what they want."""
    from silo.fcstd.linked import Relinked, relink

    folder = os.path.dirname(os.path.realpath(args.top))
    paths = _documents(args.top)
    new = _either(folder, args.new)
    done: list[Relinked] = []
    for old in dict.fromkeys((os.path.join(folder, args.old), os.path.abspath(args.old))):
        done = done or relink(
            paths,
            os.path.normpath(old),
            new,
            dry_run=args.dry_run,
            check=_any if args.even_if_open else _closed,
        )
    if not done:
        raise InputError(f"no link of {args.top} and its sub-assemblies records {args.old}; nothing to mend")
    if args.json:
        rows = [
            {"file": relative(one.path, folder), "links": one.links, "objects": list(one.objects)}
            for one in done
        ]
        common.print_json({"dry_run": args.dry_run, "to": relative(new, folder), "files": rows})
        return Exit.DONE
    from silo.cli import show

    out = show.console()
    for one in done:
        links = "1 link" if one.links == 1 else f"{one.links} links"
        verb = "would lead" if args.dry_run else "now leads" if one.links == 1 else "now lead"
        text = f"✓ {relative(one.path, folder)}: {links} {verb} to {relative(new, folder)}"
        out.print(show.plain(text), markup=False)
    return Exit.DONE


def _any(_path: str) -> None:
    return


def _closed(path: str) -> None:
    if open_in_any().has_file(path):
        raise DocumentError(
            path,
            "it is open in FreeCAD, and saving it there would undo the change. Close it there, or mend the "
            "links from there (BOM in Silo, Mend links); --even-if-open writes it all the same",
        )


def _documents(top: str) -> list[str]:
    """The files of the tree, as far as they can be read."""
    try:
        extraction = common.read_assembly(top)
    except SiloError:  # such as no assembly in the file: its own links can be mended all the same
        return [top]
    entries = walk_entries(extraction.entries)
    return [top, *(entry.doc_path for entry in entries if not entry.missing and entry.doc_path)]


def _either(folder: str, path: str) -> str:
    beside = os.path.normpath(os.path.join(folder, path))
    return beside if os.path.exists(beside) else os.path.abspath(path)
