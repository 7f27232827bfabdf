"""A plant as flat arrays: what the step kernel reads and writes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.simulation import rows as r
from tauhat.simulation.laws import SharedDrive
from tauhat.simulation.laws.program import Program, compiled, initial_memory
from tauhat.simulation.native import NativeFunctions
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.touch_kernel import ELSEWHERE, SLIDES, TURNS

_SLIDE = 2  # MuJoCo's number of a joint that slides, `mjJNT_SLIDE`


class Engine(NamedTuple):
    """MuJoCo as a kernel sees it: addresses, and views of the model's and the data's own memory.

    step, forward, implicit : addresses of the functions; zero without native ones
    model, data : addresses of what they take
    dof : (n_v,) index of each joint of the robot among MuJoCo's
    touch : (TOUCH_SIZE,) the contact sensor, of `touch_kernel`; empty where nothing can touch
    carriers : (n_v,) what each joint is to the body that touches
    axes, anchors : (n_joints, 3) of MuJoCo's joints, in base axes, at the last step's begin
    """

    step: int
    forward: int
    implicit: int
    model: int
    data: int
    dof: IntArray
    qpos: FloatArray
    qvel: FloatArray
    qacc: FloatArray
    applied: FloatArray
    smooth: FloatArray
    constraint: FloatArray
    touch: FloatArray
    carriers: IntArray
    axes: FloatArray
    anchors: FloatArray
    damping: FloatArray
    dryness: FloatArray


class Drives(NamedTuple):
    """Constants of the drives.

    timestep : [s]
    elastic : whether any joint is
    rows : (SHARED + n_v, n_v), of which the properties are views
    """

    timestep: float
    elastic: bool
    rows: FloatArray

    @property
    def offset(self) -> FloatArray:
        """As in `TrueParameters`, like the three below."""
        return np.asarray(self.rows[r.OFFSET])

    @property
    def viscous(self) -> FloatArray:
        """Of the plant's own friction."""
        return np.asarray(self.rows[r.OWN_VISCOUS])

    @property
    def coulomb(self) -> FloatArray:
        """Of the plant's own friction."""
        return np.asarray(self.rows[r.OWN_COULOMB])

    @property
    def rotor(self) -> FloatArray:
        """Inertia of the rotors."""
        return np.asarray(self.rows[r.ROTOR])

    @property
    def stiffness(self) -> FloatArray:
        """Of elastic transmissions; zero marks a rigid joint."""
        return np.asarray(self.rows[r.STIFFNESS])

    @property
    def spring_damping(self) -> FloatArray:
        """Of elastic transmissions."""
        return np.asarray(self.rows[r.SPRING_DAMPING])

    @property
    def half_gap(self) -> FloatArray:
        """Of elastic transmissions."""
        return np.asarray(self.rows[r.HALF_GAP])

    @property
    def shared(self) -> FloatArray:
        """Inertia of motors that turn with two joints, (n_v, n_v)."""
        return np.asarray(self.rows[r.SHARED :])


class Warming(NamedTuple):
    """Constants of the thermal states.

    active : whether temperatures change at all
    ambient, reference : [deg C]
    rows : what is left of a difference of temperature after a step; rise [K/J]; and relative changes of viscous,
        Coulomb and the laws' friction [1/K]
    """

    active: bool
    ambient: float
    reference: float
    rows: FloatArray


class Machine(NamedTuple):
    """Everything that does not change while a plant runs."""

    engine: Engine
    drives: Drives
    warming: Warming
    program: Program


class MachineState(NamedTuple):
    """What changes.

    rows : (STATE_ROWS, n_v): see `rows`
    memory : (n_rows, n_v) of the laws
    """

    rows: FloatArray
    memory: FloatArray

    @property
    def shaft(self) -> FloatArray:
        """Where the motors are now, on the joint side; the joints' own position where they are rigid."""
        return np.asarray(self.rows[r.SHAFT])

    @property
    def shaft_dq(self) -> FloatArray:
        """How fast the motors turn now."""
        return np.asarray(self.rows[r.SHAFT_DQ])

    @property
    def load(self) -> FloatArray:
        """Size of the rigid-body torque through the gear."""
        return np.asarray(self.rows[r.LOAD])

    @property
    def temperature(self) -> FloatArray:
        """Temperature now [deg C]."""
        return np.asarray(self.rows[r.WARMTH])

    @property
    def pushed(self) -> FloatArray:
        """Torque that the environment adds, held until it is set again."""
        return np.asarray(self.rows[r.PUSHED])


def drives_of(truth: TrueParameters, timestep: float) -> Drives:
    """Return the constants of the drives."""
    n_v, elastic = truth.n_v, truth.elasticity
    rows = np.zeros((r.SHARED + n_v, n_v))
    rows[r.OFFSET], rows[r.OWN_VISCOUS], rows[r.OWN_COULOMB] = truth.offset, truth.viscous, truth.coulomb
    rows[r.ROTOR] = truth.rotor
    if elastic is not None:
        rows[r.STIFFNESS] = elastic.spread(elastic.stiffness, n_v)
        rows[r.SPRING_DAMPING] = elastic.spread(elastic.damping, n_v)
        rows[r.HALF_GAP] = elastic.spread(0.5 * elastic.gap, n_v)
    for law in truth.laws:
        if isinstance(law, SharedDrive):
            rows[r.SHARED :] += law.inertia_matrix(n_v)
    return Drives(timestep, elastic is not None, np.asarray(read_only(rows)))


def warming_of(truth: TrueParameters, timestep: float) -> Warming:
    """Return the constants of the thermal states, which stay put and change nothing where the truth has none."""
    heat = truth.heat
    rows = np.zeros((r.SLOPES + 2 + len(truth.laws), truth.n_v))
    if heat is None:
        return Warming(False, 0.0, 0.0, np.asarray(read_only(rows)))
    rows[r.DECAY] = np.exp(-timestep / heat.time_constant)
    # A step's heat arrives evenly over the step and cools while it does.
    rows[r.RISE] = heat.heating * (1.0 - rows[r.DECAY]) * heat.time_constant / timestep
    rows[r.SLOPES], rows[r.SLOPES + 1] = heat.viscous, heat.coulomb
    rows[r.SLOPES + 2 : r.SLOPES + 2 + len(heat.laws)] = heat.laws
    return Warming(True, heat.ambient, heat.reference, np.asarray(read_only(rows)))


def engine_of(model: Any, data: Any, dof: IntArray, native: NativeFunctions | None) -> Engine:
    """Return MuJoCo's memory as views; without native functions all addresses are zero."""
    step, forward, implicit = native or (0, 0, 0)
    return Engine(
        step=step,
        forward=forward,
        implicit=implicit,
        model=model._address if native else 0,  # noqa: SLF001 (the only way to the C struct)
        data=data._address if native else 0,  # noqa: SLF001
        dof=dof,
        qpos=data.qpos,
        qvel=data.qvel,
        qacc=data.qacc,
        applied=data.qfrc_applied,
        smooth=data.qfrc_smooth,
        constraint=data.qfrc_constraint,
        touch=data.sensordata,
        carriers=_carriers(model, dof),
        axes=data.xaxis,
        anchors=data.xanchor,
        damping=model.dof_damping,
        dryness=model.dof_frictionloss,
    )


def _carriers(model: Any, dof: IntArray) -> IntArray:
    """Return what each joint is to the body whose contact the model's sensor tells, (n_v,)."""
    carriers = np.full(dof.size, ELSEWHERE, dtype=np.intp)
    body = int(model.geom_bodyid[model.sensor_objid[0]]) if model.nsensor else 0
    while body > 0:
        own = model.dof_bodyid[dof] == body
        carriers[own] = np.where(model.jnt_type[dof[own]] == _SLIDE, SLIDES, TURNS)
        body = int(model.body_parentid[body])
    return carriers


def machine_of(truth: TrueParameters, engine: Engine, timestep: float) -> Machine:
    """Return what the kernel needs of a plant."""
    return Machine(engine, drives_of(truth, timestep), warming_of(truth, timestep), compiled(truth.laws, truth.n_v))


def machine_state(truth: TrueParameters) -> MachineState:
    """Return a state of rest at position zero."""
    state = MachineState(np.zeros((r.STATE_ROWS, truth.n_v)), initial_memory(truth.laws, truth.n_v))
    if truth.heat is not None:
        state.temperature[:] = truth.heat.initial
    return state
