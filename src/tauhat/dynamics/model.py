"""The torque model: a robot plus the terms that make its torque."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, asdict, dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

from tauhat.arrays import FloatArray, IntArray
from tauhat.dynamics.motion import Motion, MotionGradient, no_gradient
from tauhat.dynamics.terms import (
    Asymmetric,
    Coulomb,
    Coupling,
    CouplingDahl,
    CubeRoot,
    Dahl,
    GasSpring,
    Inertia,
    InertiaWithoutProducts,
    LoadCoulomb,
    LoadDahl,
    Offset,
    Parameter,
    PolynomialFriction,
    RotorInertia,
    Spring,
    Stribeck,
    Term,
    Thermal,
    ThermalMeasured,
    Viscous,
    ViscousAsymmetry,
)
from tauhat.errors import ModelError
from tauhat.robots.robot import Robot

_KNOWN: tuple[type[Term], ...] = (
    *(Inertia, InertiaWithoutProducts, RotorInertia, Coupling, CouplingDahl, Spring, GasSpring),
    *(Viscous, CubeRoot, Coulomb, ViscousAsymmetry, Asymmetric, Stribeck, PolynomialFriction),
    *(Dahl, LoadCoulomb, LoadDahl, Thermal, ThermalMeasured, Offset),
)
TERMS: Mapping[str, type[Term]] = {term.key: term for term in _KNOWN}
"""Every term by its name."""
PLAIN_TERMS = ("inertia", "rotor", "viscous", "coulomb", "offset")
"""The terms of the textbook's model."""
ROBUST_TERMS = ("inertia", "rotor", "viscous", "cube-root", "stribeck", "dahl", "load-dahl", "offset")
"""The terms that predict real arms best, measured on several; what `identify` takes on the command line."""
MODELS: Mapping[str, tuple[str, ...]] = {"plain": PLAIN_TERMS, "robust": ROBUST_TERMS}

TermStates = tuple[FloatArray | None, ...]


class Layout(NamedTuple):
    """Which regressor entries are kept as rows, joint by joint.

    parameters : (n_rows,) index of each row's parameter in the model
    bounds : (n_v + 1,) rows of joint j are `bounds[j]` to `bounds[j + 1]`
    sources : per term and joint, which of its support columns go to which rows
    """

    parameters: IntArray
    bounds: IntArray
    sources: tuple[tuple[tuple[IntArray, IntArray], ...], ...]

    def of_joint(self, joint: int) -> slice:
        """Return the rows of one joint."""
        return slice(int(self.bounds[joint]), int(self.bounds[joint + 1]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueModel:
    """A robot and its terms: the columns of `tau = Y(q, dq, ddq) x`.

    robot : the arm
    terms : each kind at most once
    """

    robot: Robot
    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "terms", tuple(self.terms))
        keys = [term.key for term in self.terms]
        if not keys:
            raise ModelError("a torque model needs at least one term", expected=", ".join(TERMS))
        if len(set(keys)) < len(keys):
            raise ModelError("a term is given twice", got=", ".join(keys))
        for term in self.terms:
            contained = [key for key in term.stands_for if key in keys]
            if contained:
                raise ModelError(
                    f"term {term.key} cannot be told apart from {', '.join(contained)}",
                    remedy=f"leave out {term.key} or {', '.join(contained)}",
                )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, term by term."""
        return tuple(parameter for term in self.terms for parameter in term.parameters(self.robot))

    @property
    def n_p(self) -> int:
        """Number of standard parameters."""
        return len(self.parameters)

    def layout(self, kept: IntArray | None = None) -> Layout:
        """Return where each regressor entry goes when only the parameters `kept` (all by default) are wanted."""
        wanted = np.arange(self.n_p) if kept is None else np.asarray(kept, dtype=np.intp)
        rank = np.full(self.n_p, -1)
        rank[wanted] = np.arange(wanted.size)
        supports = [term.support(self.robot) for term in self.terms]
        starts = np.cumsum([0, *(len(term.parameters(self.robot)) for term in self.terms)])
        rows: list[IntArray] = []
        bounds = [0]
        sources: list[list[tuple[IntArray, IntArray]]] = [[] for _ in self.terms]
        for joint in range(self.robot.n_v):
            columns = [supports[k][joint] + starts[k] for k in range(len(self.terms))]
            present = np.sort(np.concatenate([c[rank[c] >= 0] for c in columns]))
            position = {int(parameter): bounds[-1] + r for r, parameter in enumerate(present)}
            for k, column in enumerate(columns):
                picked = np.flatnonzero(rank[column] >= 0)
                target = np.array([position[int(c)] for c in column[picked]], dtype=np.intp)
                sources[k].append((picked, target))
            rows.append(present)
            bounds.append(bounds[-1] + present.size)
        return Layout(np.concatenate(rows), np.array(bounds), tuple(tuple(source) for source in sources))

    def columns(
        self, motion: Motion, layout: Layout, states: TermStates | None = None
    ) -> tuple[FloatArray, TermStates]:
        """Return the regressor entries of `layout`, (n_rows, n_t), and the terms' states behind the last sample.

        Pass the states on to the next stretch of the same recording; None starts a new one.
        """
        before = states if states is not None else (None,) * len(self.terms)
        out = np.empty((layout.parameters.size, motion.n_t))
        after: list[FloatArray | None] = []
        for term, state, sources in zip(self.terms, before, layout.sources, strict=True):
            columns, state_after = term.columns(self.robot, motion, state)
            after.append(state_after)
            for (picked, target), values in zip(sources, columns, strict=True):
                out[target] = values[picked]
        return out, tuple(after)

    def pull(self, motion: Motion, layout: Layout, bars: FloatArray) -> MotionGradient:
        """Return the gradient with respect to the motion of a scalar with sensitivities `bars` (n_rows, n_t).

        Raises
        ------
        ModelError
            when a term's columns have no gradient.
        """
        gradient = no_gradient(motion)
        for term, sources in zip(self.terms, layout.sources, strict=True):
            supports = term.support(self.robot)
            parts = tuple(np.zeros((support.size, motion.n_t)) for support in supports)
            for part, (picked, target) in zip(parts, sources, strict=True):
                part[picked] = bars[target]
            term.pull(self.robot, motion, parts, gradient)
        return gradient

    def with_term(self, term: Term) -> TorqueModel:
        """Return the model with the term of the same kind replaced."""
        return replace(self, terms=tuple(term if other.key == term.key else other for other in self.terms))

    @property
    def fingerprint(self) -> str:
        """Hash of the robot's kinematics and of the terms with their settings: what a regressor's columns depend on."""
        terms = json.dumps(self.to_dict()["terms"], sort_keys=True)
        return hashlib.sha256(f"{self.robot.fingerprint} {terms}".encode()).hexdigest()[:16]

    def to_dict(self) -> dict[str, Any]:
        """Return robot and terms as plain data."""
        terms = [{"term": term.key, **asdict(term)} for term in self.terms]
        return {"robot": self.robot.to_dict(), "terms": terms}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TorqueModel:
        """Return the model that `to_dict` described.

        Raises
        ------
        ModelError
            when a term is unknown or its settings are not.
        """
        terms = tuple(_term_from_dict(item) for item in data["terms"])
        return cls(robot=Robot.from_dict(data["robot"]), terms=terms)


def _term_from_dict(data: Mapping[str, Any]) -> Term:
    settings = {name: _tuples(value) for name, value in data.items() if name != "term"}
    key = str(data.get("term"))
    if key not in TERMS:
        raise ModelError("unknown term", expected=", ".join(TERMS), got=key)
    try:
        return TERMS[key](**settings)
    except TypeError as error:
        raise ModelError(f"term {key} has other settings in this version", got=", ".join(settings)) from error


def _tuples(value: Any) -> Any:
    """Return lists of plain data as the tuples they were."""
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


def torque_model(robot: Robot, terms: str | Iterable[str] = PLAIN_TERMS) -> TorqueModel:
    """Return the model with the named terms, e.g. `"inertia,viscous,coulomb"` or `"robust"`, in their default settings.

    "plain" is the textbook's `inertia,rotor,viscous,coulomb,offset`; "robust" is what predicts real arms best.

    Raises
    ------
    ModelError
        when a name is unknown or given twice, or a term cannot be told apart from another.
    """
    return TorqueModel(robot=robot, terms=tuple(default_term(key) for key in known_terms(terms)))


def default_term(key: str) -> Term:
    """Return the term of this name in its default settings.

    Raises
    ------
    ModelError
        when it has none, as a gas spring without its geometry.
    """
    needed = [item.name for item in fields(TERMS[key]) if item.default is MISSING and item.default_factory is MISSING]
    if needed:
        raise ModelError(f"term {key} needs {', '.join(needed)}", remedy="give them in a model file (TOML)")
    return TERMS[key]()


def known_terms(terms: str | Iterable[str]) -> tuple[str, ...]:
    """Return the names in a list of terms, with "plain" and "robust" written out.

    Raises
    ------
    ModelError
        when one is unknown.
    """
    names = terms.split(",") if isinstance(terms, str) else list(terms)
    keys = tuple(key for name in names for key in MODELS.get(name.strip(), (name.strip(),)))
    unknown = [key for key in keys if key not in TERMS]
    if unknown:
        raise ModelError(
            "unknown term", expected=", ".join((*MODELS, *TERMS)), got=", ".join(key or "''" for key in unknown)
        )
    return keys
