"""How large a model's own friction is, joint by joint: what an observer scales when friction has changed."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.passive_kernel import passive_kernel
from tauhat.dynamics.rigid_body import gravity_torque
from tauhat.sensing.sensed_model import STANDING, SensedModel

_LOOKED_AT = (0.2, 0.8)  # of the top speed: where friction is split into a dry and a viscous part


def own_friction(model: SensedModel) -> FloatArray:
    """Return dry and viscous friction of each joint, (n_v, 2) [Nm or N, Nm s/rad or N s/m], none of them driving.

    Half the difference of both directions where the joint moves alone, bristles bent to their end, at two speeds. The
    load of load-dependent friction is the mean weight at random positions.
    """
    tops = model.slow / STANDING
    load = np.abs(gravity_torque(model.robot, model.random_positions, inertia=model.inertia)).mean(axis=0)
    low, high = (_resistance(model, part * tops, load) for part in _LOOKED_AT)
    viscous = np.maximum((high - low) / ((_LOOKED_AT[1] - _LOOKED_AT[0]) * tops), 0.0)
    dry = np.maximum(low - _LOOKED_AT[0] * tops * viscous, 0.0)
    return np.asarray(read_only(np.column_stack([dry, viscous])))


def _resistance(model: SensedModel, speeds: FloatArray, load: FloatArray) -> FloatArray:
    """Return what friction takes from each joint that moves alone at its speed, (n_v,) [Nm or N]."""
    elements = np.concatenate([model.sliding, model.bristles])
    taken, out, still = np.zeros(model.n_v), np.empty((3, model.n_v)), np.zeros(model.n_v)
    for joint, speed in enumerate(speeds):
        for way in (1.0, -1.0):
            dq = still.copy()
            dq[joint] = way * speed
            turned = dq[elements["joint"]] + elements["ratio"] * dq[elements["other"]]
            passive_kernel(elements, still, dq, load, np.sign(turned), out)
            taken[joint] += 0.5 * way * out[0, joint]
    return taken
