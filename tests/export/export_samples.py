"""Parameters, a hand-made URDF and the two oracles that the export tests share."""

# ruff: noqa: E501 (the lines of a URDF)

from __future__ import annotations

import re

import numpy as np
import pinocchio as pin

from tauhat.arrays import FloatArray
from tauhat.dynamics import TorqueModel, base_parameters
from tauhat.estimation import Estimate
from tauhat.export import FrictionLaw, StandardParameters
from tauhat.recordings.processing import Processing
from tauhat.robots import Robot
from tauhat.simulation import perturbed

# A plate and a camera bolted on, a gripper's finger, comments, both kinds of quotes, a link without inertial.
URDF = """<?xml version='1.0' encoding="utf-8"?>
<!-- Ein Arm für Prüfungen; <link name="not_a_link"> -->
<robot name="made">
  <link name="world"/>
  <link name="base"><inertial><mass value="7"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="upper">
    <visual><geometry><box size="0.1 0.1 0.3"/></geometry></visual>
    <inertial>
      <!-- from CAD -->
      <mass   value = '4.0' />
      <origin rpy="0.3 -0.2 0.5" xyz="0.03 -0.02 0.11"/>
      <inertia izz="0.012" ixx='0.031' iyy="0.027"  ixy="0.002" ixz="-0.001" iyz="0.003"></inertia>
    </inertial>
  </link>
  <link name="plate">
    <collision><geometry><box size="0.2 0.2 0.02"/></geometry></collision>
  </link>
  <link name="camera">
    <inertial>
      <mass value="0.4"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/>
    </inertial>
  </link>
  <link name="fore" />
  <link name="hand">
    <inertial>
      <origin xyz="0 0.01 0.05"/>
      <mass value="1.5"/>
      <inertia ixx="0.004" ixy="0.0001" ixz="0" iyy="0.003" iyz="0" izz="0.002"/>
    </inertial>
  </link>
  <link name="finger"><inertial><origin xyz="0 0 0.02" rpy="0 0.4 0"/><mass value="0.1"/><inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0001"/></inertial></link>
  <link name="nail"><inertial><mass value="0.01"/><inertia ixx="1e-6" ixy="0" ixz="0" iyy="1e-6" iyz="0" izz="1e-6"/></inertial></link>
  <joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>
  <joint name="waist" type="continuous">
    <parent link="base"/><child link="upper"/><origin xyz="0.1 0 0.2" rpy="0.4 -0.7 1.1"/><axis xyz="0 0 2"/>
    <dynamics friction='0.7' damping="1.5" armature="0.2"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="plate"/><child link="fore"/><origin xyz="0 0.3 0.1" rpy="1.5707963267948966 0 0"/><axis xyz="0.6 0 -0.8"/>
    <limit lower="-1" upper="1" effort="60" velocity="3"/>
  </joint>
  <joint name="turn" type="revolute"><parent link="fore"/><child link="hand"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="6" velocity="3"/></joint>
  <joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/><origin xyz="0 0 0.1" rpy="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="0" upper="0.1" effort="6" velocity="3"/></joint>
  <joint name="bolt" type="fixed"><parent link="upper"/><child link="plate"/><origin xyz="0 0 0.4" rpy="0 0.2 0"/></joint>
  <joint name="screw" type="fixed"><parent link="plate"/><child link="camera"/><origin xyz="0.1 0 0" rpy="0.1 0 0"/></joint>
  <joint name="glue" type="fixed"><parent link="finger"/><child link="nail"/><origin xyz="0 0 0.03"/></joint>
  <transmission name="t"><joint name="waist"><hardwareInterface>x</hardwareInterface></joint></transmission>
  <gazebo><![CDATA[ <inertial> & ]]></gazebo>
</robot>
"""

_SOLID = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
SOLID_URDF = URDF.replace('<link name="fore" />', f'<link name="fore">{_SOLID}</link>')


def some_parameters(robot: Robot, *, seed: int = 0) -> StandardParameters:
    """Return physical parameters that are not the nominal ones, all different."""
    rng = np.random.default_rng(seed)
    return StandardParameters(
        inertia=perturbed(robot, rng, spread=0.2).inertia,
        rotor=rng.uniform(0.1, 1.0, robot.n_v),
        friction=(
            FrictionLaw(key="viscous", coefficients=rng.uniform(0.5, 3.0, (1, robot.n_v))),
            FrictionLaw(
                key="coulomb",
                coefficients=rng.uniform(0.5, 3.0, (1, robot.n_v)),
                shape=rng.uniform(0.01, 0.1, robot.n_v),
            ),
        ),
    )


def every_value(model: TorqueModel, rng: np.random.Generator) -> FloatArray:
    """Return standard parameters of a model: links that are bodies, all else between a half and two."""
    links = [index for index, term in enumerate(model.terms) for _ in term.parameters(model.robot) if not index]
    rest = rng.uniform(0.5, 2.0, model.n_p - len(links))
    return np.concatenate([perturbed(model.robot, rng, spread=0.2).inertia.ravel(), rest])


def estimate_of(model: TorqueModel, standard: FloatArray, *, deviation: float = 0.01) -> Estimate:
    """Return an estimate with these parameters and equal standard errors."""
    base = base_parameters(model)
    return Estimate(
        model=model,
        base=base,
        values=base.projection @ standard,
        covariance=deviation**2 * np.eye(base.n_b),
        degrees=1000,
        processing=Processing(cutoff=10.0, motion_cutoff=30.0),
        estimator={"name": "wls"},
        joint_rms=np.ones(model.robot.n_v),
        torque_rms=np.ones(model.robot.n_v),
        rank=base.n_b,
        condition=1.0,
        inputs=(),
        standard=standard,
    )


def states(robot: Robot, count: int = 20) -> tuple[FloatArray, FloatArray, FloatArray]:
    q, dq, ddq = np.random.default_rng(5).normal(size=(3, count, robot.n_v))
    return q, dq, 3.0 * ddq


def without_shapes(urdf: str) -> str:
    """Return the URDF without geometry, whose mesh files are not there."""
    return re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf, flags=re.DOTALL)


def pinocchio_torque(model: pin.Model, robot: Robot, motion: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """Return Pinocchio's torques of a model read from URDF, joints by name, all others still at zero."""
    data = model.createData()
    model.armature[:] = 0.0
    joints = [model.joints[model.getJointId(name)] for name in robot.joint_names]
    torque = []
    for q, dq, ddq in zip(*motion, strict=True):
        whole_q, whole_v, whole_a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for joint, position, speed, acceleration in zip(joints, q, dq, ddq, strict=True):
            turned = (np.cos(position), np.sin(position)) if joint.nq == 2 else position
            whole_q[joint.idx_q : joint.idx_q + joint.nq] = turned
            whole_v[joint.idx_v], whole_a[joint.idx_v] = speed, acceleration
        whole = pin.rnea(model, data, whole_q, whole_v, whole_a)
        torque.append([whole[joint.idx_v] for joint in joints])
    return np.array(torque)


def mujoco_torque(text: str, robot: Robot, motion: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """Return what `mj_inverse` of an MJCF or URDF says without dry friction, which it only approximates."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT) | int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(model)
    places = [int(model.joint(name).dofadr[0]) for name in robot.joint_names]
    torque = []
    for q, dq, ddq in zip(*motion, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = 0.0, 0.0, 0.0
        data.qpos[places], data.qvel[places], data.qacc[places] = q, dq, ddq
        mujoco.mj_inverse(model, data)
        torque.append(data.qfrc_inverse[places].copy())
    return np.array(torque)


def largest_relative(found: FloatArray, expected: FloatArray) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())
