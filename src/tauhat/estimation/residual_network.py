"""A small neural network for the torque that the model leaves over: plain arrays that predict without any library.

    u = clip((f - centre) / scale),  f = [q, dq, ddq]
    h_1 = tanh(u W_1 + b_1), ...,  tau = size * (h W_last + b_last)

Inputs outside what it was trained on are moved to the edge: the correction stays at its last known value instead of
running away. Joints it does not help have size zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import EstimateError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResidualNetwork:
    """A trained network.

    weights : per layer (n_in, n_out)
    biases : per layer (n_out,)
    centre, scale : (3 n_v,) of the inputs q, dq, ddq
    lowest, highest : (3 n_v,) standardised inputs seen in training
    size : (n_v,) of the output [Nm or N]; zero for joints that go without
    """

    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]
    centre: FloatArray
    scale: FloatArray
    lowest: FloatArray
    highest: FloatArray
    size: FloatArray

    def __post_init__(self) -> None:
        where = "residual network"
        size = frozen("size", self.size, (None,), where=where)
        object.__setattr__(self, "size", size)
        for name in ("centre", "scale", "lowest", "highest"):
            object.__setattr__(self, name, frozen(name, getattr(self, name), (3 * size.size,), where=where))
        weights = tuple(frozen("weights", layer, (None, None), where=where) for layer in self.weights)
        biases = tuple(
            frozen("biases", layer, (weight.shape[1],), where=where)
            for layer, weight in zip(self.biases, weights, strict=True)
        )
        fits = all(before.shape[1] == after.shape[0] for before, after in pairwise(weights))
        if not weights or not fits or weights[0].shape[0] != 3 * size.size or weights[-1].shape[1] != size.size:
            raise EstimateError(
                "the layers of the network do not fit",
                where=where,
                expected=f"{3 * size.size} inputs, {size.size} outputs",
                got=" ".join(str(layer.shape) for layer in weights),
            )
        if not (self.scale > 0.0).all():
            raise EstimateError("a scale of the inputs is not positive", where=where)
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "biases", biases)

    @property
    def n_v(self) -> int:
        """Number of joints."""
        return int(self.size.size)

    def torque(self, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
        """Return what to add to the model's torque, (n_t, n_v) [Nm or N].

        Parameters
        ----------
        q, dq, ddq : (n_t, n_v)
        """
        arrays = [frozen(name, value, (None, self.n_v)) for name, value in (("q", q), ("dq", dq), ("ddq", ddq))]
        layer = np.clip((np.concatenate(arrays, axis=1) - self.centre) / self.scale, self.lowest, self.highest)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            layer = np.tanh(layer @ weight + bias)
        return np.asarray(self.size * (layer @ self.weights[-1] + self.biases[-1]))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        plain = {name: getattr(self, name).tolist() for name in ("centre", "scale", "lowest", "highest", "size")}
        layers = {name: [layer.tolist() for layer in getattr(self, name)] for name in ("weights", "biases")}
        return plain | layers

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ResidualNetwork:
        """Return the network that `to_dict` described."""
        arrays = {name: data[name] for name in ("centre", "scale", "lowest", "highest", "size")}
        return cls(weights=tuple(data["weights"]), biases=tuple(data["biases"]), **arrays)
