"""The cell as a MuJoCo model: the plant of the arm, the sliding tip, the workpiece, and what feels their contact."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import SimulationError
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.material import SkinConstraint, skin_constraint
from tauhat.simulation.contact.tool import TIP
from tauhat.simulation.contact.workpiece import WORKPIECE, add_workpiece, height
from tauhat.simulation.plant import build_plant
from tauhat.simulation.running import RunningPlant, started
from tauhat.simulation.touch_kernel import TOUCH_SIZE

SLIDE = "slide"
"""Name of the tip's joint, positive where the spring is pressed."""
_CONTACT = "contact"
# Friction rows are this much stiffer than normal ones, which are soft: a sticking tip creeps slower the more.
_FRICTION_OVER_NORMAL = 1e7
_TIP_GYRATION = 0.4  # squared radius of gyration of a ball over its squared radius


class Scene(NamedTuple):
    """A plant with tool and workpiece, in its start pose.

    running : the arm
    touch : (TOUCH_SIZE,) what the contact sensor tells, a view of MuJoCo's memory; zeros without a workpiece
    centre, axes : (3,), (9,) of the tip's sphere, views
    skin : the contact's row, or None without a workpiece
    """

    running: RunningPlant
    touch: FloatArray
    centre: FloatArray
    axes: FloatArray
    skin: SkinConstraint | None

    def harden(self, stiffness: float) -> None:
        """Give the skin another stiffness [N/m]."""
        if self.skin is not None:
            self.running.simulator.model.pair_solref[0] = self.skin.solref(stiffness)


def build_scene(cell: Cell, q: FloatArray) -> Scene:
    """Return the cell at rest in the pose q (n_v,), the tip's weight carried by the set of its spring.

    Raises
    ------
    SimulationError
        when the tip is inside the workpiece, or something is too stiff for the timestep.
    """

    def furnish(mujoco: Any, specification: Any) -> None:
        _add_tip(mujoco, specification, cell)
        if cell.surface is not None:
            add_workpiece(mujoco, specification, cell.surface)
            _add_contact(mujoco, specification, cell)

    plant = build_plant(cell.robot, parameters=cell.truth, timestep=cell.timestep, furnish=furnish)
    running = started(plant, q)
    _, model, data = running.simulator
    slide, tip = model.joint(SLIDE), model.geom(TIP).id
    held = float(data.qfrc_bias[slide.dofadr[0]])
    model.qpos_spring[slide.qposadr[0]] = held / cell.tool.stiffness
    centre, axes = data.geom_xpos[tip], data.geom_xmat[tip]
    if cell.surface is None:
        return Scene(running, np.zeros(TOUCH_SIZE), centre, axes, None)
    _refuse_inside(cell, centre)
    skin = skin_constraint(
        cell.material,
        mobility=float(model.body_invweight0[model.geom_bodyid[tip], 0]),
        tip_mass=cell.tool.tip_mass,
        timestep=cell.timestep,
    )
    model.pair_solimp[0], model.pair_solreffriction[0] = skin.solimp, skin.sliding_solref
    scene = Scene(running, data.sensordata, centre, axes, skin)
    scene.harden(cell.material.stiffness)
    return scene


def _add_tip(mujoco: Any, specification: Any, cell: Cell) -> None:
    tool, frame = cell.tool, cell.carrier
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(frame.rotation).ravel())
    body = specification.body(f"link_{frame.joint + 1}").add_body(
        name=TIP, pos=tool.tip_body(frame).centre, quat=quaternion
    )
    body.explicitinertial = True
    body.mass, body.ipos = tool.tip_mass, np.zeros(3)  # left out, MuJoCo takes `pos` again for the centre of mass
    body.inertia = np.full(3, _TIP_GYRATION * tool.tip_mass * tool.tip_radius**2)
    body.add_joint(
        name=SLIDE, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, -1.0], stiffness=tool.stiffness,
        damping=tool.damping,
    )  # fmt: skip
    body.add_geom(
        name=TIP, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[tool.tip_radius, 0.0, 0.0], contype=0, conaffinity=0
    )


def _add_contact(mujoco: Any, specification: Any, cell: Cell) -> None:
    """Let tip and workpiece touch, and nothing else."""
    option, kinds, data = specification.option, mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtConDataField
    option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = _FRICTION_OVER_NORMAL
    friction = cell.material.friction
    specification.add_pair(
        name=_CONTACT, geomname1=TIP, geomname2=WORKPIECE, condim=3 if friction > 0.0 else 1,
        friction=[friction, friction, 0.0, 0.0, 0.0],
    )  # fmt: skip
    told = (
        data.mjCONDATA_FOUND, data.mjCONDATA_FORCE, data.mjCONDATA_POS, data.mjCONDATA_NORMAL, data.mjCONDATA_TANGENT,
    )  # fmt: skip
    sensor = specification.add_sensor(
        name=_CONTACT, type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=kinds, objname=TIP, reftype=kinds,
        refname=WORKPIECE,
    )  # fmt: skip
    sensor.intprm = [sum(1 << int(field) for field in told), 0, 1]


def _refuse_inside(cell: Cell, centre: FloatArray) -> None:
    if cell.surface is None:
        return
    gap = height(cell.surface, centre) - cell.tool.tip_radius
    if gap < 0.0:
        raise SimulationError(
            "the tip starts inside the workpiece", where=cell.robot.name, expected="a gap >= 0 m", got=f"{gap:.3g} m",
            remedy="start farther out along the normal",
        )  # fmt: skip
