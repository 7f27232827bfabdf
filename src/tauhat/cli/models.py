"""From what `--model` says to a torque model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tauhat.dynamics.model import TorqueModel
    from tauhat.estimation.log_survey import LogFacts
    from tauhat.recordings.recording import Recording
    from tauhat.robots.robot import Robot

AUTO = "auto"


def model_of(robot: Robot, text: str, recordings: Sequence[Recording] | Sequence[LogFacts] = ()) -> TorqueModel:
    """Return the model of a list of terms, of the names plain, robust or auto, or of a TOML file.

    plain, robust and auto bring the coupling of motors that, after the log's map, turn with two joints.
    """
    from tauhat.dynamics.named_model import named_model

    shared = [motor for recording in recordings for motor in recording.shared_motors]
    return named_model(robot, text, shared_motors=shared)
