"""The torque of a whole model on traced numbers: links, rotors, springs, coupled motors, friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tauhat.arrays import FloatArray
from tauhat.export.parameters import StandardParameters
from tauhat.export.traced_dynamics import Speeds, traced_inverse_dynamics, traced_joints, traced_mass_matrix
from tauhat.export.traced_friction import traced_friction
from tauhat.export.traced_memory import DryStates
from tauhat.export.tracing import Scalar, Trace
from tauhat.robots.robot import Robot

_LOAD = "l"  # before the names of forces and moments that load the gears


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TracedModel:
    """A robot with its parameters inside one C function.

    inputs : names of the function's arguments of n_v numbers, among q, dq and ddq; the others are zero
    """

    trace: Trace
    robot: Robot
    parameters: StandardParameters
    inputs: tuple[str, ...]

    def argument(self, name: str) -> list[Scalar]:
        """Return an argument of the function, zeros where it has none of that name."""
        n_v = self.robot.n_v
        if name not in self.inputs:
            return [self.trace.scalar(0.0)] * n_v
        return [self.trace.variable(f"{name}[{index}]") for index in range(n_v)]

    def conservative(self) -> list[Scalar]:
        """Return the torque without friction."""
        ddq, parameters = self.argument("ddq"), self.parameters
        links = self._of_links(parameters.inertia, mark="")
        rotors = zip(links, parameters.rotor, ddq, self._of_springs(), strict=True)
        torques = [link + float(inertia) * acceleration + spring for link, inertia, acceleration, spring in rotors]
        for own, other, inertia in self._couplings():
            torques[own] = torques[own] + inertia * ddq[other]
            torques[other] = torques[other] + inertia * ddq[own]
        return torques

    def friction(self, dry: DryStates) -> tuple[Scalar, ...]:
        """Return the torque of friction, offsets in it."""
        return traced_friction(
            self.trace,
            self.parameters,
            self.argument("dq"),
            dry=dry,
            loads=lambda inertia: self._of_links(inertia, mark=_LOAD),
        )

    def whole(self, dry: DryStates) -> tuple[Scalar, ...]:
        """Return the torque with friction."""
        return tuple(part + other for part, other in zip(self.conservative(), self.friction(dry), strict=True))

    def mass_matrix(self) -> list[list[Scalar]]:
        """Return the mass matrix of links, rotors and coupled motors."""
        joints = traced_joints(self.trace, self.robot, self.parameters.inertia)
        matrix = traced_mass_matrix(self.trace, joints, self.parameters.rotor)
        for own, other, inertia in self._couplings():
            matrix[own][other] = matrix[other][own] = matrix[own][other] + inertia
        return matrix

    def _of_links(self, inertia: FloatArray, *, mark: str) -> tuple[Scalar, ...]:
        return traced_inverse_dynamics(
            self.trace,
            traced_joints(self.trace, self.robot, inertia),
            gravity=self.robot.gravity,
            speeds=Speeds(self.argument("dq"), self.argument("ddq")),
            mark=mark,
        )

    def _couplings(self) -> list[tuple[int, int, float]]:
        coupled = self.parameters.motors
        if coupled is None:
            return []
        pairs = zip(coupled.motors, coupled.inertia, strict=True)
        return [(motor.own, motor.other, float(motor.ratio * inertia)) for motor, inertia in pairs]

    def _of_springs(self) -> Sequence[Scalar]:
        q = self.argument("q")
        torques = [float(stiffness) * position for stiffness, position in zip(self.parameters.springs, q, strict=True)]
        loaded = self.parameters.gas_spring
        if loaded is not None:
            joint = loaded.spring.joint
            torques[joint] = torques[joint] + self._of_gas(q[joint])
        return torques

    def _of_gas(self, q: Scalar) -> Scalar:
        """Return `Gs A / (volume - stroke A) * D k sin(d) / l`, see `tauhat.dynamics.terms.drives.GasSpring`."""
        trace, loaded = self.trace, self.parameters.gas_spring
        if loaded is None:
            return trace.scalar(0.0)
        spring = loaded.spring
        turned, span = q + spring.angle, spring.distance * spring.lever
        square = spring.distance**2 + spring.lever**2 - (2.0 * span) * trace.call("cos", turned)
        length = trace.call("sqrt", square)
        stroke = length - (spring.distance - spring.lever)
        pull = (loaded.energy * spring.area * span) * trace.call("sin", turned)
        return pull / (length * (spring.volume - stroke * spring.area))
