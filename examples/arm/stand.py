# SPDX-License-Identifier: LGPL-2.1-or-later
"""Stands the arm on a floor in MuJoCo, and holds a pose for some seconds.

docs/first-hour/robotics-engineer.md uses it.

    python examples/arm/stand.py arm_filled.urdf [PICTURE.png]

Nothing holds the base: the arm stands on its plate, by its mass and centre of mass alone. Servos hold the
joints; what they need is printed. Needs ``pip install mujoco``; a picture needs EGL (``MUJOCO_GL=egl``).
"""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np

from silo.inertia.calculator import read_geometry
from silo.inertia.urdf import read_urdf

HERE = Path(__file__).parent
POSE = {"shoulder": -0.35, "elbow": 0.9, "wrist": 0.6}
"""Joint angles [rad] to hold."""

PLATE = (0.08, 0.08, 0.005)
"""Half sizes of the base plate [m], which stands on the floor."""

KP, KD = 40.0, 1.0
"""Servos: N m per rad, N m per rad/s."""

COLOURS = ((0.26, 0.52, 0.80), (0.92, 0.57, 0.20), (0.35, 0.65, 0.38), (0.80, 0.35, 0.35))
Z = [0, 0, 1]


def build(urdf: Path, step: Path = HERE / "arm.step") -> mujoco.MjSpec:
    """The URDF on a floor, with servos, and with the STEP file's shapes to look at."""
    spec = mujoco.MjSpec.from_file(str(urdf))
    spec.compiler.fusestatic = False  # the base is a body of its own, and free to fall over
    spec.compiler.discardvisual = False
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.timestep = 0.001
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1200, 900
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.5] * 3, [0.5] * 3
    spec.visual.scale.com = 0.12
    sky = spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        width=256, height=256,
    )  # fmt: skip
    sky.rgb1, sky.rgb2 = [0.93, 0.95, 0.97], [0.75, 0.80, 0.86]
    world = spec.worldbody
    world.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[6, 6, 0.1], rgba=[0.8, 0.82, 0.84, 1])
    world.add_light(pos=[0.6, -1.0, 2.0], dir=[-0.3, 0.5, -1.0])
    base = spec.body("base_link")
    base.add_freejoint()
    base.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=PLATE, pos=[0, 0, PLATE[2]], mass=0, rgba=[0, 0, 0, 0])
    for joint in POSE:
        servo = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=KP, kv=KD)
    add_shapes(spec, urdf, step)
    return spec


def add_shapes(spec: mujoco.MjSpec, urdf: Path, step: Path) -> None:
    """The parts of each first-level sub-assembly, in the axes of the link of the same name. Without mass."""
    frames = read_urdf(urdf).frames
    assembly = read_geometry(step)
    colours = dict(zip(frames, COLOURS, strict=False))
    for number, part in enumerate(assembly.instances):
        link, mesh = part.path[0], assembly.prototypes[part.prototype].mesh
        place = np.linalg.inv(frames[link]) @ part.transform
        points = mesh.vertices @ place[:3, :3].T + place[:3, 3]
        spec.add_mesh(name=f"part {number}", uservert=points.ravel(), userface=mesh.faces.ravel())
        geom = spec.body(link).add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"part {number}", mass=0)
        geom.contype = geom.conaffinity = 0
        geom.rgba = [*colours[link], 1]


def stand(spec: mujoco.MjSpec, seconds: float = 5.0) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """From upright into the pose, and then hold it."""
    model = spec.compile()
    data = mujoco.MjData(model)
    while data.time < seconds:
        # The targets move slowly in the first second: a servo that jumps throws the arm over.
        for joint, angle in POSE.items():
            data.actuator(joint).ctrl = angle * min(1.0, data.time)
        mujoco.mj_step(model, data)
    return model, data


def tilt(data: mujoco.MjData) -> float:
    """Angle between the base's z axis and upright [rad]."""
    return float(np.arccos(np.clip(data.body("base_link").xmat.reshape(3, 3)[:, 2] @ Z, -1, 1)))


def main() -> None:
    """Stand, and say how."""
    spec = build(Path(sys.argv[1]))
    model, data = stand(spec)
    x, y, _ = data.subtree_com[0]
    print(f"mass {sum(model.body_mass):.6g} kg")
    print(f"centre of mass over the plate at x = {1e3 * x:.1f} mm, y = {1e3 * y:.1f} mm")
    print(f"the base leans {np.degrees(tilt(data)):.2f}°")
    for joint, angle in POSE.items():
        off = np.degrees(data.joint(joint).qpos[0] - angle)
        print(f"{joint:9} holds {data.actuator(joint).force[0]:+.3f} N m, {off:+.2f}° off")
    if len(sys.argv) > 2:
        picture(model, data, Path(sys.argv[2]))


def picture(model: mujoco.MjModel, data: mujoco.MjData, path: Path) -> None:
    """What MuJoCo shows, as a PNG."""
    from PIL import Image

    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = [0, 0.0, 0.33], 1.35, 140, -15
    options = mujoco.MjvOption()
    options.flags[mujoco.mjtVisFlag.mjVIS_COM] = True
    with mujoco.Renderer(model, 900, 1200) as renderer:
        renderer.update_scene(data, camera, options)
        Image.fromarray(renderer.render()).save(path)


if __name__ == "__main__":
    main()
