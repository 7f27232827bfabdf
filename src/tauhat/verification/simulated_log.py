"""Simulated logs as files: the log, and the truth behind it beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tauhat.dynamics.base import base_parameters
from tauhat.dynamics.model import torque_model
from tauhat.files import write_text
from tauhat.recordings.writing import write_recording
from tauhat.robots.robot import Robot
from tauhat.simulation.experiment import Simulation
from tauhat.simulation.parameters import TrueParameters
from tauhat.simulation.truth_file import plant_document
from tauhat.verification.truth import standard_parameters


def truth_path(log: Path) -> Path:
    """Return where the truth of a log is kept: `run.truth.json` beside `run.parquet` or `run.csv.gz`."""
    return log.with_name(f"{log.name.removesuffix('.gz').rsplit('.', 1)[0]}.truth.json")


def write_log(robot: Robot, simulation: Simulation, log: Path, *, notes: dict[str, Any]) -> Path:
    """Write the log, and its true parameters with the notes beside it; return the path of the latter.

    Raises
    ------
    OutputError
        when one of them cannot be written.
    """
    write_recording(simulation.recording, log)
    beside = truth_path(log)
    document = truth_document(robot, simulation.truth.parameters) | notes
    write_text(beside, json.dumps(document, indent=1, allow_nan=False))
    return beside


def truth_document(robot: Robot, truth: TrueParameters) -> dict[str, Any]:
    """Return the plant, and its standard and base parameters in the plain model, as plain data."""
    model = torque_model(robot)
    base = base_parameters(model)
    values = standard_parameters(model, truth)
    standard = zip(model.parameters, values.tolist(), strict=True)
    kept = zip(base.independent, base.formulas(), (base.projection @ values).tolist(), strict=True)
    return plant_document(truth) | {
        "robot": robot.name,
        "parameters": [{"name": known.name, "value": value, "unit": known.unit} for known, value in standard],
        "base_parameters": [
            {"name": base.names[index], "formula": formula, "value": value, "unit": model.parameters[index].unit}
            for index, formula, value in kept
        ],
    }
