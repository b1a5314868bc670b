# SPDX-License-Identifier: LGPL-2.1-or-later
"""The kind of a standard part by its designation: screw, nut, washer, pin."""

from __future__ import annotations

import re

from silo.bom.items.stems import stems

# The kind of a standard part by its standard; what is in no list has it in its designation, or is of no known
# kind. An ASME number stands for all that it begins ("B18.3.1A"). Source: the Fasteners workbench's groups.
_KINDS = {
    "nut": "ISO 4032 4033 4034 4035 4036 4161 7040 7041 7042 7043 7044 7719 7720 8673 8674 8675 10511 10512 "
    "10513 10663 12125 12126 21670 DIN 315 466 467 508 557 562 582 917 928 929 934 935 936 937 979 "
    "980 981 982 985 986 1480 1587 1624 6330 6331 6334 6915 6923 6924 6925 6926 6927 7967 EN 1661 "
    "1663 1664 1666 1667 14218 ASME B18.2.2 B18.2.4 B18.16 GOST 11860",
    "washer": "ISO 7089 7090 7091 7092 7093 7094 8738 10669 10673 DIN 125 126 127 128 137 433 434 435 436 "
    "440 988 1440 1441 2093 6319 6340 6796 6797 6798 6916 7349 7603 7989 9021 ASME B18.21 B18.22 SAE USS",
    "pin": "ISO 1234 2338 2339 2340 2341 8733 8734 8735 8736 8737 8739 8740 8741 8742 8743 8744 8745 8746 "
    "8747 8748 8749 8750 8751 8752 13337 DIN 1 7 94 1443 1444 1469 1470 1471 1472 1473 1474 1475 1481 "
    "6325 7343 7346 7977 7978 11024",
    "key": "DIN 6880 6885 6886 6887 6888",
    "rivet": "ISO 1051 15973 15974 15975 15977 15978 15979 15981 15983 DIN 660 661 662 6791 7331 7337 7340",
    "retaining ring": "DIN 471 472 983 984 6799 7993 703 705",
    "threaded rod": "DIN 975 976",
    "eyebolt": "ISO 3266 DIN 444 580",
    "screw": "ISO 1207 1479 1481 1482 1483 1580 2009 2010 2342 4014 4015 4016 4017 4018 4026 4027 4028 4029 "
    "4162 4762 4766 7045 7046 7047 7048 7049 7050 7051 7379 7380 7434 7435 7436 8676 8765 10642 12474 "
    "14579 14580 14581 14582 14583 14584 14585 14586 14587 15071 15072 15480 15481 15482 15483 15484 "
    "21269 DIN 84 85 95 96 97 316 404 464 465 478 479 480 561 564 571 603 605 607 608 653 912 913 914 "
    "915 916 920 921 923 924 925 927 931 933 960 961 963 964 965 966 967 6912 6914 6921 6922 7500 "
    "7504 7513 7516 7964 7968 7969 7971 7972 7973 7976 7981 7982 7983 7984 7985 7990 7991 7995 7996 "
    "7997 7999 EN 1662 1665 ASME B18.2.1 B18.3 B18.5 B18.6",
}

_KIND_OF = {
    f"{body} {number}": kind
    for kind, standards in _KINDS.items()
    for body, numbers in re.findall(r"([A-Z]+)((?: (?:B?[\d.]+|USS))+)", standards)
    for number in numbers.split()
}

KINDS = (*_KINDS, "insert", "spacer", "standoff")
"""The kinds of standard parts that have names."""

OTHER_NAMES = {"screw": "bolt", "spacer": "standoff", "standoff": "spacer"}


def standard_kind(designation: str) -> str:
    """Return the kind of a standard part ("nut" for "ISO 4032 M4"); "" if it is not known."""
    match = re.match(r"([A-Z]+) ([A-Z]?\d+(?:\.\d+)*|USS)", designation)
    if match is not None:
        number = match[2]
        while number:
            if kind := _KIND_OF.get(f"{match[1]} {number}"):
                return kind
            number = number.rpartition(".")[0]
    words = stems(designation)
    kinds = (*_KINDS, "insert", *OTHER_NAMES)
    return next((kind for kind in kinds if set(stems(kind)) <= set(words)), "")
