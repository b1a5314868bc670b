# SPDX-License-Identifier: LGPL-2.1-or-later
"""The questions of ``silo-mod register`` on a terminal, one component at a time.

An answer is taken for what it says and nothing else: what is not understood is asked again, and never becomes
a name or a category. Nothing is registered before the last question, so Ctrl-C leaves everything as it was.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from silo.bom.errors import InputError, SiloError
from silo.bom.message import message
from silo.bom.walk.document import relative
from silo.cli.progress import set_step
from silo.cli.terminal import plain
from silo.registering.candidate import Candidate, CandidateFiles, ComponentState
from silo.registering.offer import Offer
from silo.registering.request import ITEM_TYPES, RegistrationRequest, find_item, wrong_name
from silo.registering.table import doubts, remarks

_HELP = message(
    "  y, yes        register it as shown; Enter alone does the same where there is "
    "no doubt\n  n, no         leave it out; it stays without a number\n  name "
    "TEXT     give it another name\n  type TYPE     part, assembly, consumable or "
    "tool\n  cat CODE      another category; cat alone lists them all, cat WORD those "
    "with the word\n  join NUMBER   it is this item of Silo already: take its number, "
    "make no new one\n  all           register this one and the others, and ask only "
    "where there is a doubt\n  q, quit       ask no more: what you said yes to is "
    "registered, the rest is left out\n  ?             this list\nNothing is "
    "registered before the last question. Ctrl-C leaves everything as it was."
)


def read_line(prompt: str) -> str | None:
    """Ask a user for a line; None at the end of the input. Asks on stderr, since standard output may be
    JSON.
    """
    set_step("")
    print(prompt, end="", file=sys.stderr, flush=True)
    try:
        return input()
    except EOFError:
        return None


class Dialog:
    """Asks about candidates; :meth:`ask` gives the requests, and what stays without a number.

    own
        True where the look-alike on the server is the component's own item.
    """

    def __init__(
        self,
        candidates: Sequence[Candidate],
        found: Offer,
        api: Any,
        base: str,
        own: Callable[[Candidate], bool],
        read: Callable[[str], str | None] = read_line,
    ) -> None:
        self._candidates, self._found, self._api, self._base = candidates, found, api, base
        self._own, self._read = own, read
        self._all = self._quit = False
        self._earlier = CandidateFiles()

    def ask(self) -> tuple[list[RegistrationRequest], list[Candidate]]:
        """Ask about each component. Returns the requests, and the components that stay without a number."""
        requests: list[RegistrationRequest] = []
        left: list[Candidate] = []
        for number, candidate in enumerate(self._candidates):
            fine = candidate.state.usable and candidate.state is not ComponentState.ELSEWHERE
            # A file that cannot be written is not asked about; carrying it out reports the reason.
            request = (
                None
                if self._quit
                else self._request_for(candidate, number)
                if fine
                else RegistrationRequest.of(candidate)
            )
            if request is not None:
                requests.append(request)
            elif not candidate.same_as:
                left.append(candidate)
        return requests, left

    def _request_for(self, candidate: Candidate, number: int) -> RegistrationRequest | None:
        self._earlier.add(candidate)
        doubtful = bool(doubts(candidate, self._earlier)) and not self._own(candidate)
        request = RegistrationRequest.of(candidate)
        if self._all and not doubtful:
            return request
        entry = candidate.entry
        where = entry.standard or f"{relative(entry.doc_path, self._base)}#{entry.object_name}"
        _say(f"\n[{number + 1}/{len(self._candidates)}] {where}")
        for remark in remarks(candidate, self._earlier):
            _say(message("  ⚠ {remark}", remark=remark))
        yes = "y" if doubtful else "Y"
        while True:
            _say(message("  {request}", request=self._described(request)))
            answer = self._read(message("  register it? [{yes}/n/name/type/cat/join/all/q/?] ", yes=yes))
            word, _, rest = ("q" if answer is None else answer.strip()).partition(" ")
            match word.lower(), rest.strip():
                case (("q" | "quit"), ""):
                    self._quit = True
                    return None
                case (("n" | "no"), ""):
                    return None
                case (("y" | "yes"), ""):
                    return request
                case ("" | "all") as said, "":
                    self._all = self._all or bool(said)
                    if not doubtful:
                        return request
                    _say(message("  There is a doubt (⚠): please answer y or n, or join NUMBER."))
                case (("?" | "h" | "help"), _):
                    _say(_HELP)
                case ("name" | "type" | "cat" | "join") as what, text:
                    request = self._changed(request, what, text)
                case _:
                    _say(
                        message("  {answer} is no answer; ? lists what can be answered.", answer=repr(answer))
                    )

    def _described(self, request: RegistrationRequest) -> str:
        if request.existing is not None:
            return message(
                "join {part_number} {name}",
                part_number=request.existing.part_number,
                name=repr(request.existing.name),
            )
        meaning = self._found.categories.get(request.category, "")
        return message(
            "{item_type} {name}, category {category} ({meaning})",
            item_type=request.item_type,
            name=repr(request.name),
            category=request.category,
            meaning=meaning,
        )

    def _changed(self, request: RegistrationRequest, what: str, text: str) -> RegistrationRequest:
        """Return the request with the change; if it is not possible, explain that and return the request
        unchanged.
        """
        if what == "name":
            if problem := wrong_name(text, request.candidate):
                _say(message("  {problem}", problem=problem))
                return request
            return replace(request, name=text)
        if what == "type":
            if text.lower() in ITEM_TYPES:
                return request.retyped(text.lower(), self._found.categories)
            _say(message("  type: one of {item_types}", item_types=", ".join(ITEM_TYPES)))
            return request
        if what == "cat":
            return self._category(request, text)
        try:
            return replace(request, existing=find_item(text, request.candidate, self._api) if text else None)
        except InputError as problem:
            _say(message("  {problem}", problem=problem))
        except SiloError as error:
            _say(message("  Silo cannot say: {error}", error=error))
        return request

    def _category(self, request: RegistrationRequest, text: str) -> RegistrationRequest:
        categories = self._found.categories
        if text.upper() in categories:
            return replace(request, category=text.upper())
        if text in categories:
            return replace(request, category=text)
        codes = [
            code for code, words in categories.items() if text.casefold() in f"{code} {words}".casefold()
        ]
        if not codes:
            _say(message("  There is no category {text}; cat alone lists them all.", text=repr(text)))
        for code in codes:
            _say(f"    {code}  {categories[code]}")
        return request


def _say(text: str) -> None:
    for line in text.split("\n"):
        print(plain(line), file=sys.stderr)
