# SPDX-License-Identifier: LGPL-2.1-or-later
"""What a preview shows: links in colours, their centres of mass, their inertia as ellipsoids. Pure."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from silo.inertia.core import MassProps
from silo.inertia.geometry.mesh import Floats, Mesh
from silo.inertia.model import Assembly, Instance

if TYPE_CHECKING:
    from silo.inertia.report import InertiaReport

Colour = tuple[float, float, float]

_BASE: tuple[Colour, ...] = (
    (0.26, 0.52, 0.80),
    (0.92, 0.57, 0.20),
    (0.36, 0.66, 0.38),
    (0.80, 0.36, 0.36),
    (0.55, 0.45, 0.75),
    (0.85, 0.73, 0.25),
    (0.30, 0.67, 0.70),
    (0.80, 0.48, 0.66),
)
UNCLAIMED: Colour = (0.72, 0.72, 0.70)


@dataclass(frozen=True, eq=False)
class LinkView:
    """One link: the instances that belong to it, and its mass properties in the assembly's frame.

    ``props`` None draws the parts alone (parts that no link has, or a link without mass).
    """

    name: str
    instances: tuple[Instance, ...]
    props: MassProps | None = None


@dataclass(frozen=True, eq=False)
class Ellipsoid:
    """The solid ellipsoid of even density with a link's mass and moments of inertia.

    centre (3,) [m]; axes (3, 3), columns, right-handed; radii (3,) [m]. All in the assembly's frame.
    """

    centre: Floats
    axes: Floats
    radii: Floats

    @property
    def placement(self) -> Floats:
        """(4, 4) from the unit sphere to the ellipsoid."""
        result = np.eye(4)
        result[:3, :3] = self.axes * self.radii
        result[:3, 3] = self.centre
        return result


def inertia_ellipsoid(props: MassProps) -> Ellipsoid | None:
    """A body of mass m has I_a = m/5 (b² + c²), so a² = 5/(2m) (I_b + I_c - I_a). None without a mass."""
    if props.mass <= 0 or not np.isfinite(props.inertia).all():
        return None
    moments, axes = props.principal()
    squares = 5 / (2 * props.mass) * (moments.sum() - 2 * moments)
    return Ellipsoid(props.com, axes, np.sqrt(np.clip(squares, 0.0, None)))


def colour_of(number: int) -> Colour:
    """A colour for the n-th link; colour-blind people can distinguish the first eight as well as can be."""
    if number < len(_BASE):
        return _BASE[number]
    hue = (number * 0.618033988749895) % 1.0
    return colorsys.hls_to_rgb(hue, 0.45 + 0.15 * (number % 2), 0.5)


def meshes_of(assembly: Assembly, views: Sequence[LinkView]) -> Mapping[str, Mesh]:
    """The meshes of the prototypes that are shown, by key."""
    shown = dict.fromkeys(instance.prototype for view in views for instance in view.instances)
    return {
        key: mesh for key in shown if isinstance(mesh := assembly.prototypes[key].mesh, Mesh) and len(mesh)
    }


def views_of(report: InertiaReport, assembly: Assembly) -> list[LinkView]:
    """The links of a report, in its order, then what no link has."""
    by_path = {instance.name: instance for instance in assembly.instances}
    views = []
    for link in report.links.values():
        members = tuple(by_path[path] for part in link.parts for path in part.paths if path in by_path)
        props = link.props.transformed(link.frame.placement) if link.props.mass > 0 else None
        views.append(LinkView(link.name, members, props))
    loose = tuple(by_path[path] for part in report.unclaimed for path in part.paths if path in by_path)
    if loose:
        views.append(LinkView("", loose))
    return views
