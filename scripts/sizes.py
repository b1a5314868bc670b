# SPDX-License-Identifier: LGPL-2.1-or-later
"""How large each package is, in tokens, and whether it is within its budget (scripts/sizes.toml).

    python scripts/sizes.py

Tokens of Python are Python's own, without comments, docstrings and white space: reformatting changes
nothing. Those of templates, style sheets and scripts are words and signs. Bundled files do not count.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1] / "mods"
WORD = re.compile(r"\w+|[^\w\s]")
KINDS = {".html": "templates", ".css": "CSS", ".js": "JS"}
BUNDLED = {"three.min.js"}
_NO_CODE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    tokenize.ENDMARKER,
}


def tokens_of(text: str) -> int:
    """Return how many tokens a Python module has."""
    described = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docs = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, described) and ast.get_docstring(node, clean=False) is not None
        for line in range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1)
    }
    found = tokenize.generate_tokens(io.StringIO(text).readline)
    return sum(token.type not in _NO_CODE and token.start[0] not in docs for token in found)


def measured() -> Iterator[tuple[str, int]]:
    """Yield (package or kind of file, tokens) of each file."""
    for path in ROOT.rglob("*"):
        text = path.read_text("utf-8") if path.suffix in (".py", *KINDS) and path.name not in BUNDLED else ""
        if path.suffix == ".py":
            yield "/".join(path.relative_to(ROOT).parts[:-1][:2]), tokens_of(text)
        elif text:
            yield KINDS[path.suffix], len(WORD.findall(text))


def main() -> int:
    """Print a line for each package; 1 if one is above its budget."""
    sizes, files = Counter[str](), Counter[str]()
    for name, tokens in measured():
        sizes[name] += tokens
        files[name] += 1
    budgets = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
    over = 0
    for name, tokens in sizes.most_common():
        budget = budgets.get(name, 0)
        over += tokens > budget
        mark = "  above its budget" if tokens > budget else ""
        print(f"{files[name]:5} files {tokens:8} tokens of {budget:8}  {name}{mark}")
    packages = [name for name in sizes if name not in KINDS.values()]
    print(
        f"{sum(map(files.get, packages)):5} files {sum(map(sizes.get, packages)):8} tokens of Python in all"
    )
    if over:
        print(
            "Make it smaller, or raise the budget in scripts/sizes.toml, with a line that says why.",
            file=sys.stderr,
        )
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
