# SPDX-License-Identifier: LGPL-2.1-or-later
"""Random products of boxes and cylinders whose volume, centre and second moments are known by construction.

A product is a list of bodies that stand apart, touch, overlap, nest, coincide, are open or inside out; the
truth comes from closed forms alone. Lengths are in mm. Nothing here uses the code under test.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Moments:
    """Volume, first and second moments about the origin: [mm^3], (3,) [mm^4], (3, 3) [mm^5]."""

    volume: float
    first: Array
    second: Array

    def __add__(self, other: Moments) -> Moments:
        return Moments(self.volume + other.volume, self.first + other.first, self.second + other.second)

    def __neg__(self) -> Moments:
        return Moments(-self.volume, -self.first, -self.second)

    def mapped(self, turn: Array, step: Array) -> Moments:
        """After x → turn x + step."""
        stretch = abs(np.linalg.det(turn))
        first, second = turn @ self.first, turn @ self.second @ turn.T
        cross = np.outer(first, step)
        moved = second + cross + cross.T + self.volume * np.outer(step, step)
        return Moments(stretch * self.volume, stretch * (first + self.volume * step), stretch * moved)


@dataclass(frozen=True)
class Piece:
    """A box (``sides`` 0, ``size`` x, y, z) or an upright prism or cylinder about its middle.

    sides
        of a regular prism of radius ``size[0]`` and height ``size[2]``; -1 for a cylinder.
    turned, missing, shell
        inside out; so many faces left out; given as surfaces and not as a solid.
    """

    size: tuple[float, float, float]
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sides: int = 0
    turned: bool = False
    missing: int = 0
    shell: bool = False

    @property
    def moments(self) -> Moments:
        """By closed forms."""
        x, _, z = self.size
        if self.sides == 0:
            volume = float(np.prod(self.size))
            second = volume / 12 * np.diag(np.square(self.size))
        else:
            corner = 2 * np.pi / self.sides
            area = np.pi * x**2 if self.sides < 0 else self.sides / 2 * x**2 * np.sin(corner)
            polar = (
                np.pi / 2 * x**4
                if self.sides < 0
                else self.sides / 12 * x**4 * np.sin(corner) * (2 + np.cos(corner))
            )
            volume = area * z
            second = np.diag([polar / 2 * z, polar / 2 * z, volume * z**2 / 12])
        return Moments(volume, np.zeros(3), second).mapped(np.eye(3), np.array(self.at))


@dataclass
class Product:
    """Pieces, what they really enclose, and whether a warning must or must not be there.

    doubt
        True: it must be doubted; False: it must be right and undoubted; None: right or doubted.
    """

    kind: str
    pieces: list[Piece]
    truth: Moments
    doubt: bool | None = False
    turn: Array = field(default_factory=lambda: np.eye(3))
    step: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def placed(self) -> Moments:
        """The truth where the product stands."""
        return self.truth.mapped(self.turn, self.step)


def grid(dice: random.Random, low: float, high: float) -> float:
    """A multiple of 1/16 mm, which every format keeps."""
    return dice.randint(int(low * 16), int(high * 16)) / 16


def piece(dice: random.Random, prisms: bool, **more: Any) -> Piece:
    """One body of 4 to 40 mm."""
    size = (grid(dice, 4, 40), grid(dice, 4, 40), grid(dice, 4, 40))
    sides = dice.choice([0, 0, dice.randint(3, 12) if prisms else -1])
    return Piece((size[0] / 2, size[0] / 2, size[2]) if sides else size, sides=sides, **more)


def inner(dice: random.Random, outer: Piece, **more: Any) -> Piece:
    """A body strictly inside: of 3/8 of the size, a sixteenth off the middle."""
    size = tuple(s * 3 / 8 for s in outer.size)
    at = tuple(a + dice.choice([-1, 0, 1]) / 16 for a in outer.at)
    return Piece((size[0], size[1], size[2]), (at[0], at[1], at[2]), outer.sides, **more)


def beside(one: Piece, other: Piece, gap: float) -> Piece:
    """``other`` above ``one``, ``gap`` away (0 touches, below 0 overlaps)."""
    z = one.at[2] + (one.size[2] + other.size[2]) / 2 + gap
    return Piece(other.size, (one.at[0], one.at[1], z), other.sides, other.turned)


def single(dice: random.Random, prisms: bool) -> Product:
    body = piece(dice, prisms, turned=dice.random() < 0.3)
    return Product("single", [body], body.moments)


def apart(dice: random.Random, prisms: bool) -> Product:
    one = piece(dice, prisms)
    other = beside(one, piece(dice, prisms), grid(dice, 0.25, 20))
    return Product("apart", [one, other], one.moments + other.moments)


def touching(dice: random.Random, prisms: bool) -> Product:
    one = piece(dice, prisms)
    other = beside(one, piece(dice, prisms), 0.0)
    # Triangle meshes that share some corners are no closed surface any more, and may be doubted.
    return Product("touching", [one, other], one.moments + other.moments, None if prisms else False)


def hollow(dice: random.Random, prisms: bool) -> Product:
    """A cavity; in half of them the whole is inside out."""
    flipped = dice.random() < 0.5
    outer = piece(dice, prisms, turned=flipped)
    hole = inner(dice, outer, turned=not flipped)
    return Product("hollow", [outer, hole], outer.moments + -hole.moments)


def core(dice: random.Random, prisms: bool) -> Product:
    """A body in a cavity of a body."""
    flipped = dice.random() < 0.5
    outer = piece(dice, prisms, turned=flipped)
    hole = inner(dice, outer, turned=not flipped)
    seed = inner(dice, hole, turned=flipped)
    return Product("core", [outer, hole, seed], outer.moments + -hole.moments + seed.moments)


def swallowed(dice: random.Random, prisms: bool) -> Product:
    outer = piece(dice, prisms)
    return Product("swallowed", [outer, inner(dice, outer)], outer.moments, True)


def overlapping(dice: random.Random, prisms: bool) -> Product:
    """One on top of the other, too deep by a part of the smaller one."""
    one, other = piece(dice, prisms), piece(dice, prisms)
    if one.sides != other.sides or one.sides > 0:
        one, other = Piece(one.size), Piece(other.size)
    depth = min(one.size[2], other.size[2]) * dice.choice([0.5, 0.25, 1 / 64])
    other = beside(one, other, -depth)
    both = (min(one.size[0], other.size[0]), min(one.size[1], other.size[1]), depth)
    middle = (0.0, 0.0, one.size[2] / 2 - depth / 2)
    common = Piece(both, middle, one.sides)
    return Product("overlapping", [one, other], one.moments + other.moments + -common.moments, True)


def crossing(dice: random.Random, prisms: bool) -> Product:
    """A bar across another one, flush on top or not."""
    wide, thin = grid(dice, 20, 40), grid(dice, 2, 8)
    lift = dice.choice([0.0, thin / 2])
    one, other = Piece((wide, thin, thin)), Piece((thin, wide, thin), (0.0, 0.0, lift))
    common = Piece((thin, thin, thin - lift), (0.0, 0.0, lift / 2))
    return Product("crossing", [one, other], one.moments + other.moments + -common.moments, True)


def copied(dice: random.Random, prisms: bool) -> Product:
    body = piece(dice, prisms)
    return Product("copied", [body] * dice.randint(2, 3), body.moments, True)


def opened(dice: random.Random, prisms: bool) -> Product:
    body = piece(dice, prisms, missing=dice.randint(1, 2), turned=dice.random() < 0.3)
    return Product("opened", [body], body.moments, True)


def surface(dice: random.Random, prisms: bool) -> Product:
    """A closed surface that is no solid; in a mesh file there is nothing else."""
    body = piece(dice, prisms, shell=True, turned=dice.random() < 0.3)
    return Product("surface", [body], body.moments, not prisms)


KINDS: tuple[Callable[[random.Random, bool], Product], ...] = (
    single, apart, touching, hollow, core, swallowed, overlapping, crossing, copied, opened, surface,
)  # fmt: skip


def product(dice: random.Random, *, prisms: bool, exact: bool) -> Product:
    """A random one. ``prisms``: regular prisms for cylinders; ``exact``: no digits beyond the grid's."""
    found = dice.choice(KINDS)(dice, prisms)
    if exact and any(one.sides > 0 for one in found.pieces):
        return product(dice, prisms=prisms, exact=exact)
    turns = [np.eye(3)[list(order)] for order in itertools.permutations(range(3))]
    turn = dice.choice(turns) @ np.diag([dice.choice([-1.0, 1.0]) for _ in range(3)])
    scale = dice.choice([1.0, 1.0, 0.5, 4.0])
    if not exact:
        axis = np.array([dice.gauss(0, 1) for _ in range(4)])
        w, x, y, z = axis / np.linalg.norm(axis)
        spin = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        turn = spin @ turn
    found.turn = scale * turn
    found.step = np.array([grid(dice, -100, 100) for _ in range(3)])
    return found


def triangles(found: Product) -> tuple[Array, Array]:
    """The product as (n, 3) vertices and (m, 3) faces; each piece has corners of its own."""
    vertices: list[Array] = []
    faces: list[Array] = []
    start = 0
    mirrored = bool(np.linalg.det(found.turn) < 0)
    for one in found.pieces:
        points, corners = _piece_triangles(one)
        if one.turned is not mirrored:
            corners = corners[:, ::-1]
        if one.missing:
            corners = corners[one.missing * 2 :]
        vertices.append((points + np.array(one.at)) @ found.turn.T + found.step)
        faces.append(corners + start)
        start += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def _piece_triangles(one: Piece) -> tuple[Array, Array]:
    if one.sides == 0:
        ring = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * np.array(one.size[:2]) / 2
    else:
        angles = 2 * np.pi * np.arange(one.sides) / one.sides
        ring = one.size[0] * np.column_stack([np.cos(angles), np.sin(angles)])
    count, half = len(ring), one.size[2] / 2
    points = np.concatenate(
        [np.column_stack([ring, np.full(count, -half)]), np.column_stack([ring, np.full(count, half)])]
    )
    faces = []
    for n in range(count):
        m = (n + 1) % count
        faces += [(n, m, count + m), (n, count + m, count + n)]
    for n in range(1, count - 1):
        faces += [(0, n + 1, n), (count, count + n, count + n + 1)]
    return points, np.array(faces)
