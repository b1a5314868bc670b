# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod sync``: bring BOMs to the server; of one file, or of a whole vault every night.

``silo-mod pull`` and ``silo-mod log``: files from Silo, and what became of one over time.

``silo-mod queue``: the commits that are not in Silo yet.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from silo import spoken
from silo.batch import SyncOptions, TopResult
from silo.bom.errors import ConfigError, Exit, InputError, SiloError, counted, exit_of
from silo.cli.common import (
    EACH,
    above_zero,
    add_each,
    add_options,
    client_of,
    count_steps,
    named_item,
    only_with,
    print_json,
    reach,
    reading_of,
    refuse_assembly_of,
    set_sending_step,
    set_step,
)
from silo.files import check_writable, documents_in
from silo.outbox.store import KEPT_ASIDE_DAYS

if TYPE_CHECKING:
    from silo.api.client import SiloClient
    from silo.api.pause import Pause
    from silo.api.wire import Item, ProductChanges, Revision
    from silo.batch import RunSummary
    from silo.outbox.entry import Entry
    from silo.outbox.store import Store
    from silo.vault.pull import Pulled


def add_sync(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    parser.add_argument(
        "tops", metavar="TOP", nargs="+", help="assembly files, or folders: all assemblies below them"
    )


def run_sync(args: argparse.Namespace) -> int:
    """Sync each file; one failure does not stop the rest. Returns 1 or 3 if anything was left undone."""
    from silo.api.policy import NIGHT
    from silo.batch import ReportFile, RunSummary
    from silo.vault.plan import only_job

    refuse_assembly_of(args.tops, args.assembly)
    tops = documents_in(args.tops)
    if not tops:
        raise InputError(f"no FreeCAD files (*.FCStd) in {', '.join(args.tops)}")
    check_writable(*args.report)
    folders = [top for top in args.tops if Path(top).is_dir()]
    base = os.path.realpath(folders[0]) if len(folders) == len(args.tops) == 1 else ""
    options = SyncOptions(
        recursive=args.recursive or bool(folders),
        allow_missing=args.allow_missing,
        dry_run=args.dry_run,
        skip_parts=bool(folders),
    )
    summary = RunSummary(base)
    stop = threading.Event()
    with ExitStack() as stack:
        for folder in {os.path.realpath(folder): folder for folder in folders}.values():
            summary.notes += filter(None, [stack.enter_context(only_job(folder))])
        client = stack.enter_context(client_of(args, NIGHT, stop=stop))
        reports = [ReportFile(path) for path in args.report]
        shown = _Shown(args, many=len(tops) > 1)
        ended = None
        try:
            for result in _results(args, tops, options, client, summary, stop):
                summary.add(result)
                shown.add(result)
                for report in reports:
                    report.add(result)
            ended = summary
        finally:
            for report in reports:
                report.close(ended)
            shown.close(ended)
    for trouble in filter(None, (report.trouble for report in reports)):
        print(f"silo-mod: {trouble}", file=sys.stderr)
    return summary.exit_code or int(any(report.trouble for report in reports))


def _results(
    args: argparse.Namespace,
    tops: Sequence[str],
    options: SyncOptions,
    client: SiloClient,
    summary: RunSummary,
    stop: threading.Event,
) -> Iterator[TopResult]:
    from silo.vault.plan import SyncJob, make_plan

    begin = time.monotonic()
    with reading_of(args) as reading:
        if summary.base:
            reading.index.expect(summary.base)
        plan = make_plan(
            tops,
            reading,
            assembly=None if args.assembly == EACH else args.assembly,
            each=options.skip_parts or args.assembly == EACH,
            hardware=not args.no_hardware,
            recursive=options.recursive,
            skip_parts=options.skip_parts,
            progress=count_steps(len(tops)),
        )
        summary.parts, summary.files, summary.fine = plan.parts, plan.parts, plan.parts
        reading.index.save()
        summary.seconds["reading"] = time.monotonic() - begin
        if not plan.uuids and plan.nodes:
            reach(client)
        begin = time.monotonic()
        set_step("asking the server")
        progress = count_steps(len({node.top for node in plan.nodes.values()}))
        for result in SyncJob(plan, reading, client, options, summary.base, stop).results():
            progress(result.top)
            yield result
        summary.seconds["server"] = time.monotonic() - begin
        summary.add_findings(plan.shared)
        summary.notes += filter(None, [reading.index.trouble])
        if summary.base:
            summary.moved += moved(reading.index.places(summary.base), plan.places, summary.base)
            summary.before = reading.index.told(summary.base)
            if not options.dry_run:  # a look takes no news from the report of the night
                reading.index.keep_places(summary.base, plan.places)
                if not summary.unsent:  # else the findings are not known, and all would be new the next time
                    reading.index.keep_told(summary.base, summary.told())
            reading.index.forget(summary.base, {os.path.realpath(top) for top in tops})


class _Shown:
    """What standard output gets: JSON as the run goes, or what changed, and errors last."""

    def __init__(self, args: argparse.Namespace, *, many: bool) -> None:
        from silo.batch import Json

        self._json, self._many, self._count = Json() if args.json else None, many, 0
        if self._json is not None:
            print(self._json.head(None), end="")

    def add(self, result: TopResult) -> None:
        if self._json is not None:
            print(self._json.one(result, self._count), end="")
            self._count += 1
        else:
            _show(result, whole=not self._many)

    def close(self, summary: RunSummary | None) -> None:
        if self._json is not None:
            print(self._json.end(summary), end="")
        elif summary is not None and self._many:
            _show_summary(summary)


def _show(result: TopResult, *, whole: bool) -> None:
    """Show a result. ``whole``: everything about the one file; otherwise only what changed, since the summary
    has the rest.
    """
    from silo.batch import is_news
    from silo.bom_sync import Status
    from silo.cli.show import console, diff_table, findings_text, outcome_text, plain

    out = console()
    if result.error is not None:
        words = str(result.error)
        where = "" if os.path.basename(result.top) in words else f"{result.top}: "
        out.print(f"✗ {plain(where + words)}", style="red", markup=False)
        return
    for outcome in result.outcomes:
        if not whole and not is_news(outcome):
            continue
        out.print(outcome_text(outcome, result.base))
        if outcome.plan is not None and outcome.status in (Status.MERGED, Status.DRY_RUN):
            out.print(diff_table(outcome.plan.diff, outcome.names))
    if whole and result.findings:
        out.print(findings_text(result.findings, result.base))


def _show_summary(summary: RunSummary) -> None:
    from silo.cli.show import console, plain

    out = console()
    out.print(f"\n{plain(summary.sentence())}", markup=False)
    for title, lines in summary.sections():
        if lines:
            out.print(f"\n{title}", style=_STYLES.get(title, ""))
        for line, more in lines:
            out.print(f"  {plain(line)}", markup=False)
            for text in more:
                out.print(f"    {plain(text)}", markup=False)


_STYLES = {"New since the last run": "bold", "Moved": "cyan", "Warnings": "yellow", "Errors": "bold red"}


def moved(before: dict[str, set[str]], now: set[tuple[str, str]], base: str) -> list[tuple[str, str, str]]:
    """Find the files that took over the identity of a file that is gone, or that has another item now: (name,
    before, now).
    """
    from silo.bom.document import relative

    here: dict[str, set[str]] = {}
    for uuid, path in now:
        here.setdefault(uuid, set()).add(path)
    taken = {path for _, path in now}
    result = []
    for uuid, paths in sorted(before.items()):
        left = paths - here.get(uuid, set())
        gone = {path for path in left if path in taken or not os.path.lexists(path)}
        new = here.get(uuid, set()) - paths
        if len(gone) == len(new) == 1:
            (old_path,), (new_path,) = gone, new
            name = os.path.splitext(os.path.basename(new_path))[0]
            result.append((name, relative(old_path, base), relative(new_path, base)))
    return result


def _revision(text: str) -> int | str:
    from silo.api.wire import RELEASE_LABEL

    if re.fullmatch(RELEASE_LABEL, text, re.ASCII):
        return text
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text[:50]!r} is neither a number above 0 nor a label such as B")
    return above_zero(text)


def add_pull(parser: argparse.ArgumentParser) -> None:
    add_each(parser, "part_number", "--revision", metavar="PART_NUMBER", help="the item")
    parser.add_argument(
        "--revision",
        metavar="REVISION",
        type=_revision,
        help="the number of a revision of the file, with the linked files as they were then; or the label of "
        "a released revision, such as B, with all files as they were frozen; else the newest of all",
    )
    add_options(
        parser, {"--replace": "replace files with edits that are not in Silo; a copy of each is kept"}
    )


def add_log(parser: argparse.ArgumentParser) -> None:
    add_each(
        parser,
        "file",
        metavar="FILE",
        help="a FreeCAD file that is registered; with --since a part number as well",
    )
    points = {
        "--since POINT": "what changed in the product on all levels since then: a day such as 2026-02-08, "
        "a revision of the item such as r3, or a frozen revision such as A",
        "--until POINT": "up to then (now)",
    }
    add_options(parser, points)
    only_with(parser, "--since", "--until")
    add_options(parser, {"--changes": "what each revision changed in the BOM"})


def add_queue(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "do",
        nargs="?",
        choices=("list", "retry", "discard", "save"),
        default="list",
        help="list them (default); retry: end the pauses and send all, with NUMBER also what is held; "
        "discard: forget commits, the documents stay; save: write the files of commits",
    )
    parser.add_argument(
        "numbers", metavar="NUMBER", nargs="*", type=above_zero, help="commits, as list shows them"
    )
    add_options(parser, {"--here": "retry: send them to the server in use instead"})


def run_queue(args: argparse.Namespace) -> int:
    """Show the queue, after doing what ``args.do`` says. Returns 1 if something waits or is held; 2 or 3 if
    the server stops a retry.
    """
    from silo.api.address import canonical
    from silo.api.config import resolve_server
    from silo.outbox.store import Store

    store, here = Store(), ""
    with suppress(ConfigError):
        here = canonical(resolve_server(args.server, args.token).url)
    if args.do in ("discard", "save") and not args.numbers:
        raise InputError(f"queue {args.do}: which commit? Give the number that `silo-mod queue` shows")
    stopped = _retry(args, store, here) if args.do == "retry" else None
    for number in args.numbers:
        entry = next((pending for pending in store.entries() if pending.id == number), None)
        if entry is None:
            if args.do != "retry":
                raise InputError(f"there is no commit {number} in the queue; `silo-mod queue` lists them")
        elif args.do == "discard":
            store.discard(number, keep=True)
        elif args.do == "save":
            Path(args.into).mkdir(parents=True, exist_ok=True)
            target = Path(args.into) / f"{number}-{entry.file_name}"
            store.save_copy(number, target)
            print(f"{target} is written", file=sys.stderr)
    left = store.entries()
    pause = store.pause(here) if here else None
    if pause is not None and not pause.left(store.clock()):
        pause = None
    if store.closed:
        print(f"silo-mod: {store.closed}", file=sys.stderr)
    _show_queue(args, left, here, pause, store.clock())
    if stopped is not None:
        return exit_of(stopped)
    return Exit.UNDONE if left else Exit.DONE


def _retry(args: argparse.Namespace, store: Store, here: str) -> SiloError | None:
    """Send what waits; returns the error that stopped it, or None."""
    from silo.outbox.send import send_all

    for number in args.numbers:
        store.retry(number, here if args.here else None)
    with client_of(args) as client:
        report = send_all(store, client, force=True, on_progress=set_sending_step)
    for sent in report.sent:
        print(f"{sent.part_number} {sent.entry.label or sent.entry.file_name} is in Silo", file=sys.stderr)
    if report.busy:
        print("silo-mod: another program sends just now", file=sys.stderr)
    return report.stopped_by


def _show_queue(
    args: argparse.Namespace, left: Sequence[Entry], here: str, pause: Pause | None, now: float
) -> None:
    from rich.text import Text

    from silo.cli.show import console, plain, table_of
    from silo.outbox.entry import parts, pause_text, words

    queue_rows = [(pending, words(pending, here, is_paused=pause is not None)) for pending in left]
    notice = pause_text(pause, here, now) if pause is not None else ""
    if args.json:
        rows = [
            {
                "number": pending.id,
                "part_number": pending.part_number,
                "label": pending.label,
                "path": pending.path,
                "what": parts(pending),
                "state": said.state,
                "reason": said.reason,
                "since": pending.taken_at,
                "server": pending.server,
                "needs_a_person": said.urgent,
            }
            for pending, said in queue_rows
        ]
        print_json({"pause": notice or None, "commits": rows})
        return
    out = console()
    if notice:
        out.print(plain(notice), style="yellow", markup=False)
    if not left:
        out.print("Nothing waits: every commit of this computer is in Silo.", markup=False)
        return
    table = table_of("", "Commit", "What", "Since", "State", "Why")
    for entry, said in queue_rows:
        name = " ".join(filter(None, (entry.part_number, entry.label or entry.file_name)))
        since = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.taken_at))
        cells = (str(entry.id), plain(name), parts(entry), since, said.state, plain(said.reason))
        table.add_row(*map(Text, map(spoken, cells)), style="bold" if said.urgent else "")
    out.print(table)


def run_pull(args: argparse.Namespace) -> int:
    """Fetch an item's files into a folder. Returns 1 if a file was left alone, or is not in Silo."""
    from silo.freecads import open_in_any
    from silo.outbox.store import Store
    from silo.vault.pull import Rules, fetched, place, pulled_json

    store, into = Store(), Path(args.into)
    opened = open_in_any()
    with client_of(args) as client:
        rules = Rules(
            overwrite=args.replace,
            keep=store.keep_aside,
            is_open=lambda path: not args.even_if_open and opened.has_file(path),
            learn=lambda sha256, item, number: store.learn(client.base_url, sha256, item, number),
        )
        number = named_item(client, args.part_number).part_number
        progress = lambda name, count: set_step(f"fetching {name}, {counted(count, 'file')} so far")  # noqa: E731
        with fetched(client, number, args.revision, progress=progress) as tree:
            into.mkdir(parents=True, exist_ok=True)
            pulled = place(tree, into, rules)
    if args.json:
        print_json(pulled_json(pulled, Path(os.path.realpath(into))))
    else:
        _show_pulled(pulled, into)
    return Exit.DONE if pulled.complete else Exit.UNDONE


_MARKS = {
    "new": ("+", "green", ""),
    "same": ("=", "dim", "up to date"),
    "updated": ("~", "yellow", "updated"),
    "edited": ("✗", "red", "has edits that are not in Silo; left alone (--replace replaces it)"),
    "overwritten": ("~", "yellow", f"replaced; your file is kept for {KEPT_ASIDE_DAYS} days at"),
    "open": ("✗", "red", "is open in FreeCAD; left alone (close it, or --even-if-open)"),
}


def _show_pulled(pulled: Pulled, into: Path) -> None:
    from rich.text import Text

    from silo.cli.show import console, plain

    out = console()
    for file in pulled.files:
        mark, style, words = _MARKS[file.state.value]
        text = Text(f"{mark} ", style).append(plain(os.path.relpath(file.path, os.path.realpath(into))))
        text.append(spoken(f"  {file.part_number}, revision {file.revision}"), "dim")
        if words:
            text.append(f"  {spoken(words)}{f' {file.kept}' if file.kept else ''}", style)
        out.print(text)
    for lost in pulled.lost:
        line = f"{lost.position}: {lost.path} was not fetched: {lost.reason}"
        out.print(Text("✗ ", "bold red").append(plain(spoken(line)), ""))
    out.print(Text(plain(spoken(f"Open {pulled.top}")), "bold"))


def run_log(args: argparse.Namespace) -> int:
    """Print the revisions, newest first; or what changed in the product."""
    from silo.files import sha256_of
    from silo.outbox.store import Store
    from silo.vault.pull import RevisionBoms, file_revisions, words

    path = os.path.realpath(args.file)
    if args.since:
        with client_of(args) as client:
            number = args.file
            if os.path.isfile(path):
                number = _item_of(client, args.file, _identity(args.file, path)).part_number
            _show_changes(args, client.get_changes(number, args.since, args.until or ""))
        return Exit.DONE
    if not os.path.isfile(path):
        raise InputError(f"{args.file} is not a file. Give the path of an FCStd file.")
    identity = _identity(args.file, path)
    with client_of(args) as client:
        item = _item_of(client, args.file, identity)
        revisions = client.revisions(item.part_number)
        shown = revisions[: args.limit]
        here = _revision_on_disk(Store(), sha256_of(path), identity, client.base_url, revisions)
        changes: dict[int, str] = {}
        if args.changes:
            files = file_revisions(revisions)
            with RevisionBoms(client, item.part_number, path) as boms:
                for number, revision in enumerate(files):
                    set_step(f"revision {revision.revision_number}")
                    if revision.revision_number < shown[-1].revision_number:
                        break
                    older = files[number + 1].revision_number if number + 1 < len(files) else None
                    try:
                        changes[revision.revision_number] = words(
                            boms.change(older, revision.revision_number)
                        )
                    except SiloError as error:
                        changes[revision.revision_number] = f"cannot be read: {error}"
    if args.json:
        print_json(_log_json(item.part_number, shown, here, changes, args.changes))
    else:
        _show_log(item.part_number, item.name, shown, here, changes, len(revisions))
    return Exit.DONE


def _identity(name: str, path: str) -> str:
    from silo.fcstd import Library
    from silo.fcstd.linked import identity_in

    with Library() as library:
        library.open(path)
        identity = identity_in(library, path)
    if not identity:
        raise InputError(f"{name} belongs to no single item in Silo; register it (silo-mod register)")
    return identity


def _item_of(client: SiloClient, name: str, identity: str) -> Item:
    item = client.get_item_by_uuid(identity)
    if item is None:
        raise InputError(f"{name}: this server has no item {identity}; is it the right server?")
    return item


def _show_changes(args: argparse.Namespace, changes: ProductChanges) -> None:
    if args.json:
        print_json(changes.model_dump(mode="json"))
        return
    from rich.text import Text

    from silo.cli.show import console, plain, table_of

    out = console()
    first, last = (when.strftime("%Y-%m-%d %H:%M") if when else "" for when in (changes.since, changes.to))
    head = f"{changes.part_number}: what changed from {first} to {last} (UTC)"
    if not changes.changes:
        out.print(f"{plain(head)}: nothing on any level", markup=False)
        return
    out.print(Text(plain(spoken(head)), "bold"))
    table = table_of("", "Part number", "Name", "In", "Before", "After", "By")
    styles = {"added": "green", "removed": "red"}
    for change in changes.changes:
        when = f", {change.at:%Y-%m-%d %H:%M}" if change.at else ""
        cells = (
            change.part_number,
            change.name,
            change.within,
            change.before,
            change.after,
            change.username + when,
        )
        what = Text(spoken(change.what), styles.get(change.what, "yellow"))
        table.add_row(what, *(Text(plain(cell)) for cell in cells))
    out.print(table)


def _revision_on_disk(
    store: Store, sha256: str, identity: str, server: str, revisions: list[Revision]
) -> tuple[int | None, bool]:
    """Return the revision that the file is or was made from, and if it has edits since."""
    from silo.api.revisions import standing

    for content, edited in ((sha256, False), (store.origin_of(sha256), True)):
        number = store.known_revision(server, content, identity)
        if (base := standing(revisions, content, number).base) is not None:
            return base.revision_number, edited
    return None, True


def _log_json(
    number: str,
    shown: list[Revision],
    here: tuple[int | None, bool],
    changes: dict[int, str],
    with_bom: bool,
) -> dict[str, Any]:
    keys = {
        "revision_number",
        "comment",
        "created_by",
        "created_at",
        "file_name",
        "file_size",
        "base_revision",
    }
    rows = []
    for revision in shown:
        row = revision.model_dump(mode="json", include=keys)
        rows.append({**row, "bom": changes.get(revision.revision_number)} if with_bom else row)
    return {"part_number": number, "file_is": here[0], "edited": here[1], "revisions": rows}


def _show_log(
    number: str,
    name: str,
    shown: list[Revision],
    here: tuple[int | None, bool],
    changes: dict[int, str],
    total: int,
) -> None:
    from rich.text import Text

    from silo.cli.show import console, plain

    out = console()
    out.print(Text(plain(f"{number}  {name}"), "bold"))
    if here[0] is None:
        out.print("This file is no revision in Silo, and it is not known which one it was made from.")
    for revision in shown:
        stamp = revision.created_at.astimezone().strftime("%Y-%m-%d %H:%M") if revision.created_at else ""
        text = Text(f"{revision.revision_number:>4}  ", "cyan")
        text.append(f"{stamp}  {plain(revision.created_by or '')}  ", "dim")
        text.append(plain(revision.comment) or spoken("(no comment)"))
        if not (revision.file_name or revision.file_checksum):
            text.append(spoken("  properties only"), "dim")
        if revision.revision_number == here[0]:
            text.append(spoken("  ← this file, edited since" if here[1] else "  ← this file"), "green")
        out.print(text)
        if said := changes.get(revision.revision_number):
            out.print(Text(f"      {plain(spoken(said))}", "yellow"))
    if total > len(shown):
        out.print(Text(spoken(f"… and {total - len(shown)} older; --limit shows more"), "dim"))
