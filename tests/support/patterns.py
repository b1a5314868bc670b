# SPDX-License-Identifier: LGPL-2.1-or-later
"""Finds the regular expressions of a source tree, and texts that would make each of them slow.

Run as a program it is the process that matches: it reads jobs of JSON lines and answers each with a line, so
that a matching that does not come to its end is noticed, and ended, by who waits for the answer.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from re import _constants as sre
from re import _parser as parser
from typing import Any

SEARCHING = {"search", "sub", "subn", "split", "findall", "finditer"}
METHODS = {"match", "fullmatch", *SEARCHING}
FLAGS = {name: value for name, value in vars(re).items() if isinstance(value, re.RegexFlag)}
# Behind a repeat: what keeps most patterns from matching, so that they try all ways.
ENDINGS = ("", "\0", "!\n")
# A repeat of one of these classes is tried with each of its members.
TRIED = "a A0 -.,:;/\\\"'([{<\n\t_é"


@dataclass(frozen=True)
class Found:
    """A regular expression, where it stands, and how it is applied."""

    place: str
    pattern: str | bytes
    flags: int
    method: str


def literal(node: ast.expr, known: dict[str, Any]) -> Any:
    """The value of an expression of literals and names; LookupError or ValueError for any other."""
    if isinstance(node, ast.Name):
        return known[node.id]
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(literal(part.value, known)) if isinstance(part, ast.FormattedValue) else literal(part, known)
            for part in node.values
        )
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return literal(node.left, known) + literal(node.right, known)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitOr):
        return literal(node.left, known) | literal(node.right, known)
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "re":
        return int(FLAGS[node.attr])
    return ast.literal_eval(node)


def patterns_of(folder: Path) -> tuple[list[Found], list[str]]:
    """All patterns below a folder; and the places of those that are made at run time, of other values."""
    trees = {path: ast.parse(path.read_text("utf-8")) for path in sorted(folder.rglob("*.py"))}
    constants: dict[str, dict[str, Any]] = {}
    for _pass in range(2):  # the second knows what the first found in other modules
        for path, tree in trees.items():
            constants[_module(path, folder)] = _constants(tree, constants)
    # A pattern may be applied in another module.
    anywhere: dict[str, set[str]] = {}
    for tree in trees.values():
        for name, methods in _used(tree).items():
            anywhere.setdefault(name, set()).update(methods)
    found: list[Found] = []
    made: list[str] = []
    for path, tree in trees.items():
        known, used = constants[_module(path, folder)], _used(tree)
        names = {
            id(node.value): node.targets[0].id
            for node in ast.walk(tree)
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        }
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            kind = node.func.attr
            if ast.unparse(node.func.value) != "re" or kind not in {*METHODS, "compile"}:
                continue
            try:
                pattern = literal(node.args[0], known)
                index = {"compile": 1, "sub": 4, "subn": 4, "split": 3}.get(kind, 2)
                given = next((word.value for word in node.keywords if word.arg == "flags"), None)
                given = node.args[index] if given is None and len(node.args) > index else given
                flags = int(literal(given, known)) if given is not None else 0
            except (LookupError, ValueError, TypeError):
                made.append(f"{path.relative_to(folder).as_posix()}: {ast.unparse(node.args[0])}")
                continue
            # A pattern without a name, or without a use, may be searched for anywhere.
            name = names.get(id(node), "")
            methods = used.get(name) or anywhere.get(name) or {"search"} if kind == "compile" else {kind}
            method = "search" if methods & SEARCHING else "match" if "match" in methods else "fullmatch"
            found.append(
                Found(f"{path.relative_to(folder).as_posix()}:{node.lineno}", pattern, flags, method)
            )
    return found, made


def _used(tree: ast.Module) -> dict[str, set[str]]:
    """Name → the methods that are called on it."""
    used: dict[str, set[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in METHODS:
            used.setdefault(ast.unparse(node.value).rpartition(".")[2], set()).add(node.attr)
    return used


def _module(path: Path, folder: Path) -> str:
    parts = path.relative_to(folder).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _constants(tree: ast.Module, elsewhere: dict[str, dict[str, Any]]) -> dict[str, Any]:
    known: dict[str, Any] = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module in elsewhere:
            theirs = elsewhere[node.module]
            known |= {
                name.asname or name.name: theirs[name.name] for name in node.names if name.name in theirs
            }
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            try:
                known[node.targets[0].id] = literal(node.value, known)
            except (LookupError, ValueError, TypeError):
                continue
    return known


def slow_texts(found: Found, length: int) -> Iterator[str | bytes]:
    """Texts of growing repeats of what a pattern is made of."""
    binary = isinstance(found.pattern, bytes)
    source = found.pattern.decode("latin-1") if isinstance(found.pattern, bytes) else found.pattern
    tree = parser.parse(source, found.flags & ~re.UNICODE)
    seen: set[str] = set()
    for before, piece in _repeats(list(tree), ""):
        for ending in ENDINGS:
            text = before + piece * (length // len(piece)) + ending
            if text not in seen:
                seen.add(text)
                yield text.encode("latin-1", "replace") if binary else text
    start = _sample(list(tree))
    for piece in {start[:size] for size in (1, 2, len(start))} - {""}:
        text = piece * (length // len(piece)) + "\0"
        yield text.encode("latin-1", "replace") if binary else text


def _repeats(nodes: list[Any], before: str) -> Iterator[tuple[str, str]]:
    """(what leads to a repeat, what it repeats) for each repeat without a small end."""
    for position, (op, value) in enumerate(nodes):
        if op in (sre.MAX_REPEAT, sre.MIN_REPEAT, sre.POSSESSIVE_REPEAT):
            _low, high, inner = value
            if high is sre.MAXREPEAT or int(high) > 50:
                for piece in _samples(list(inner)):
                    if piece:
                        yield before, piece
                        # What follows may take the same characters.
                        yield before, piece + _sample(nodes[position + 1 :])
            yield from _repeats(list(inner), before)
        elif op is sre.SUBPATTERN:
            yield from _repeats(list(value[3]), before)
        elif op is sre.ATOMIC_GROUP:
            yield from _repeats(list(value), before)
        elif op is sre.BRANCH:
            for branch in value[1]:
                yield from _repeats(list(branch), before)
        elif op in (sre.ASSERT, sre.ASSERT_NOT):
            yield from _repeats(list(value[1]), before)
        before += _sample([(op, value)])


def _samples(nodes: list[Any]) -> list[str]:
    """Texts that the nodes match; several for a class of characters alone."""
    if len(nodes) == 1 and nodes[0][0] in (sre.IN, sre.ANY, sre.NOT_LITERAL, sre.SUBPATTERN, sre.BRANCH):
        op, value = nodes[0]
        if op is sre.SUBPATTERN:
            return _samples(list(value[3]))
        if op is sre.BRANCH:
            return [_sample(list(branch)) for branch in value[1]][:6]
        return [char for char in TRIED if _takes(op, value, char)][:4] or [_sample(nodes)]
    return [_sample(nodes)]


def _sample(nodes: list[Any]) -> str:
    text = ""
    for op, value in nodes:
        if op is sre.LITERAL:
            text += chr(value)
        elif op in (sre.IN, sre.ANY, sre.NOT_LITERAL):
            fitting = [char for char in TRIED if _takes(op, value, char)]
            text += fitting[0] if fitting else _member(value)
        elif op in (sre.MAX_REPEAT, sre.MIN_REPEAT, sre.POSSESSIVE_REPEAT):
            text += _sample(list(value[2])) * max(1, int(value[0]))
        elif op is sre.SUBPATTERN:
            text += _sample(list(value[3]))
        elif op is sre.ATOMIC_GROUP:
            text += _sample(list(value))
        elif op is sre.BRANCH:
            text += _sample(list(value[1][0]))
    return text


def _takes(op: Any, value: Any, char: str) -> bool:
    if op is sre.ANY:
        return char != "\n"
    if op is sre.NOT_LITERAL:
        return ord(char) != value
    kinds = {sre.CATEGORY_DIGIT: "0-9", sre.CATEGORY_SPACE: r"\s", sre.CATEGORY_WORD: r"\w"}
    kinds |= {sre.CATEGORY_NOT_DIGIT: "^0-9", sre.CATEGORY_NOT_SPACE: r"^\s", sre.CATEGORY_NOT_WORD: r"^\w"}
    inside = False
    for kind, of in value:
        if kind is sre.LITERAL:
            inside |= ord(char) == of
        elif kind is sre.RANGE:
            inside |= of[0] <= ord(char) <= of[1]
        elif kind is sre.CATEGORY:
            inside |= re.match(f"[{kinds[of]}]", char) is not None
    return inside != (value[0][0] is sre.NEGATE)


def _member(value: Any) -> str:
    for kind, of in value if isinstance(value, list) else ():
        if kind is sre.LITERAL:
            return chr(of)
        if kind is sre.RANGE:
            return chr(of[0])
    return "~"


def serve() -> None:
    """Match what comes, one job a line."""
    for line in sys.stdin:
        job = json.loads(line)
        pattern = job["pattern"].encode("latin-1") if job["binary"] else job["pattern"]
        match = getattr(re.compile(pattern, job["flags"]), job["method"])
        for text in slow_texts(Found("", pattern, job["flags"], ""), job["length"]):
            match(text)
        print("done", flush=True)


if __name__ == "__main__":
    serve()
