# SPDX-License-Identifier: LGPL-2.1-or-later
"""``silo-mod demo``: the main job, start to end, on a real assembly and a server of its own.

Everything happens in a temporary folder: the example's files are copied, the server's database is new, and
nothing of the user's is touched. ``--keep`` leaves the server running to look at the pages.
"""

from __future__ import annotations

import argparse
import os
import queue
import secrets
import shutil
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from silo import spoken
from silo.batch import source_document
from silo.bom.consolidation import consolidation_findings
from silo.bom.entry import Extraction
from silo.bom.errors import Exit, InputError, ServerFaultError
from silo.bom.items.part_address import part_page
from silo.bom.message import message
from silo.bom.view.folders import base_folder
from silo.bom_sync.activity_text import activity_text
from silo.bom_sync.resolved import resolve
from silo.bom_sync.steps import Outcome, Status, sync_tree
from silo.cli.bom_display import bom_tree, diff_table, findings_text
from silo.cli.options import add_options
from silo.cli.reading import read_assembly
from silo.cli.setup.demo_edits import remove_from_assembly, set_element_count
from silo.cli.setup.server import need_server_extra
from silo.cli.sync_display import activity_box, outcome_text
from silo.cli.terminal import console
from silo.platform.whole_files import scratch_folder
from silo.registering.closed_files import proposals_for, register_all
from silo.shipped_files import shipped

if TYPE_CHECKING:
    from rich.console import Console

    from silo.api.client import SiloClient
    from silo.api.wire import MergeEvent


EXAMPLE = shipped() / "examples" / "gearbox"

TOP = "TopAssembly.FCStd"

# Left without a number on purpose, to show what becomes of such parts.
UNREGISTERED = "MotorMount"

EVENT_SECONDS = 20.0


def add_demo(parser: argparse.ArgumentParser) -> None:
    """Add the command."""
    add_options(parser, {"--keep": message("leave the server running until Ctrl-C")})
    parser.add_argument("--port", type=int, default=0, help="port of the server (default: a free one)")
    parser.set_defaults(waits=True)


def run_demo(args: argparse.Namespace) -> int:
    """Run the demo."""
    need_server_extra()
    if not (EXAMPLE / TOP).is_file():
        raise InputError(message("the example {top} is not there; install silo-mod again", top=EXAMPLE / TOP))
    with ExitStack() as stack:
        folder = Path(stack.enter_context(scratch_folder("silo-demo-")))
        stack.enter_context(_private_data(folder / "data"))
        demo = stack.enter_context(_demo(folder, args.port))
        demo.play()
        if args.keep:
            demo.stay()
    return Exit.DONE


@contextmanager
def _private_data(folder: Path) -> Iterator[None]:
    """Keep the demo's registrations out of the user's journal."""
    before = os.environ.get("SILO_HOME")
    os.environ["SILO_HOME"] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ["SILO_HOME"]
        else:
            os.environ["SILO_HOME"] = before


@contextmanager
def _demo(folder: Path, port: int) -> Iterator[Demo]:
    from silo.api.client import SiloClient
    from silo_server.run import running_server

    model = folder / "gearbox"
    shutil.copytree(EXAMPLE, model, ignore=shutil.ignore_patterns("*.py", "__pycache__", "*.md"))
    token = "silo_" + secrets.token_hex(20)
    database = f"sqlite:///{folder / 'silo.db'}"
    with (
        running_server(database, token=token, port=port) as server,
        SiloClient(server.base_url, server.token) as client,
        _merge_events(client) as events,
    ):
        yield Demo(model / TOP, client, events, console(), getattr(server, "login_url", ""))


@contextmanager
def _merge_events(client: SiloClient) -> Iterator[queue.Queue[MergeEvent]]:
    """Yield a queue that receives the merges that the server announces."""
    from silo.api.events import EventListener

    merges: queue.Queue[MergeEvent] = queue.Queue()
    listener = EventListener(client, on_event=lambda event: merges.put(event.merge) if event.merge else None)
    listener.start()
    try:
        yield merges
    finally:
        listener.stop()


class Demo:
    """The story, step by step."""

    def __init__(
        self, top: Path, client: SiloClient, events: queue.Queue[MergeEvent], out: Console, login_url: str
    ) -> None:
        self.top, self.client, self.events, self.out, self.login_url = top, client, events, out, login_url
        self.step = 0
        self.page = client.base_url

    def say(self, text: str) -> None:
        self.step += 1
        self.out.print()
        self.out.rule(message("[bold]{step}  {text}", step=self.step, text=spoken(text)), align="left")

    def play(self) -> None:
        """Play all steps."""
        self.out.print(
            message(
                "Silo server on {base_url}, database in a temporary folder.", base_url=self.client.base_url
            )
        )
        extraction = self._read(message("Read the assembly from its files"))
        self._register(extraction)
        self._sync(message("First sync: sub-assemblies before their parents"))
        self._sync(message("Second sync: nothing changed, nothing is sent"))
        self._edit()
        self._sync(message("Third sync"))
        self._finish()

    def _read(self, title: str) -> Extraction:
        self.say(title)
        extraction = read_assembly(str(self.top))
        self.out.print(bom_tree(extraction))
        findings = (*extraction.findings, *consolidation_findings(extraction.entries))
        self.out.print(findings_text(findings, base_folder(extraction)))
        return extraction

    def _register(self, extraction: Extraction) -> None:
        self.say(message("Register the components; one is left without a number"))
        proposals = [
            p
            for p in proposals_for(extraction, self.client, "kindred-rd")
            if UNREGISTERED not in Path(p.entry.doc_path).name
        ]
        for done in register_all(proposals, self.client, schema="kindred-rd"):
            if done.error is not None:
                raise done.error
            self.out.print(
                message("✓ {part_number}  {name}", part_number=done.part_number, name=done.proposal.name),
                markup=False,
            )

    def _sync(self, title: str) -> list[Outcome]:
        self.say(title)
        whole = resolve(read_assembly(str(self.top)), self.client)
        outcomes = list(
            sync_tree(whole, self.client, sync_id=lambda: str(uuid.uuid4()), describe=source_document)
        )
        for outcome in outcomes:
            self.out.print(outcome_text(outcome, os.path.dirname(outcome.assembly.doc_path)))
            if outcome.error is not None:
                raise outcome.error
            if outcome.status is Status.MERGED and outcome.plan is not None:
                self.out.print(diff_table(outcome.plan.diff, outcome.names))
        self._activity(outcomes, unregistered=len(whole.unresolved))
        return outcomes

    def _activity(self, outcomes: list[Outcome], unregistered: int) -> None:
        """Print the boxes of the Activity pane, from the events that the server sent."""
        for outcome in outcomes:
            if outcome.status is not Status.MERGED:
                continue
            try:
                event = self.events.get(timeout=EVENT_SECONDS)
            except queue.Empty:
                raise ServerFaultError(
                    message(
                        "the server merged {part_number}, but its event did not arrive within "
                        "{event_seconds} s",
                        part_number=outcome.assembly.part_number,
                        event_seconds=f"{EVENT_SECONDS:g}",
                    )
                ) from None
            is_top = outcome is outcomes[-1]
            box = activity_text(
                event.item,
                event,
                resolve_url=self.client.web_url(event.resolve_url),
                unregistered=unregistered if is_top else 0,
            )
            self.out.print(activity_box(box))

    def _edit(self) -> None:
        self.say(message("Edit: the cover goes, four more bolts come, a user adds glue in Silo"))
        remove_from_assembly(self.top, "Cover")
        before, after = set_element_count(self.top, "CoverBolts", added=4)
        number = resolve(read_assembly(str(self.top)), self.client).assembly.part_number or ""
        glue = self.client.create_item("kindred-rd", "C01", message("Thread locker"), item_type="consumable")
        self.client.add_bom_line(number, glue.part_number, quantity=1)
        self.out.print(message("- Cover removed from the assembly"))
        self.out.print(
            message("~ cover bolts, a link array: {before} → {after} elements", before=before, after=after)
        )
        self.out.print(
            message(
                "✎ {part_number} Thread locker added to {number} by hand, on the server",
                part_number=glue.part_number,
                number=number,
            )
        )

    def _finish(self) -> None:
        number = resolve(read_assembly(str(self.top)), self.client).assembly.part_number or ""
        self.page = self.client.web_url(part_page(number, "bom"))
        self.out.print()
        self.out.print(message("The page where a reviewer decides: {page}", page=self.page), markup=False)

    def stay(self) -> None:
        """Leave the server running, so that people can look at it."""
        if self.login_url:
            path = self.page.removeprefix(self.client.base_url)
            self.out.print(
                message(
                    "Look at it logged in: {login_url}?next={path}",
                    login_url=self.login_url,
                    path=quote(path),
                ),
                markup=False,
            )
        self.out.print(message("The server runs until Ctrl-C; its data is then removed."))
        try:
            while True:
                self.events.get()
        except KeyboardInterrupt:
            self.out.print("\nStopped.")
