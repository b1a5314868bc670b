# SPDX-License-Identifier: LGPL-2.1-or-later
"""Links with their ``<inertial>`` in URDF, SDF and MJCF: about the centre of mass, in the link's axes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

from silo.bom.errors import InputError
from silo.bom.message import message
from silo.inertia.digits import number
from silo.inertia.rigid import MassProps

_SNIPPETS = {
    "urdf": (
        "link",
        """<inertial>
  <origin xyz="{com}" rpy="0 0 0"/>
  <mass value="{mass}"/>
  <inertia ixx="{ixx}" ixy="{ixy}" ixz="{ixz}" iyy="{iyy}" iyz="{iyz}" izz="{izz}"/>
</inertial>""",
    ),
    "sdf": (
        "link",
        """<inertial>
  <pose>{com} 0 0 0</pose>
  <mass>{mass}</mass>
  <inertia>
    <ixx>{ixx}</ixx>
    <ixy>{ixy}</ixy>
    <ixz>{ixz}</ixz>
    <iyy>{iyy}</iyy>
    <iyz>{iyz}</iyz>
    <izz>{izz}</izz>
  </inertia>
</inertial>""",
    ),
    "mjcf": (
        "body",
        '<inertial pos="{com}" mass="{mass}" fullinertia="{ixx} {iyy} {izz} {ixy} {ixz} {iyz}"/>',
    ),
}
"""Format → its element for a link, and ``<inertial>`` in it: http://wiki.ros.org/urdf/XML/link,
http://sdformat.org/spec, https://mujoco.readthedocs.io."""

SNIPPETS = tuple(_SNIPPETS)


def inertial(props: MassProps, kind: str = "urdf") -> str:
    """Write a link's ``<inertial>``. ``kind``: one of :data:`SNIPPETS`."""
    values = vars(props.to_inertial())
    com = " ".join(map(number, values.pop("com")))
    return _SNIPPETS[kind][1].format(com=com, **{name: number(value) for name, value in values.items()})


# The text around all links that makes the file loadable; {} is the model's name.
_AROUND = {
    "urdf": ("<robot name={}>", "</robot>"),
    "sdf": ('<sdf version="1.9">\n<model name={}>', "</model>\n</sdf>"),
    "mjcf": ("<mujoco model={}>\n<worldbody>", "</worldbody>\n</mujoco>"),
}

_XML = re.compile("[\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]+")

# Names that a format keeps for itself.
_RESERVED = {"mjcf": {"world"}, "sdf": {"world"}}


def snippets(links: Mapping[str, MassProps], kind: str) -> str:
    """Write all links to copy from, each in its ``<link>`` or ``<body>``.

    ``kind``: one of :data:`SNIPPETS`.
    """
    element = _SNIPPETS[kind][0]
    bodies = {name: inertial(props, kind).replace("\n", "\n  ") for name, props in links.items()}
    return "".join(
        f"<{element} name={quoteattr(name)}>\n  {body}\n</{element}>\n" for name, body in bodies.items()
    )


def document(links: Mapping[str, MassProps], kind: str, name: str) -> str:
    """Write a file of all links that the format's own reader loads; the user adds the joints.

    InputError if a link has a name that the format does not allow.
    """
    taken = _RESERVED.get(kind, set())
    unwritable = [ascii(link) for link in links if not _XML.fullmatch(link)]
    if unwritable:
        raise InputError(
            message(
                "XML cannot hold the characters of the link {unwritable}; a link map can rename it",
                unwritable=", ".join(unwritable),
            )
        )
    bad = [link for link in links if link in taken or (kind == "sdf" and ("::" in link or _is_dunder(link)))]
    if bad:
        raise InputError(
            message(
                "{kind} does not allow a link with the name {bad}; a link map can rename it",
                kind=kind.upper(),
                bad=", ".join(bad),
            )
        )
    title = "".join(c if _XML.fullmatch(c) else " " for c in name)
    title = title.replace("::", " ") if kind == "sdf" else title
    start, end = _AROUND[kind]
    head = "" if kind == "mjcf" else '<?xml version="1.0"?>\n'
    return f"{head}{start.format(quoteattr(title or 'assembly'))}\n{snippets(links, kind)}{end}\n"


def _is_dunder(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")
