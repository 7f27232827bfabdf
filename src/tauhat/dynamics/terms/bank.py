"""Several forms of one term side by side, so that one pass over the recordings serves to choose between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion
from tauhat.dynamics.terms.term import Parameter, Term
from tauhat.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class Bank(Term):
    """The columns of all `forms`, one form after the other; not a model to fit, but to choose from.

    forms : of one pointwise or stateful term, with equal parameters
    """

    key: ClassVar[str] = "bank"
    forms: tuple[Term, ...]

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Return the parameters of every form."""
        return tuple(parameter for form in self.forms for parameter in form.parameters(robot))

    def support(self, robot: Robot) -> tuple[IntArray, ...]:
        """Return for each joint the parameters of every form that load it."""
        supports = [form.support(robot) for form in self.forms]
        size = len(self.forms[0].parameters(robot))
        return tuple(
            np.concatenate([size * place + support[joint] for place, support in enumerate(supports)])
            for joint in range(robot.n_v)
        )

    def columns(
        self, robot: Robot, motion: Motion, state: FloatArray | None
    ) -> tuple[tuple[FloatArray, ...], FloatArray | None]:
        """Return every form's columns; their states are stacked."""
        before = [None] * len(self.forms) if state is None else list(state)
        made = [form.columns(robot, motion, part) for form, part in zip(self.forms, before, strict=True)]
        after = [part for _, part in made]
        joined = tuple(np.concatenate([own[joint] for own, _ in made]) for joint in range(robot.n_v))
        return joined, None if after[0] is None else np.array(after)
