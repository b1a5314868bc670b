# SPDX-License-Identifier: LGPL-2.1-or-later
"""Look for phrases that a reader who learnt English at school stumbles over; CONTRIBUTING.md has the rules.

    python scripts/english.py

Exit code 1 if a phrase is in the docs, in a page, or in a Python file of ``mods``, if a package (``silo``,
``silo_server``) has a class name twice, or if the docstring of a function does not begin with a verb.
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# What stands there, and what to write instead.
BANNED = {
    r"(is|are|was|were|be) told": "gets, hears, learns; or say who reports it",
    r"told of|tells? of": "report",
    r"go(es)? on (to|with|once|until)": "continue",
    r"belongs? into": "belongs to, goes into",
    r"in order to": "to",
    r"prior to": "before",
    r"in case (that|of)": "if",
    r"due to the fact": "because",
    r"utili[sz]e[sd]?": "use",
    r"leverages?": "use",
    r"facilitates?": "help, make easier",
    r"functionality": "what it does",
    r"simply|obviously|of course": "leave it out",
    r"and/or": "or; or both",
    r"e\.g\.|i\.e\.|etc\.": "for example; that is; and so on",
    r"(has|have|had|having) to be done so": "do it",
    r"in the event that": "if",
    r"at this point in time": "now",
    r"anew": "again",
    r"whoever|whichever": "the person who, the program that; any",
    r"all the same": "anyway",
    r"for ever": "forever, without end",
    r"found out": "detected, known, checked",
    r"(is|are|was|were) said": "report it; or say who says it",
    r"thus|hence": "so",
    r"in vain": "without success",
    r"stands? first": "is on top, comes first",
    r"as ever": "as usual",
    r"of no avail|by no means|not least": "say it directly",
}
# Words with which no docstring of a function begins: it begins with a verb (Return, Yield, Show, Note, …).
NO_VERB = re.compile(
    r"a|about|after|again|all|also|an|another|any|as|at|back|before|between|both|but|"
    r"by|each|either|every|everybody|everything|false|first|for|from|he|her|here|his|"
    r"how|i|if|in|into|it|its|less|like|many|more|most|neither|never|no|nobody|none|"
    r"not|nothing|now|of|on|once|one|only|others|our|out|she|since|so|some|somebody|"
    r"something|such|that|the|their|theirs|there|these|they|this|those|three|to|true|"
    r"two|until|up|we|what|whatever|when|where|whether|which|while|who|whole|whom|whose|"
    r"why|with|within|without",
    re.IGNORECASE,
)
# For text in lower case: a pattern that ignores case, or has a group for each phrase, is 30 times slower.
PHRASE = re.compile(rf"\b(?:{'|'.join(BANNED)})(?!\w)")


def problems() -> list[str]:
    """Return a line for each phrase that is found."""
    pages = [ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*/README.md")]
    sources = [path for kind in ("py", "html") for path in ROOT.glob(f"mods/**/*.{kind}")]
    found = []
    for path in sorted((*pages, *sources)):
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
            for match in PHRASE.finditer(line.lower()):
                instead = next(words for text, words in BANNED.items() if re.fullmatch(text, match[0]))
                found.append(f"{path.relative_to(ROOT)}:{number}: “{match[0]}”: {instead}")
    for path in sorted(ROOT.glob("mods/**/*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and (text := ast.get_docstring(node)):
                word = text.split()[0].rstrip(".,:;")
                if not word.isalpha() or NO_VERB.fullmatch(word):
                    place = f"{path.relative_to(ROOT)}:{node.body[0].lineno}"
                    found.append(f"{place}: “{word}”: begin the docstring with a verb")
    for package in ("silo", "silo_server"):
        places: dict[str, str] = {}
        for path in sorted(ROOT.glob(f"mods/{package}/**/*.py")):
            for name in re.findall(r"^class ([A-Z]\w*)", path.read_text("utf-8"), re.MULTILINE):
                place = str(path.relative_to(ROOT))
                if places.setdefault(name, place) != place:
                    found.append(f"{place}: class {name} is in {places[name]} too: give it a name of its own")
    return found


if __name__ == "__main__":
    print("\n".join(problems()))
    sys.exit(1 if problems() else 0)
