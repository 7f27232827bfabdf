"""A known change: what a model says of a payload that was weighed before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tauhat.arrays import FloatArray, frozen
from tauhat.errors import ModelError
from tauhat.estimation.estimate import Estimate
from tauhat.estimation.payload import KnownPayload, Payload, identify_payload
from tauhat.recordings.processing import Processing
from tauhat.recordings.recording import Recording
from tauhat.verification.prediction import verify


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownNumber:
    """One number that was known, as found with half of its 95 % interval; `found` is None where the motion hides it."""

    quantity: str
    unit: str
    known: float
    found: float | None
    half: float | None

    @property
    def inside(self) -> bool | None:
        """Whether the interval holds the known number; None where nothing was found."""
        if self.found is None or self.half is None:
            return None
        return abs(self.found - self.known) <= self.half

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "quantity": self.quantity, "unit": self.unit, "known": self.known, "found": self.found,
            "half": self.half, "inside": self.inside,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadCheck:
    """A payload that was known, beside what the model finds.

    numbers : mass, and the centre of mass where it was known
    ignored, found : relative error of the loaded recordings' torque without a payload, and with the one that was found
    """

    numbers: tuple[KnownNumber, ...]
    payload: Payload
    ignored: float
    found: float

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "link": self.payload.link,
            "numbers": [number.to_dict() for number in self.numbers],
            "relative_rms_ignored": self.ignored,
            "relative_rms_found": self.found,
        }


def check_payload(
    estimate: Estimate,
    loaded: Sequence[Recording],
    *,
    mass: float,
    centre: FloatArray | None = None,
    link: str = "",
    processing: Processing | None = None,
) -> PayloadCheck:
    """Return what the model says a payload weighs and where it sits, beside what is known of it.

    The payload is identified without what is known: it is what the numbers are judged by.

    Parameters
    ----------
    mass : [kg]
    centre : (3,) of mass, in the frame of the link that carries it [m], where known
    link : name of the joint whose link carries it; the last one by default

    Raises
    ------
    RecordingError
        when a recording does not fit the robot or lacks torque.
    ModelError
        when the mass is not positive, or the recordings do not show the payload.
    """
    if not 0.0 < mass < np.inf:
        raise ModelError("the mass of a known payload must be positive", got=f"{mass:g} kg")
    where = None if centre is None else frozen("centre", centre, (3,), where="known payload")
    payload = identify_payload(estimate, loaded, known=KnownPayload(link=link), processing=processing)
    body = payload.body
    numbers = [KnownNumber(quantity="mass", unit="kg", known=mass, found=body.mass, half=body.mass_half)]
    for axis, known in enumerate(() if where is None else where.tolist()):
        seen = body.centre_seen[axis]
        numbers.append(
            KnownNumber(
                quantity=f"centre {'xyz'[axis]}", unit="m", known=known,
                found=float(body.centre[axis]) if seen else None,
                half=float(body.centre_half[axis]) if seen else None,
            )
        )  # fmt: skip
    ignored, found = (
        _pooled([log.relative_rms * np.linalg.norm(log.tau) for log in logs], [np.linalg.norm(log.tau) for log in logs])
        for logs in (verify(model, loaded, processing=processing).logs for model in (estimate, payload.loaded))
    )
    return PayloadCheck(numbers=tuple(numbers), payload=payload, ignored=ignored, found=found)


def _pooled(errors: Sequence[Any], torques: Sequence[Any]) -> float:
    return float(np.linalg.norm(errors) / np.linalg.norm(torques))
