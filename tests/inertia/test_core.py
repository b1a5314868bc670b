# SPDX-License-Identifier: LGPL-2.1-or-later
"""The rigid-body algebra against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import box, placement

from silo.bom.errors import InputError
from silo.inertia.placements import as_placement, is_rigid, place
from silo.inertia.rigid import MassProps, TensorProblem, parallel_axis
from silo.inertia.types import InertialProperties

PRODUCT = 0.015 * np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0]])
TURN_Z = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]


def props(
    mass: float = 2.0, com: tuple[float, ...] = (0, 0, 0), diagonal: tuple[float, ...] = (3, 4, 5)
) -> MassProps:
    return MassProps(mass, np.array(com, float), np.diag(np.array(diagonal, float)))


def test_parallel_axis_products_have_the_tensor_sign() -> None:
    """A mass at (1, 1, 0) gives Ixy = -m: the element itself, which goes into a URDF unchanged."""
    tensor = parallel_axis(np.array([2.0]), np.array([[1.0, 1.0, 0.0]]))
    assert tensor[0, 1] == -2.0
    assert np.diag(tensor).tolist() == [2.0, 2.0, 4.0]


def test_transform_turns_tensor_and_moves_centre() -> None:
    """A quarter turn about z swaps Ixx and Iyy; the shift moves the centre only."""
    moved = props(com=(1, 0, 0)).transformed(placement((0, 0, 7), TURN_Z))
    assert moved.com == pytest.approx([0, 1, 7])
    assert moved.inertia == pytest.approx(np.diag([4.0, 3.0, 5.0]))


def test_mirror_is_rigid_and_turns_products() -> None:
    """Mirroring x turns the sign of Ixy and Ixz and nothing else."""
    tensor = np.array([[3, 0.1, 0.2], [0.1, 4, 0.3], [0.2, 0.3, 5]])
    mirrored = MassProps(1, [1, 2, 3], tensor).transformed(np.diag([-1.0, 1, 1, 1]))
    assert mirrored.com == pytest.approx([-1, 2, 3])
    assert mirrored.inertia == pytest.approx(tensor * [[1, -1, -1], [-1, 1, 1], [-1, 1, 1]])
    assert mirrored.check() == ()


def test_scaling_a_mass_is_refused() -> None:
    """What scaling does to a given mass nobody knows; the message says which axes scale."""
    with pytest.raises(InputError, match=r"not scaled.*\[2\.0, 1\.0, 1\.0\]"):
        props().transformed(np.diag([2.0, 1, 1, 1]))


@pytest.mark.parametrize(
    ("matrix", "match"),
    [
        (np.eye(3), "4 x 4"),
        (np.diag([1.0, 1, 0, 1]), "flattens"),
        (np.diag([1.0, 1, 1, 2]), "last row"),
        (np.full((4, 4), np.nan), "finite"),
    ],
)
def test_bad_placements_are_refused(matrix: np.ndarray, match: str) -> None:
    """A placement is a finite invertible 4 x 4 matrix."""
    with pytest.raises(InputError, match=match):
        as_placement(matrix)


def test_place_scales_geometry_exactly() -> None:
    """A scaled box is the box with scaled edges, at any axis; a mirror leaves its volume positive."""
    small, large = box("a", 0.1, 0.2, 0.3), box("b", 0.2, 0.2, 0.9)
    volume, com, unit = place(
        [small.volume_m3] * 2,
        [[0.01, 0, 0]] * 2,
        [small.inertia_unit] * 2,
        np.array([np.diag([2.0, 1, 3, 1]), np.diag([-1.0, 1, 1, 1])]),
    )
    assert volume == pytest.approx([large.volume_m3, small.volume_m3], rel=1e-14)
    assert com == pytest.approx(np.array([[0.02, 0, 0], [-0.01, 0, 0]]))
    assert unit[0] == pytest.approx(large.inertia_unit, rel=1e-13, abs=1e-20)
    assert unit[1] == pytest.approx(small.inertia_unit, rel=1e-13, abs=1e-20)


def test_printed_digits_still_count_as_rigid() -> None:
    """STEP files print directions with about nine digits; that is no scaling."""
    turn = np.array([[0.707106781, -0.707106781, 0], [0.707106781, 0.707106781, 0], [0, 0, 1]])
    assert is_rigid(placement((0, 0, 0), turn))
    assert not is_rigid(np.diag([1.001, 1, 1, 1]))


def test_principal_axes_are_right_handed_and_ascending() -> None:
    """The moments ascend and the axes turn the tensor into them."""
    tensor = np.array([[5, 1, 0], [1, 4, 0.5], [0, 0.5, 3.0]])
    moments, axes = MassProps(1, [0, 0, 0], tensor).principal()
    assert (np.diff(moments) >= 0).all()
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes @ np.diag(moments) @ axes.T == pytest.approx(tensor)


@pytest.mark.parametrize(
    ("body", "problems"),
    [
        (props(), ()),
        (props(diagonal=(1, 1, 2)), ()),  # a flat plate
        (props(diagonal=(1, 1, 2.1)), (TensorProblem.TRIANGLE_INEQUALITY,)),
        (props(diagonal=(1, 1, 2 * (1 + 1e-6))), (TensorProblem.TRIANGLE_INEQUALITY,)),
        (props(diagonal=(1, 1, 2 * (1 + 1e-12))), ()),  # rounding
        (props(mass=0), (TensorProblem.ZERO_MASS,)),
        (props(mass=-1), (TensorProblem.NEGATIVE_MASS,)),
        (props(diagonal=(0, 0, 0)), (TensorProblem.ZERO_INERTIA,)),
        (props(diagonal=(float("nan"), 1, 1)), (TensorProblem.NOT_FINITE,)),
        (props(diagonal=(-1, 3, 3)), (TensorProblem.NOT_POSITIVE_DEFINITE,)),
        # No test of the diagonal finds it.
        (MassProps(1, [0, 0, 0], np.eye(3) * 0.02 + PRODUCT), (TensorProblem.TRIANGLE_INEQUALITY,)),
    ],
)
def test_check_names_what_is_wrong(body: MassProps, problems: tuple[TensorProblem, ...]) -> None:
    """Each way of being no rigid body has its name, and rounding is none."""
    found = set(body.check())
    assert set(problems) <= found
    assert bool(found) == bool(problems)


def as_body(v: InertialProperties) -> MassProps:
    """The tensor from its six elements."""
    return MassProps(v.mass, v.com, [[v.ixx, v.ixy, v.ixz], [v.ixy, v.iyy, v.iyz], [v.ixz, v.iyz, v.izz]])


def test_plain_type_round_trip() -> None:
    """InertialProperties there and back."""
    plain = InertialProperties(1.5, (0.1, 0.2, 0.3), 1.0, 2.0, 2.5, 0.1, 0.2, 0.3)
    assert as_body(plain).to_inertial() == plain


def test_values_are_frozen() -> None:
    """A result cannot be changed under somebody's hands."""
    with pytest.raises(ValueError, match="read-only"):
        props().com[0] = 1
