"""Robots, motions and recordings with a known truth, made for tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tauhat.arrays import FloatArray
from tauhat.dynamics import Coulomb, Motion, TorqueModel, torque_model
from tauhat.recordings.recording import Recording
from tauhat.robots import Joint, Limits, Robot, inertia_at_origin

PLANAR = ((1.2, 0.5, 0.21, 0.031), (0.8, 0.4, 0.17, 0.019))  # mass [kg], length [m], centre [m], Izz at centre [kg m^2]
WIDTHS = (0.05, 0.08)
WORKING_POSES = {  # of built-in robots, [rad]: within reach of the table, away from singularities
    "ur5e": np.array([0.0, -1.3, 1.6, -1.8, -1.4, 0.0]),
    "crs_a465": np.array([0.2, 0.3, 1.2, 0.1, 1.0, 0.0]),
    "panda": np.array([0.0, -0.4, 0.2, -1.9, 0.1, 1.7, 0.7]),
}


def random_inertia(rng: np.random.Generator) -> FloatArray:
    """Return physically consistent standard parameters: a random cloud of point masses, boiled down."""
    points = rng.normal(size=(8, 3)) * 0.1
    masses = rng.uniform(0.1, 0.6, 8)
    com = masses @ points / masses.sum()
    arms = points - com
    central = np.einsum("k,kij->ij", masses, np.einsum("ki,ki,jl->kjl", arms, arms, np.eye(3)))
    central -= np.einsum("k,ki,kj->ij", masses, arms, arms)
    return inertia_at_origin(mass=float(masses.sum()), com=com, inertia_at_com=central)


def random_joint(rng: np.random.Generator, *, index: int, parent: int, kind: str) -> Joint:
    axis = rng.normal(size=3)
    return Joint(
        name=f"j{index}",
        kind=kind,
        parent=parent,
        rotation=Rotation.from_rotvec(rng.normal(size=3)).as_matrix(),
        translation=rng.normal(size=3) * 0.4,
        axis=axis / np.linalg.norm(axis),
        inertia=random_inertia(rng),
    )


def random_tree(rng: np.random.Generator, n_v: int, *, branching: float = 0.4, sliding: float = 0.3) -> Robot:
    """Return a tree in any topological order: arbitrary axes, placements and gravity, branches, prismatic joints."""
    joints = []
    for index in range(n_v):
        parent = int(rng.integers(-1, index)) if rng.random() < branching else index - 1
        kind = "prismatic" if rng.random() < sliding else "revolute"
        joints.append(random_joint(rng, index=index, parent=parent, kind=kind))
    return Robot(name="tree", joints=tuple(joints), gravity=rng.normal(size=3) * 6.0)


def chain(rng: np.random.Generator, kinds: str) -> Robot:
    """Return a serial arm, one letter a joint: R or P."""
    names = {"R": "revolute", "P": "prismatic"}
    joints = [random_joint(rng, index=k, parent=k - 1, kind=names[letter]) for k, letter in enumerate(kinds)]
    return Robot(name=kinds, joints=tuple(joints))


def planar_arm(*, gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)) -> Robot:
    """Return the two-link arm of the textbooks: axes along z, links along x, moving in the x-y plane."""
    joints = []
    for index, (mass, _, centre, about) in enumerate(PLANAR):
        com = np.array([centre, 0.0, 0.0])
        inertia = inertia_at_origin(mass=mass, com=com, inertia_at_com=np.diag([0.01, about, about]))
        place = np.array([PLANAR[0][1], 0.0, 0.0]) if index else np.zeros(3)
        joints.append(
            Joint(
                name=f"j{index + 1}",
                kind="revolute",
                parent=index - 1,
                rotation=np.eye(3),
                translation=place,
                axis=np.array([0.0, 0.0, 1.0]),
                inertia=inertia,
                limits=Limits(velocity=3.0),
            )
        )
    return Robot(name="planar", joints=tuple(joints), gravity=np.array(gravity))


def random_states(rng: np.random.Generator, n_t: int, n_v: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    return rng.uniform(-3, 3, (n_t, n_v)), rng.normal(size=(n_t, n_v)), rng.normal(size=(n_t, n_v)) * 3


def smooth_motion(n_v: int, t: FloatArray, *, seed: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return q, dq, ddq (n_t, n_v) of sums of sines below 1 Hz, exact derivatives."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * rng.uniform(0.1, 0.9, (5, n_v))
    size, phase = rng.uniform(0.4, 1.0, (5, n_v)) / omega, rng.uniform(0, 2 * np.pi, (5, n_v))
    angle = omega * t[:, None, None] + phase
    q, dq, ddq = size * np.sin(angle), size * omega * np.cos(angle), -size * omega**2 * np.sin(angle)
    return q.sum(axis=1), dq.sum(axis=1), ddq.sum(axis=1)


def motion_from_rest(
    n_v: int, t: FloatArray, *, seed: int = 0, ramp: float = 1.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the smooth motion run along a time that starts and stops gently: at rest at both ends."""
    passed, left = t - t[0], t[-1] - t
    rising, falling = np.clip(passed / ramp, 0, 1), np.clip(left / ramp, 0, 1)
    pace = (3 * rising**2 - 2 * rising**3) * (3 * falling**2 - 2 * falling**3)
    change = (6 * rising * (1 - rising) - 6 * falling * (1 - falling)) / ramp
    own_time = passed - ramp * (rising - rising**3 + rising**4 / 2)
    own_time -= ramp * (0.5 - falling + falling**3 - falling**4 / 2)
    q, dq, ddq = smooth_motion(n_v, own_time, seed=seed)
    return q, dq * pace[:, None], ddq * pace[:, None] ** 2 + dq * change[:, None]


@dataclass(frozen=True)
class Truth:
    """A planar arm with friction whose every parameter is known."""

    model: TorqueModel
    standard: FloatArray

    def torque(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return the noise-free torque (n_t, n_v)."""
        layout = self.model.layout()
        columns, _ = self.model.columns(Motion(q=q.T.copy(), dq=dq.T.copy(), ddq=ddq.T.copy()), layout)
        weights = self.standard[layout.parameters]
        rows = [layout.of_joint(joint) for joint in range(self.model.robot.n_v)]
        return np.array([weights[part] @ columns[part] for part in rows]).T

    def recording(self, *, seed: int = 0, seconds: float = 20.0, rate: float = 200.0, noise: object = 0.0) -> Recording:
        """Return a motion from rest to rest with its torque; `noise` is added to the torque."""
        t = np.arange(0.0, seconds, 1.0 / rate)
        q, dq, ddq = motion_from_rest(self.model.robot.n_v, t, seed=seed)
        return Recording(t=t, q=q, dq=dq, tau=self.torque(q, dq, ddq) + noise, name=f"run {seed}")


def planar_truth() -> Truth:
    robot = planar_arm()
    plain = torque_model(robot)
    terms = tuple(Coulomb(widths=WIDTHS) if term.key == "coulomb" else term for term in plain.terms)
    friction = [0.05, 0.02, 0.9, 0.5, 1.4, 0.7, 0.3, -0.2]  # Ia, Fv, Fc, To of both joints
    return Truth(TorqueModel(robot=robot, terms=terms), np.concatenate([robot.inertia.ravel(), friction]))


def autocorrelated_noise(
    rng: np.random.Generator, shape: tuple[int, int], *, time_constant: float, rate: float
) -> FloatArray:
    """Return first-order autoregressive noise of unit deviation."""
    from scipy.signal import lfilter

    pole = np.exp(-1.0 / (time_constant * rate))
    white = rng.normal(size=(shape[0] + round(10 * time_constant * rate), shape[1]))
    return lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], white, axis=0)[-shape[0] :]
