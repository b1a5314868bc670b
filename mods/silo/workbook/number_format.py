# SPDX-License-Identifier: LGPL-2.1-or-later
"""A number as its format shows it. The codes are Excel's (ECMA-376 part 1, 18.8.31)."""

from __future__ import annotations

import operator
import re
from datetime import datetime, timedelta

_TOKEN = re.compile(
    r'"(?P<quoted>[^"]{0,255}+)"|\\(?P<escaped>.)|\[\$(?P<money>[^\]-]{0,255}+)[^\]]{0,255}+\]|_.|\*.|\[[^\]]{0,255}+\]'
    r"|(?P<digits>[#0?.,]+(?:E[+-]?[#0?]+)?)|(?P<other>.)",
    re.DOTALL,
)
_SECTION = re.compile(r'(?:"[^"]*"|\\.|[^;"\\])+')
_CONDITION = re.compile(r"\[(<=|>=|<>|<|>|=)(-?[\d.]+)\]")
_COMPARE = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq,
    "<>": operator.ne,
}  # fmt: skip
START, START_1904 = datetime(1899, 12, 30), datetime(1904, 1, 1)


def formatted(value: float, code: str, start: datetime = START) -> str:
    """Write a number in full, with the text that its format puts before and behind it.

    A format with a second group of digits, such as a fraction or a telephone number, is ignored: "12".
    """
    before, digits, behind, percent = "", "", "", False
    for token in _TOKEN.finditer(_section(value, code.replace("General", "#"))):
        literal = next((text for text in token.group("quoted", "escaped", "money", "other") if text), "")
        if token["other"] and token["other"] in "dmyhsDMYHS":
            return _moment(start + timedelta(seconds=round(value * 86400)))
        if token["digits"] and digits:
            return _plain(value)
        digits = digits or token["digits"] or ""
        percent |= token["other"] == "%"
        if digits:
            behind += literal
        else:
            before += literal
    number = value / 1000 ** (len(digits) - len(digits.rstrip(","))) * (100 if percent else 1)
    text = _plain(number)
    if re.fullmatch("0+", digits) and text.isdecimal():
        text = text.zfill(len(digits))
    # A sign or a bracket alone is the number's own.
    before, behind = (side if side.strip(" ()+-") else "" for side in (before, behind))
    return before + text + behind if digits else text


def _section(value: float, code: str) -> str:
    """Choose the part of a format for this value: by its conditions, or else by the sign."""
    free: list[str] = []
    for section in (sections := _SECTION.findall(code)):
        condition = _CONDITION.search(section)
        if condition is None:
            free.append(section)
        elif _COMPARE[condition[1]](value, float(condition[2])):
            return str(section)
    by_sign = 1 if value < 0 else 2 if value == 0 else 0
    return next(iter([*free[by_sign if free == sections else 0 :], *free]), "")


def _plain(value: float) -> str:
    text = f"{value:.15g}"
    return text + "0" * (text[-4:-3] == ".")  # "1.2340" cannot be 1234


def _moment(moment: datetime) -> str:
    if moment.date() == START.date():
        return moment.time().isoformat()
    return moment.isoformat(" ").removesuffix(" 00:00:00")


BOOLEANS = {"0": "FALSE", "1": "TRUE", "false": "FALSE", "true": "TRUE"}


def iso_text(text: str) -> str:
    """Write a date or time of XML as a table shows it: without its T, its Z and a midnight."""
    return text.removesuffix("Z").replace("T", " ").removesuffix(" 00:00:00")
