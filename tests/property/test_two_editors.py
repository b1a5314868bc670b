# SPDX-License-Identifier: LGPL-2.1-or-later
"""Two people with forms open, syncs and undos in between, against a model of what each of them wanted.

The model knows per field what a person typed and saw. The law: a value on the server is replaced only by a
sync (quantities of CAD's lines), by the person who typed another one over the value that stood on the form,
by a choice between mine and theirs, or by an undo of the change that brought it. Nothing typed is lost: a
form that is refused comes back with every text that the person changed, and for the rest with the line as it
is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from html.parser import HTMLParser
from random import Random
from urllib.parse import urlencode

import pytest
from hunting import LONG, kinds
from server_testing import Answer, Api, Databases, bom
from web_visitor import FORM, HTML, Visitor, enter

from silo_server.run import running_server

FIELDS = ("quantity", "unit", "notes", "find_number")
GROUPS = (("quantity", "unit"), ("notes",), ("find_number",))
UNUSABLE = ["many", "1,000"]
TEXTS = {
    "quantity": ["1", "2", "3", "5", "8", *UNUSABLE],
    "unit": ["", "m", "kg"],
    "notes": ["", "glue", "two\nlines", "<b>\u202e"],
    "find_number": ["", "10", "20"],
}
STEPS = 90


class FormReader(HTMLParser):
    """The fields of the form with the id ``edit``, as a browser would send them."""

    def __init__(self) -> None:
        super().__init__()
        self.fields: dict[str, str] = {}
        self.radios: set[str] = set()
        self._inside = False
        self._area = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """An input, or the start of a text box."""
        values = {name: value or "" for name, value in attrs}
        self._inside = self._inside or (tag == "form" and values.get("id") == "edit")
        if not self._inside:
            return
        if tag == "input" and values.get("type") == "radio":
            self.radios.add(values["name"])
        elif tag == "input":
            self.fields[values["name"]] = values.get("value", "")
        elif tag == "textarea":
            self._area = values["name"]
            self.fields[self._area] = ""

    def handle_data(self, data: str) -> None:
        """The text of a text box."""
        if self._area:
            self.fields[self._area] += data

    def handle_endtag(self, tag: str) -> None:
        """The end of a text box, whose first line break is no part of it, or of the form."""
        if tag == "textarea" and self._area:
            self.fields[self._area] = self.fields[self._area].removeprefix("\n")
            self._area = ""
        self._inside = self._inside and tag != "form"


def form_of(answer: Answer) -> FormReader:
    """The open form of a line; without fields where none is open."""
    reader = FormReader()
    reader.feed(answer.body.decode())
    return reader


class Editor:
    """Somebody who opens the form of a line, types, waits, and sends it."""

    def __init__(self, name: str, visitor: Visitor, parent: str) -> None:
        self.name, self.visitor, self.path = name, visitor, f"/items/{parent}/bom"
        self.open: dict[str, str] = {}
        self.radios: set[str] = set()
        self.line_id = ""

    def begin(self, line_id: str) -> None:
        """Open the form of a line."""
        self.line_id = line_id
        self._take(self.visitor.get(f"{self.path}?edit={line_id}"))

    def type(self, random: Random) -> None:
        """Type into one field or two."""
        for name in random.sample(FIELDS, random.randint(1, 2)):
            self.open[name] = random.choice(TEXTS[name])

    def send(self, random: Random) -> Answer:
        """Send the form, with a choice where one is asked for."""
        picks = {name: random.choice(["mine", "theirs"]) for name in self.radios}
        sent = {**self.open, **picks, "csrf_token": self.visitor.csrf}
        headers = {"Cookie": self.visitor.cookie, **HTML, **FORM}
        path = f"{self.path}/lines/{self.line_id}"
        self.picked = picks
        return self.visitor.api.call("POST", path, body=urlencode(sent).encode(), headers=headers)

    def refused(self, answer: Answer, now: dict[str, str]) -> None:
        """The form that came back has every text that was typed, and else the line as it is ``now``.

        An old text of a field that nobody typed into would revert a colleague's with the next save.
        """
        wanted = dict(now)
        for group in GROUPS:
            if any(self.open[name] != self.open[f"was_{name}"] for name in group):
                wanted |= {name: self.open[name] for name in group}
        self._take(answer)
        assert {name: self.open[name] for name in FIELDS} == wanted

    def _take(self, answer: Answer) -> None:
        reader = form_of(answer)
        self.open, self.radios = reader.fields, reader.radios


def shown(line: dict[str, object]) -> dict[str, str]:
    """A line of the API as the form shows it."""
    return {name: "" if line[name] is None else str(line[name]) for name in FIELDS}


@pytest.fixture(scope="module", params=kinds("sqlite"))
def api(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    """A server with two editors."""
    folder = tmp_path_factory.mktemp("editors")
    databases = Databases(folder)
    url = databases.new(str(request.param))
    with (
        running_server(url, token="silo_two", files_dir=folder / "files") as server,
        Api(server.base_url, "silo_two") as caller,
    ):
        yield caller
    databases.close()


@pytest.mark.parametrize("api", kinds("sqlite", "postgres"), indirect=True, scope="module")
def test_nothing_is_lost_or_reverted_without_a_choice(api: Api) -> None:
    """Random interleavings of two forms, syncs and undos on two lines."""
    for seed in (1, 2) if LONG else (1,):
        play(api, Random(seed), STEPS)


def test_a_form_that_was_refused_reverts_nobody(api: Api) -> None:
    """A colleague's note, while a quantity is refused, asked about, or clashes, survives the next save."""
    api.call("POST", "/api/users", {"username": "ann", "role": "editor"})
    ann = enter(api, "ann")
    for typed in ("many", "1,000", "8"):
        parent, child = api.items(2)
        api.merge(parent, {child: 2})
        editor = Editor("ann", ann, parent)
        line_id = str(api.lines(parent)[child]["id"])
        editor.begin(line_id)
        clash = typed == "8"
        api.good("PUT", bom(parent, child), {"notes": "mine to keep", **({"quantity": 6} if clash else {})})
        editor.open |= {"quantity": typed, "why": "for this form alone"}
        answer = editor.send(Random(0))
        assert answer.status == (412 if clash else 400)
        # The reason belongs to this form, not to the one for a new line.
        assert answer.body.count(b"for this form alone") == 1
        editor.refused(answer, shown(api.lines(parent)[child]))
        editor.open["quantity"] = "9"
        editor.radios = set()
        editor.open |= {"pick_quantity": "mine"} if clash else {}
        assert editor.send(Random(0)).status == 303
        line = api.lines(parent)[child]
        assert (line["quantity"], line["notes"]) == (9, "mine to keep")


def play(api: Api, random: Random, steps: int) -> None:
    """One game; every save is compared with what the three texts of each field say it must do."""
    parent, *children = api.items(3)
    api.merge(parent, dict.fromkeys(children, 2))
    for name in ("ann", "bob"):
        api.call("POST", "/api/users", {"username": name, "role": "editor"})
    editors = [Editor(name, enter(api, name), parent) for name in ("ann", "bob")]
    saved = clashes = 0
    for _ in range(steps):
        editor = random.choice(editors)
        act = random.random()
        lines = {str(line["id"]): line for line in api.lines(parent).values()}
        if act < 0.12:
            api.merge(parent, {child: random.choice([1, 2, 3]) for child in children})
        elif act < 0.2:
            undo_newest(api, parent, random)
        elif not editor.open:
            editor.begin(random.choice(sorted(lines)))
        elif act < 0.55:
            editor.type(random)
        else:
            saved += save(api, editor, parent, lines, random)
            clashes += bool(editor.radios)
    assert saved
    assert clashes or steps < 100


def undo_newest(api: Api, parent: str, random: Random) -> None:
    """One of the newest changes is taken back, or refused."""
    changes = [c for c in api.get(f"/api/items/{parent}/bom/history?limit=3") if c["id"] > 1]
    if len(changes) > 1:
        change = random.choice(changes[:-1])
        api.call("POST", f"/api/items/{parent}/bom/undo", {"change_id": change["id"]})


def save(api: Api, editor: Editor, parent: str, before: dict[str, dict[str, object]], random: Random) -> bool:
    """Send a form and judge what became of the line. True where something was written."""
    form = dict(editor.open)
    answer = editor.send(random)
    after = {str(line["id"]): line for line in api.lines(parent).values()}
    others = {line_id: line for line_id, line in after.items() if line_id != editor.line_id}
    assert others == {line_id: line for line_id, line in before.items() if line_id != editor.line_id}
    if editor.line_id not in before:
        assert answer.status == 404
        assert after == before
        # The text stands in the form for a new line.
        assert escape(form["quantity"]) in answer.body.decode()
        editor.open = {}
        return False
    now, became = shown(before[editor.line_id]), shown(after[editor.line_id])
    wanted = dict(form)
    for group in GROUPS:
        if editor.picked.get(f"pick_{group[0]}") == "theirs":
            wanted |= {name: form[f"was_{name}"] for name in group}
    clash = False
    expected = dict(now)
    for group in GROUPS:
        mine = [name for name in group if wanted[name] != form[f"was_{name}"]]
        theirs = [name for name in group if now[name] != form[f"was_{name}"]]
        if mine and theirs and any(wanted[name] != now[name] for name in group):
            clash = True
        elif not theirs:
            expected |= {name: wanted[name] for name in mine}
    if clash:
        assert answer.status == 412, (form, now, answer.status)
        assert became == now
        editor.refused(answer, now)
        assert editor.radios
        return False
    if expected["quantity"] in UNUSABLE:
        assert answer.status == 400
        assert became == now
        editor.refused(answer, now)
        assert not editor.radios
        return False
    assert answer.status == 303, re.findall(r'role="alert".*', answer.body.decode())
    assert became == expected, (form, now)
    editor.open = {}
    return became != now
