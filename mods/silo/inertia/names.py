# SPDX-License-Identifier: LGPL-2.1-or-later
"""Names of parts: which two mean the same part, and which names are near an unknown one.

Two names mean the same part if they are equal, equal but for writing, or equal but for lost characters. A
name inside another never counts ("arm" in "forearm"), nor does likeness: M3x10 and M3x12 are alike to 0.8,
bracket_2 and bracket_3 to 0.89. Likeness only proposes, and only if all digits agree.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from difflib import SequenceMatcher
from functools import lru_cache

SUGGEST_FROM = 0.84
"""difflib's ratio from which a name is proposed to the person; docs/decisions has what it was chosen by."""

LOST = "\ufffd"
"""What stands for an unreadable character; a plain question mark may as well."""

_SEPARATORS = re.compile(r"[\s_\-‐‑–]+")

_OCCURRENCE = re.compile(r"(?:(?<!\s)(?:\s*+<\d++>|\s++\(\d++\))|:\d++)$")

_LOST_RUN = re.compile(rf"[?{LOST}]+")

_INVISIBLE = dict.fromkeys(map(ord, "\u00ad\u200b\u200c\u200d\u2060\ufeff"))


def plain(name: str) -> str:
    """Return the name in NFKC, case-folded and without invisible characters. Underscores, hyphens and runs of
    spaces become one space.
    """
    return _separated(unicodedata.normalize("NFKC", name.translate(_INVISIBLE)).casefold())


def bare(name: str) -> str:
    """Do what :func:`plain` does, and cut one occurrence mark at the end: ``<2>``, `` (1)``, ``:3``.

    ``_10`` stays, because real part names have it ("BALL_JHA17.step_10").
    """
    return plain(_OCCURRENCE.sub("", name.strip()))


def is_lossy(name: str) -> bool:
    """Return True if characters were lost on the way: "?" or U+FFFD."""
    return _LOST_RUN.search(name) is not None


def could_be(lossy: str, intact: str) -> bool:
    """Return True if ``lossy`` may be ``intact`` with characters lost.

    Only characters outside of ASCII get lost, so "M?" is never "M3". A run of k marks stands for one to k
    characters (é may become one mark or two). Both compositions of accents are tried.
    """
    pattern = _lossy_pattern(lossy)
    return any(pattern.fullmatch(_fold(intact, form)) is not None for form in ("NFC", "NFD"))


@lru_cache(maxsize=4096)
def _lossy_pattern(lossy: str) -> re.Pattern[str]:
    text = _fold(lossy, "NFC")
    pattern = ""
    end = 0
    for run in _LOST_RUN.finditer(text):
        pattern += re.escape(text[end : run.start()]) + rf"[^\x00-\x7f]{{1,{len(run[0])}}}"
        end = run.end()
    return re.compile(pattern + re.escape(text[end:]))


def _fold(name: str, form: str) -> str:
    # NFKC would turn ™ into the letters TM, which no mark stands for.
    normal = unicodedata.normalize("NFC" if form == "NFC" else "NFD", name)
    return _separated(normal.lower())


def _separated(text: str) -> str:
    return _SEPARATORS.sub(" ", text).strip()


def digits(name: str) -> tuple[str, ...]:
    """Return all runs of digits in a name, in order."""
    return tuple(re.findall(r"\d+", name))


_MARK = re.compile(r"(?: (?:v|rev ?)?\d{1,3}| \(\d{1,3}\))$")

_NUMBER = re.compile(r" \(?\d{1,3}\)?$")


def _stem(name: str) -> str:
    """Return a name without the mark of a copy or of a version; the whole name if nothing else is left."""
    text = plain(name)
    return _MARK.sub("", text) or text


def _may_be(one: str, other: str) -> bool:
    """Return False for two parts that are numbered: "bracket 2" is not "bracket 3"."""
    return not (_NUMBER.search(one) and _NUMBER.search(other))


class Suggester:
    """Names a user may have meant. For messages only.

    They are alike by difflib with all digits equal, or the same but for a mark of a copy or of a version.

    ``budget``: comparisons before it falls silent; proposals are a courtesy, and must not take minutes for a
    BOM of thousands that fits nothing.
    """

    def __init__(self, candidates: Iterable[str], budget: int = 100_000) -> None:
        self._by_digits: dict[tuple[str, ...], dict[str, str]] = {}
        self._by_stem: dict[str, dict[str, str]] = {}
        for name in candidates:
            self._by_digits.setdefault(digits(name), {}).setdefault(plain(name), name)
            self._by_stem.setdefault(_stem(name), {}).setdefault(plain(name), name)
        self._budget = budget

    def near(self, name: str, limit: int = 3) -> tuple[str, ...]:
        """Return up to ``limit`` similar names, the most similar first."""
        wanted = plain(name)
        same = self._by_stem.get(_stem(name), {})
        # A number or a version behind the name: "shaft" and "shaft_1", "Arm-1" and "Arm", "base v3".
        marked = tuple(other for key, other in same.items() if key != wanted and _may_be(wanted, key))
        return tuple(dict.fromkeys((*marked, *self._alike(name, wanted, limit))))[:limit]

    def _alike(self, name: str, wanted: str, limit: int) -> tuple[str, ...]:
        fitting = self._by_digits.get(digits(name), {})
        self._budget -= len(fitting)
        if not fitting or self._budget < 0:
            return ()
        turned = " ".join(sorted(wanted.split()))
        nearest = []
        for candidate in fitting:
            ratio = max(_alike(wanted, candidate), _alike(turned, " ".join(sorted(candidate.split()))))
            if ratio >= SUGGEST_FROM:
                nearest.append((-ratio, candidate))
        return tuple(fitting[candidate] for _, candidate in sorted(nearest)[:limit])


def _alike(left: str, right: str) -> float:
    """Rate the similarity from 0 to 1; 0 at once if it cannot reach the limit."""
    matcher = SequenceMatcher(None, left, right, autojunk=False)
    if matcher.real_quick_ratio() < SUGGEST_FROM or matcher.quick_ratio() < SUGGEST_FROM:
        return 0.0
    return matcher.ratio()
