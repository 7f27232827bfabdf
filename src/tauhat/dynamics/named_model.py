"""From the name that people give a model to a torque model."""

from __future__ import annotations

from collections.abc import Collection

from tauhat.dynamics.model import TorqueModel, torque_model
from tauhat.dynamics.model_file import load_model
from tauhat.robots.robot import Robot
from tauhat.robots.shared_motor import SharedMotor

AUTO = "auto"
_WHOLE = frozenset({"plain", "robust", AUTO})


def named_model(robot: Robot, text: str, *, shared_motors: Collection[SharedMotor] = ()) -> TorqueModel:
    """Return the model of a list of terms, of the names plain, robust or auto, or of a TOML file.

    plain, robust and auto bring the coupling of motors that turn with two joints; auto is robust, to begin with.

    Parameters
    ----------
    shared_motors : motors that, after the maps of the logs, turn with two joints

    Raises
    ------
    ModelError
        an unknown term, or a file that is no model.
    """
    if text.endswith(".toml"):
        return load_model(text, robot)
    names = "robust" if text.strip() == AUTO else text
    return torque_model(robot, f"{names},coupling" if text.strip() in _WHOLE and shared_motors else names)
