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
_WHOLE = frozenset({"plain", "robust", AUTO})


def model_of(robot: Robot, text: str, recordings: Sequence[Recording] | Sequence[LogFacts] = ()) -> TorqueModel:
    """Return the model of a list of terms, of the names plain, robust or auto, or of a TOML file.

    plain, robust and auto bring the coupling of motors that, after the log's map, turn with two joints.
    """
    from tauhat.dynamics.model import torque_model
    from tauhat.dynamics.model_file import load_model

    if text.endswith(".toml"):
        return load_model(text, robot)
    names = "robust" if text.strip() == AUTO else text
    shared = any(recording.shared_motors for recording in recordings)
    return torque_model(robot, f"{names},coupling" if text.strip() in _WHOLE and shared else names)
