"""Small motions and logs for the tests of recordings."""

from __future__ import annotations

import numpy as np

from tauhat.recordings.log import Log
from tauhat.recordings.recording import Recording


def motion(*, n_t: int = 400, n_v: int = 2, rate: float = 200.0) -> dict[str, np.ndarray]:
    """Smooth q, dq, ddq with a torque that is a friction and inertia of sorts, plus noise."""
    t = np.arange(n_t) / rate
    speed = 2.0 * np.pi * (0.5 + 0.3 * np.arange(n_v))
    q = np.sin(t[:, None] * speed)
    dq = speed * np.cos(t[:, None] * speed)
    ddq = -(speed**2) * q
    noise = np.random.default_rng(7).normal(size=q.shape)
    return {"t": t, "q": q, "dq": dq, "ddq": ddq, "tau": 2.0 * ddq + 0.5 * dq + 3.0 + 0.05 * noise}


def full_recording() -> Recording:
    """Every channel a recording can have, with numbers that need all their digits."""
    rng = np.random.default_rng(1)
    channels = motion()
    n_t, n_v = channels["q"].shape
    return Recording(
        **channels,
        temperature=30.0 + rng.normal(size=(n_t, n_v)) / 3.0,
        wrench=rng.normal(size=(n_t, 6)) * 1e-7,
        joint_names=("shoulder", "elbow"),
        name="run",
    )


def log_of(**changes: object) -> Log:
    """A sound log, some of its fields changed."""
    fields: dict[str, object] = {**motion(), "joint_names": ("a", "b"), "units": ("rad", "rad"), "path": "run.csv"}
    fields.update(changes)
    return Log(**{name: np.array(v) if isinstance(v, np.ndarray) else v for name, v in fields.items()})


def codes(findings: object, severity: str | None = None) -> list[str]:
    """The codes of findings, without the "ok" ones unless asked for."""
    return [f.code for f in findings if (f.severity == severity if severity else f.severity != "ok")]
