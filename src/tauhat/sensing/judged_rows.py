"""What the contact kernel says along a whole log, with given limits, or with none as in free motion."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.sensing.contact_kernel import ROWS, STATES, judge_along
from tauhat.sensing.contact_rules import ContactRules
from tauhat.sensing.sensed_log import SensedLog

_OUT_OF_REACH = 1e12  # limits with which nothing counts as contact, as is known of free motion


def judged_rows(log: SensedLog, scaling: tuple[FloatArray, FloatArray], rules: ContactRules) -> FloatArray:
    """Return what `contact_kernel.judge_along` says of a log, (n_t, 4 + 2 n_v).

    Parameters
    ----------
    scaling : edges and limits, as the kernel reads them
    """
    n_v = len(log.joint_names)
    sensed = np.ascontiguousarray(np.stack([log.tau, np.square(log.tau_std), log.dq], axis=1))
    out, memory = np.empty((log.n_t, 4 + 2 * n_v)), (np.zeros((ROWS, n_v)), np.zeros(STATES))
    judge_along(scaling, rules.way(log.step), sensed, log.settled, memory, out)
    return out


def free_rows(log: SensedLog, edges: FloatArray, rules: ContactRules) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return condition (n_t,), residual in standard errors (n_t, n_v) and zero (n_t, n_v) [Nm or N] of free motion.

    Parameters
    ----------
    edges : (n_steps, n_v) speeds, of which the first tells standing [rad/s or m/s]
    """
    n_v = len(log.joint_names)
    out = judged_rows(log, (edges, np.full((2 + len(edges), n_v), _OUT_OF_REACH)), rules)
    return out[:, 2].astype(np.intp), out[:, 4 : 4 + n_v] * _OUT_OF_REACH, out[:, 4 + n_v :].copy()
