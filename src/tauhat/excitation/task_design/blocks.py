"""Columns of a model by what loads the joints: acceleration, gravity, friction; what a motion tells of each block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from tauhat.arrays import FloatArray, IntArray, read_only
from tauhat.dynamics.base import random_motion
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms import GasSpring, Spring
from tauhat.dynamics.terms.inertia import INERTIAL_UNITS
from tauhat.errors import ExcitationError
from tauhat.excitation.information import Information

Block: TypeAlias = Literal["inertial", "gravity", "friction"]
"""Which columns: those that only acceleration and centrifugal effects show, those of gravity and springs, the rest."""
BLOCKS: tuple[Block, ...] = get_args(Block)

_SEED = 20240229
_STATES = 200
_SEEN = 1e-9  # part of the columns' size that is more than rounding
_SPRINGS = (Spring.key, GasSpring.key)
_UNTOLD = 1e-9  # prior information on what is not counted, in parts of its largest: keeps the matrix regular


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Blocks:
    """Which of the columns of an `Information` are in which block.

    inertial, gravity, friction : places among `information.columns`
    """

    inertial: IntArray
    gravity: IntArray
    friction: IntArray

    def of(self, names: tuple[Block, ...]) -> IntArray:
        """Return the places of several blocks, ascending."""
        return np.sort(np.concatenate([getattr(self, name) for name in names]))


def block_named(name: str) -> Block:
    """Return the block of this name.

    Raises
    ------
    ExcitationError
        when there is none.
    """
    for block in BLOCKS:
        if block == name:
            return block
    raise ExcitationError("unknown block of columns", expected=", ".join(BLOCKS), got=name[:60])


def blocks_of(facts: Information) -> Blocks:
    """Return the blocks of the columns that count.

    Of the columns of masses, first moments and inertias those that load a joint at rest are of gravity, with springs;
    the others are inertial. The rest is friction.
    """
    model = facts.model
    owners = [term.key for term in model.terms for _ in term.parameters(model.robot)]
    heavy = np.array([model.parameters[index].unit in INERTIAL_UNITS for index in facts.columns])
    springs = np.array([owners[index] in _SPRINGS for index in facts.columns])
    states = random_motion(model.robot, _STATES, np.random.default_rng(_SEED))
    still = np.zeros_like(states.q)
    sizes = _sizes(facts, states) + np.finfo(float).tiny
    resting = _sizes(facts, Motion(q=states.q, dq=still, ddq=still, step=states.step)) > _SEEN * sizes
    gravity = springs | (heavy & resting)
    inertial = heavy & ~gravity
    return Blocks(
        inertial=read_only(np.flatnonzero(inertial)),
        gravity=read_only(np.flatnonzero(gravity)),
        friction=read_only(np.flatnonzero(~gravity & ~inertial)),
    )


def told_of(information: FloatArray, counted: IntArray) -> FloatArray:
    """Return the information on some columns while all others are unknown, (n, n).

    `S = M_cc - M_co M_oo^-1 M_oc`, the inverse of that block of the covariance.

    Parameters
    ----------
    information : (n_all, n_all) symmetric
    counted : (n,) places of the columns that count
    """
    others = np.setdiff1d(np.arange(len(information)), counted)
    block = information[np.ix_(counted, counted)]
    if not others.size:
        return block
    rest, across = information[np.ix_(others, others)], information[np.ix_(others, counted)]
    least = _UNTOLD * max(float(np.diag(rest).max()), np.finfo(float).tiny)
    told = block - across.T @ np.linalg.solve(rest + least * np.eye(others.size), across)
    return np.asarray(0.5 * (told + told.T))


def names_of(facts: Information) -> tuple[str, ...]:
    """Return the name of each column that counts, with the joint it belongs to."""
    parameters = facts.model.parameters
    return tuple(parameters[index].name for index in facts.columns)


def _sizes(facts: Information, motion: Motion) -> FloatArray:
    """Return the root mean square of each column, (n,)."""
    rows, _ = facts.model.columns(motion, facts.layout)
    squares = np.zeros(facts.model.n_p)
    np.add.at(squares, facts.layout.parameters, np.mean(rows**2, axis=1))
    return np.asarray(np.sqrt(squares[facts.columns]))
