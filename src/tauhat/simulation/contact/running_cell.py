"""A cell in motion: references in, one sample period later what the controller's log shows, and the truth behind it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, frozen, read_only
from tauhat.errors import SimulationError
from tauhat.simulation import rows as r
from tauhat.simulation.closed_loop import silent
from tauhat.simulation.contact import contact_kernel as c
from tauhat.simulation.contact.cell import Cell
from tauhat.simulation.contact.joint_control import FeedforwardTorque
from tauhat.simulation.contact.load_cell import LoadCellReader
from tauhat.simulation.contact.reference_sample import reference_sample
from tauhat.simulation.contact.scene import SLIDE, Scene, build_scene
from tauhat.simulation.contact.sensor_stream import LINK, MOTOR, Sampling, SensorStream
from tauhat.simulation.contact.steering import Steering, Tally, steering_of, tally_of
from tauhat.simulation.contact.worked_heat import FrictionPower, constant_power, friction_power, warmed
from tauhat.simulation.contact.workpiece import arc_length
from tauhat.simulation.loop_kernel import FINE
from tauhat.simulation.running import RunningPlant


class CellSample(NamedTuple):
    """What there is to see at the end of a sample period; beside the log and the load cell, all of it is the truth.

    t : time stamp of the log's row [s]
    q, tau : (n_v,) of the log: the torque is the one that starts at the sample [rad or m, Nm or N]
    normal_force : mean over the period, along the outward normal, positive: the workpiece pushes the tool out [N]
    force : (3,) mean over the period, on the tool, in base axes, with friction [N]
    load_cell : the normal force with the load cell's errors [N]
    tip : (3,) foremost point of the tip, in the base frame [m]
    contact : whether the tip touches at the end of the period
    temperature : (n_v,) of the joints [deg C]; zero where the plant has no heat
    fresh : whether the log got this row; otherwise t, q and tau are the last row's
    """

    t: float
    q: FloatArray
    tau: FloatArray
    normal_force: float
    force: FloatArray
    load_cell: float
    tip: FloatArray
    contact: bool
    temperature: FloatArray
    fresh: bool


class RunningCell:
    """A cell with its state; made by `start_cell`, changed by `advance`, `rest` and `worked`."""

    __slots__ = (
        "_ahead", "_cell", "_guide", "_load_cell", "_offset", "_passed", "_sample", "_scene", "_steering", "_stream",
        "_tally", "_worked",
    )  # fmt: skip

    def __init__(self, cell: Cell, scene: Scene, rng: np.random.Generator) -> None:
        q, _ = scene.running.state
        arm, force = rng.spawn(2)
        nothing = np.zeros(cell.robot.n_v)
        self._cell, self._scene = cell, scene
        self._ahead = FeedforwardTorque(cell.control, cell.known_robot)
        torque = self._ahead.at(q, nothing, nothing)
        self._steering: Steering = steering_of(cell, scene.running, torque)
        self._tally: Tally = tally_of(cell, scene.touch)
        self._guide = np.array([q, nothing, torque, q, nothing, torque])
        self._offset = np.array([0.0, 0.0, cell.tool.tip_radius])
        self._load_cell = LoadCellReader(cell.load_cell, force)
        self._passed, self._worked = 0.0, 0.0
        scene.running.memory.rows[r.TAU] = torque
        for _ in range(round(cell.settle * cell.sample_rate)):
            self._pass()
        self._passed = 0.0
        self._stream = self._sensors(arm)
        self.begin_work()
        self._sample = self._look()

    @property
    def cell(self) -> Cell:
        """The settings."""
        return self._cell

    @property
    def plant(self) -> RunningPlant:
        """The arm, with its true state."""
        return self._scene.running

    @property
    def sample(self) -> CellSample:
        """The last sample; before the first `advance`, that of the start."""
        return self._sample

    @property
    def time(self) -> float:
        """The cell's own clock, with rests and work passed in one step [s]; sensors may stamp later."""
        return self._passed

    @property
    def reference(self) -> FloatArray:
        """The last reference position, (n_v,) [rad or m]; before the first `advance`, the start pose."""
        return np.array(self._guide[c.TO_Q])

    @property
    def compression(self) -> float:
        """How far the tool's spring is pressed from where the cell started [m]."""
        return float(self._scene.running.simulator.data.joint(SLIDE).qpos[0])

    def advance(self, q_ref: FloatArray, dq_ref: FloatArray) -> CellSample:
        """Pass one sample period, at whose end the arm shall be at this reference, and return its sample.

        Between this reference and the last one, the controller follows the cubic through both.

        Parameters
        ----------
        q_ref, dq_ref : (n_v,) [rad or m, and per second]

        Raises
        ------
        ArrayError
            when a reference is not finite or not of this arm.
        SimulationError
            when the arm or the tip goes unstable.
        """
        guide, shape = self._guide, (self._cell.robot.n_v,)
        q_ref, dq_ref = frozen("q_ref", q_ref, shape), frozen("dq_ref", dq_ref, shape)
        guide[: c.TO_Q] = guide[c.TO_Q :]
        ddq_ref = (dq_ref - guide[c.FROM_DQ]) * self._cell.sample_rate
        guide[c.TO_Q], guide[c.TO_DQ] = q_ref, dq_ref
        guide[c.TO_TORQUE] = self._ahead.at(q_ref, dq_ref, ddq_ref)
        self._pass()
        self._stream.note(self._tally.heard)
        self._sample = self._look()
        return self._sample

    def begin_work(self) -> None:
        """Let the stretch of work begin here whose friction `friction_power` tells."""
        self._tally.work[:] = 0.0
        self._worked = 0.0

    @property
    def friction_power(self) -> FrictionPower:
        """What friction turned to heat since `begin_work`, joint by joint.

        Raises
        ------
        SimulationError
            when the plant has no heat, or no time has passed.
        """
        heat = self._cell.truth.heat
        if heat is None or self._worked == 0.0:
            what = "no heat in this plant" if heat is None else "no work since it was begun"
            raise SimulationError(what, where=self._cell.robot.name, remedy="give it heat, and let it move")
        return friction_power(heat, self._tally.work, self._worked)

    def rest(self, seconds: float) -> None:
        """Let the arm stand in its place and cool; joints and tip stay as they are, the clock goes on.

        Raises
        ------
        SimulationError
            when the time is negative.
        """
        self.worked(seconds, constant_power(np.zeros(self._cell.robot.n_v)))

    def worked(self, seconds: float, power: FrictionPower | None = None) -> None:
        """Let the arm have worked on and be back in its place: joints warm as an exponential, the clock goes on.

        Parameters
        ----------
        seconds : of work [s]
        power : of its friction; that since `begin_work` by default

        Raises
        ------
        SimulationError
            when the time is negative, or there is no power to go on with.
        """
        if not 0.0 <= seconds < np.inf:
            raise SimulationError("a time of work", where="cell", expected=">= 0 s", got=seconds)
        power = self.friction_power if power is None else power
        heat, now = self._cell.truth.heat, self.plant.memory.temperature
        if heat is not None:
            now[:] = warmed(heat, now, power, seconds=seconds)
        self._passed += seconds

    def _pass(self) -> None:
        """Pass one sample period."""
        running, steering, tally = self._scene.running, self._steering, self._tally
        self._harden()
        with silent(running.simulator.mujoco):
            if running.native:
                memory = running.memory
                end = c.pass_sample(running.machine, memory.rows, memory.memory, steering, self._guide, tally)
            else:
                end = reference_sample(running, steering, self._guide, tally)
        if end != FINE:
            raise self._runaway(self._passed + (end + 1) * steering.period)
        self._passed += steering.sample_period
        self._worked += steering.sample_period

    def _harden(self) -> None:
        """Give the skin the stiffness of the place where the tip is."""
        cell = self._cell
        if cell.surface is not None and cell.material.regions:
            self._scene.harden(cell.material.stiffness_at(arc_length(cell.surface, self._scene.centre)))

    def _look(self) -> CellSample:
        running, felt, scene = self._scene.running, self._tally.felt, self._scene
        # MuJoCo's places are those of the begin of its last step.
        running.simulator.mujoco.mj_kinematics(running.simulator.model, running.simulator.data)
        steps = max(felt[c.STEPS], 1.0)
        normal = float(felt[c.NORMAL_SUM] / steps)
        t = self._passed
        shown = self._stream.show(t)
        return CellSample(
            t=shown.t,
            q=shown.q,
            tau=shown.tau,
            normal_force=normal,
            force=read_only(felt[c.FORCE_SUM : c.FORCE_SUM + 3] / steps),
            load_cell=self._load_cell.read(t, normal),
            tip=read_only(scene.centre + scene.axes.reshape(3, 3) @ self._offset),
            contact=bool(felt[c.TOUCHES]),
            temperature=read_only(running.temperature),
            fresh=shown.fresh,
        )

    def _sensors(self, rng: np.random.Generator) -> SensorStream:
        cell, running = self._cell, self._scene.running
        rows = running.memory.rows
        on_link = cell.sensors.torque_side == "link"
        torque = rows[r.GEAR] if on_link else rows[r.TAU]
        return SensorStream(
            cell.sensors,
            sampling=Sampling(
                sample_period=self._steering.sample_period,
                control_period=self._steering.period,
                side=MOTOR if cell.encoder.side == "motor" else LINK,
                behind=cell.timestep if on_link else 0.0,
            ),
            first=np.array([running.state[0], running.motor_state[0], torque]),
            rng=rng,
        )

    def _runaway(self, t: float) -> SimulationError:
        data, dof, robot = self._scene.running.simulator.data, self._scene.running.plant.dof, self._cell.robot
        speeds = np.abs(np.append(data.qvel[dof], data.joint(SLIDE).qvel[0]))
        worst = int(np.argmax(np.where(np.isfinite(speeds), speeds, np.inf)))
        of_tip = worst == robot.n_v
        joint = robot.joints[min(worst, robot.n_v - 1)]
        return SimulationError(
            "the tool's tip went unstable" if of_tip else "the simulated robot went unstable",
            where=f"{robot.name}, {'tip' if of_tip else f'joint {joint.name}'}",
            got=f"{speeds[worst]:.3g} {'m' if of_tip else joint.unit}/s at t = {t:.4g} s",
            remedy="soften tool or material, or shorten the timestep" if of_tip
            else "check the references, lower the bandwidth or shorten the timestep",
        )  # fmt: skip


def start_cell(cell: Cell, q: FloatArray, *, rng: np.random.Generator) -> RunningCell:
    """Return the cell at rest in the pose q (n_v,), after the robot has held it for `cell.settle`; its clock is at 0.

    Parameters
    ----------
    rng : of the sensors; equal ones give equal runs

    Raises
    ------
    SimulationError
        when the tip starts inside the workpiece, something is too stiff, sensors do not fit, or the arm is unstable.
    """
    start = frozen("q", q, (cell.robot.n_v,), where=cell.robot.name)
    return RunningCell(cell, build_scene(cell, start), rng)
