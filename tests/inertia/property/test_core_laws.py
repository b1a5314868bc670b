# SPDX-License-Identifier: LGPL-2.1-or-later
"""Laws of the algebra: rotation, translation, order, additivity."""

from __future__ import annotations

import numpy as np
from hunting import examples
from hypothesis import given, settings
from hypothesis import strategies as st

from silo.inertia.links.frames import origin_frame
from silo.inertia.output.accepted import settled
from silo.inertia.placements import place
from silo.inertia.rigid import MassProps, combine

length = st.floats(-5, 5, allow_nan=False)
positive = st.floats(1e-3, 10)
angle = st.floats(-np.pi, np.pi)


@st.composite
def bodies(draw: st.DrawFn) -> MassProps:
    """A real rigid body: a box somewhere, turned somehow."""
    mass, a, b, c = (draw(positive) for _ in range(4))
    tensor = np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) * mass / 12
    turn = draw(turns())
    return MassProps(mass, [draw(length) for _ in range(3)], turn @ tensor @ turn.T)


@st.composite
def turns(draw: st.DrawFn) -> np.ndarray:
    """A rotation matrix."""
    matrix: np.ndarray = origin_frame((0, 0, 0), [draw(angle) for _ in range(3)])[:3, :3]
    return matrix


@st.composite
def rigid(draw: st.DrawFn) -> np.ndarray:
    """A rigid placement, mirrored or not."""
    result = np.eye(4)
    result[:3, :3] = draw(turns()) * draw(st.sampled_from([1.0, -1.0]))
    result[:3, 3] = [draw(length) for _ in range(3)]
    return result


def assert_same(left: MassProps, right: MassProps) -> None:
    """Equal up to rounding, against the size of the bodies' own moments."""
    size = np.abs(right.inertia).max() + right.mass * (1 + np.abs(right.com).max()) ** 2
    assert np.isclose(left.mass, right.mass, rtol=1e-12)
    assert np.allclose(left.com, right.com, rtol=1e-11, atol=1e-11)
    assert np.allclose(left.inertia, right.inertia, rtol=0, atol=1e-12 * size)


@given(st.lists(bodies(), min_size=1, max_size=6), rigid())
def test_moving_all_is_moving_the_sum(parts: list[MassProps], placement: np.ndarray) -> None:
    """Combining and moving may be done in either order."""
    assert_same(combine([p.transformed(placement) for p in parts]), combine(parts).transformed(placement))


@given(st.lists(bodies(), min_size=2, max_size=6), st.integers(1, 5))
def test_sums_of_sums_are_the_sum(parts: list[MassProps], cut: int) -> None:
    """Links that are summed up give what all parts together give."""
    cut = min(cut, len(parts) - 1)
    assert_same(combine([combine(parts[:cut]), combine(parts[cut:])]), combine(parts))


@given(st.lists(bodies(), min_size=1, max_size=6))
def test_sums_of_bodies_are_bodies(parts: list[MassProps]) -> None:
    """What is made of real bodies passes the check, and still does after printing."""
    whole = combine(parts)
    assert whole.check() == ()
    assert settled(whole).check(tolerance=0.0) == ()


@settings(max_examples=examples(20))
@given(bodies(), rigid(), st.floats(0.1, 10))
def test_place_agrees_with_transform_and_scales_by_powers(
    part: MassProps, placement: np.ndarray, factor: float
) -> None:
    """Geometry placed rigidly moves like a mass; scaled by s, the volume grows by s³ and the tensor by s⁵."""
    volume, com, unit = place([part.mass], [part.com], [part.inertia], placement[None])
    assert_same(MassProps(volume[0], com[0], unit[0]), part.transformed(placement))
    grown = placement.copy()
    grown[:3, :3] *= factor
    volume, _, unit = place([part.mass], [part.com], [part.inertia], grown[None])
    turn = placement[:3, :3]
    assert np.isclose(volume[0], part.mass * factor**3, rtol=1e-9)
    assert np.allclose(
        unit[0],
        turn @ part.inertia @ turn.T * factor**5,
        rtol=1e-6,
        atol=1e-9 * factor**5 * np.abs(part.inertia).max(),
    )
