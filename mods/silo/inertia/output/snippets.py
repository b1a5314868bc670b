# SPDX-License-Identifier: LGPL-2.1-or-later
"""``<inertial>`` as URDF, SDF and MJCF want it: about the centre of mass, axes of the link, no rotation."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from xml.sax.saxutils import quoteattr

from silo.bom.errors import InputError
from silo.inertia.core import InertialProperties, MassProps
from silo.inertia.output.values import number


def urdf_inertial(props: MassProps) -> str:
    """``<inertial>`` of a URDF link (http://wiki.ros.org/urdf/XML/link)."""
    v = props.to_inertial()
    xyz = " ".join(number(c) for c in v.com)
    elements = " ".join(f'{name}="{number(getattr(v, name))}"' for name in _UPPER)
    return (
        "<inertial>\n"
        f'  <origin xyz="{xyz}" rpy="0 0 0"/>\n'
        f'  <mass value="{number(v.mass)}"/>\n'
        f"  <inertia {elements}/>\n"
        "</inertial>"
    )


_UPPER = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def sdf_inertial(props: MassProps) -> str:
    """``<inertial>`` of an SDFormat link (http://sdformat.org/spec)."""
    v = props.to_inertial()
    pose = " ".join(number(c) for c in v.com)
    elements = "\n".join(f"    <{name}>{number(getattr(v, name))}</{name}>" for name in _UPPER)
    return (
        "<inertial>\n"
        f"  <pose>{pose} 0 0 0</pose>\n"
        f"  <mass>{number(v.mass)}</mass>\n"
        f"  <inertia>\n{elements}\n  </inertia>\n"
        "</inertial>"
    )


def mjcf_inertial(props: MassProps) -> str:
    """``<inertial>`` of a MuJoCo body; ``fullinertia`` has the order ixx iyy izz ixy ixz iyz."""
    v = props.to_inertial()
    pos = " ".join(number(c) for c in v.com)
    full = " ".join(number(e) for e in _mujoco_order(v))
    return f'<inertial pos="{pos}" mass="{number(v.mass)}" fullinertia="{full}"/>'


def _mujoco_order(v: InertialProperties) -> tuple[float, ...]:
    return (v.ixx, v.iyy, v.izz, v.ixy, v.ixz, v.iyz)


_FORMATS: dict[str, tuple[str, Callable[[MassProps], str]]] = {
    "urdf": ("link", urdf_inertial),
    "sdf": ("link", sdf_inertial),
    "mjcf": ("body", mjcf_inertial),
}
# What stands around all links, so that the file loads as it is; {} is the model's name.
_AROUND = {
    "urdf": ("<robot name={}>", "</robot>"),
    "sdf": ('<sdf version="1.9">\n<model name={}>', "</model>\n</sdf>"),
    "mjcf": ("<mujoco model={}>\n<worldbody>", "</worldbody>\n</mujoco>"),
}
_XML = re.compile("[\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]+")
# Names that a format keeps for itself.
_RESERVED = {"mjcf": {"world"}, "sdf": {"world"}}
SNIPPETS = tuple(_FORMATS)


def snippets(links: Mapping[str, MassProps], kind: str) -> str:
    """All links, each in its ``<link>`` or ``<body>``, to paste from. ``kind``: one of :data:`SNIPPETS`."""
    element, write = _FORMATS[kind]
    blocks = []
    for name, props in links.items():
        body = write(props).replace("\n", "\n  ")
        blocks.append(f"<{element} name={quoteattr(name)}>\n  {body}\n</{element}>\n")
    return "".join(blocks)


def document(links: Mapping[str, MassProps], kind: str, name: str) -> str:
    """A file of all links that the format's own reader loads; the joints are yours to add.

    InputError where a link has a name that the format does not allow.
    """
    taken = _RESERVED.get(kind, set())
    unwritable = [ascii(link) for link in links if not _XML.fullmatch(link)]
    if unwritable:
        raise InputError(
            f"XML cannot hold the characters of the link {', '.join(unwritable)}; a link map can rename it"
        )
    bad = [link for link in links if link in taken or (kind == "sdf" and ("::" in link or _is_dunder(link)))]
    if bad:
        raise InputError(
            f"{kind.upper()} does not allow a link with the name {', '.join(bad)}; a link map can rename it"
        )
    title = "".join(c if _XML.fullmatch(c) else " " for c in name)
    title = title.replace("::", " ") if kind == "sdf" else title
    start, end = _AROUND[kind]
    head = "" if kind == "mjcf" else '<?xml version="1.0"?>\n'
    return f"{head}{start.format(quoteattr(title or 'assembly'))}\n{snippets(links, kind)}{end}\n"


def _is_dunder(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")
