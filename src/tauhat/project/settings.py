"""What a project is made of: plain settings, paths as they are written in its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from tauhat.dynamics.model import known_terms
from tauhat.dynamics.named_model import AUTO
from tauhat.errors import ProjectError
from tauhat.estimation.estimators import estimator_named
from tauhat.excitation.criteria import criterion_named
from tauhat.excitation.design import method_named

FORMATS = {"urdf": "robot.urdf", "mjcf": "robot.xml", "c": "robot.h"}
"""What an estimate can be exported as -> the file's name."""
FREE, PHYSICAL = "none", "physical"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSettings:
    """Which robot: a built-in name or a file beside the project's; joints frozen at a position [rad or m]."""

    source: str
    locked: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignedMotion:
    """A motion that is designed.

    There is no budget in seconds: the motion would then hang on what else the machine does. `starts` is the budget.

    seconds : of one period [s]
    periods : how often the written motion runs
    harmonics : of each joint
    rate : samples of the file per second [Hz]
    motions : how many, each for what those before leave uncertain
    criterion, method, starts, margin : as `tauhat excite` has them
    limits : a file of further limits, or nothing
    seed : of the search
    """

    seconds: float = 10.0
    periods: int = 2
    harmonics: int = 5
    rate: float = 100.0
    motions: int = 1
    criterion: str = "mixed"
    method: str = "gradient"
    starts: int = 3
    margin: float = 0.05
    limits: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        criterion_named(self.criterion)
        method_named(self.method)
        _inside("seconds", self.seconds, 0.5, 600.0)
        _inside("rate", self.rate, 1.0, 10_000.0)
        _inside("periods", self.periods, 1, 10_000)
        _inside("harmonics", self.harmonics, 2, 50)
        _inside("motions", self.motions, 1, 100)
        _inside("starts", self.starts, 1, 1000)
        _inside("margin", self.margin, 0.0, 0.9)

    @property
    def count(self) -> int:
        """How many motions there are."""
        return self.motions


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenMotion:
    """Motions that are there already, as `tauhat excite` writes them."""

    files: tuple[str, ...]

    @property
    def count(self) -> int:
        """How many motions there are."""
        return len(self.files)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedLogs:
    """Logs that a simulated robot makes.

    spread, friction : of the truth, as an experiment's file has them
    sensors, scale : named sensors and how many times as bad; without a name `noise` of the torque over each joint's RMS
        torque, and `quantisation` of the encoders [rad or m]
    rate : samples per second [Hz]
    seed, robot_seed : of the noise and of the truth
    experiment : a file that says all of this instead; its motion and log do not count
    """

    spread: float = 0.1
    friction: str = "plain"
    sensors: str = ""
    scale: float = 1.0
    noise: float = 0.02
    quantisation: float = 2e-5
    rate: float = 500.0
    seed: int = 0
    robot_seed: int = 0
    experiment: str = ""

    def __post_init__(self) -> None:
        _inside("spread", self.spread, 0.0, 0.5)
        _inside("rate", self.rate, 10.0, 10_000.0)
        _inside("noise", self.noise, 0.0, 10.0)
        _inside("quantisation", self.quantisation, 0.0, 1.0)
        _inside("scale", self.scale, 0.0, 1000.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenLogs:
    """Logs of a real robot, and the map of their columns; they may not be there yet."""

    logs: tuple[str, ...]
    map: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnseenMotion:
    """A random motion of the simulated robot to verify on: its length [s], its harmonics, and the seed of all of it."""

    seconds: float = 20.0
    harmonics: int = 5
    seed: int = 1

    def __post_init__(self) -> None:
        _inside("seconds", self.seconds, 1.0, 3600.0)
        _inside("harmonics", self.harmonics, 2, 50)


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """How the model is identified.

    model : robust, plain, auto, terms, or a TOML file
    estimator : name of the method
    constraints : `none`, `physical`, or a TOML file of constraints
    essential : drop the parameters that the logs cannot see
    cutoff : low-pass [Hz]; chosen from the data where it is not given
    period : of a repeated motion that is averaged [s], or nothing
    """

    model: str = "robust"
    estimator: str = "wls"
    constraints: str = FREE
    essential: bool = False
    cutoff: float | None = None
    period: float | None = None

    def __post_init__(self) -> None:
        estimator_named(self.estimator)
        if not self.model.endswith(".toml") and self.model.strip() != AUTO:
            known_terms(self.model)
        if self.constraints not in {FREE, PHYSICAL} and not self.constraints.endswith(".toml"):
            expected = f"{FREE}, {PHYSICAL} or a .toml file"
            raise ProjectError("unknown constraints", expected=expected, got=self.constraints[:60])
        for name in ("cutoff", "period"):
            value = getattr(self, name)
            if value is not None:
                _inside(name, value, 1e-6, 1e6)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportSettings:
    """The report's heading; the robot's name by default."""

    title: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exports:
    """What the estimate is written as for other programs.

    formats : some of `FORMATS`
    prefix : of all names in the C header; the robot's by default
    without : terms that are left out
    """

    formats: tuple[str, ...]
    prefix: str = ""
    without: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        strange = [name for name in self.formats if name not in FORMATS]
        if strange or not self.formats:
            raise ProjectError("unknown format", expected=f"some of {', '.join(FORMATS)}", got=", ".join(strange))


@dataclass(frozen=True, slots=True, kw_only=True)
class Project:
    """The whole way of one robot; everything it makes is in the folder of its file.

    file : the project's file
    motion : none where logs are given that were made with another motion
    verify : none where there is nothing unseen to verify on
    """

    file: Path
    robot: RobotSettings
    motion: DesignedMotion | GivenMotion | None = None
    record: SimulatedLogs | GivenLogs = field(default_factory=SimulatedLogs)
    identify: Identification = field(default_factory=Identification)
    verify: UnseenMotion | GivenLogs | None = None
    report: ReportSettings = field(default_factory=ReportSettings)
    export: Exports | None = None

    def __post_init__(self) -> None:
        simulated = isinstance(self.record, SimulatedLogs)
        if simulated and self.motion is None:
            raise ProjectError("a simulated robot needs a motion", where=self.file)
        if self.verify is not None and simulated != isinstance(self.verify, UnseenMotion):
            raise ProjectError("logs to fit and logs to verify on must both be simulated, or both be given")
        if self.export is not None and self.identify.constraints == FREE:
            raise ProjectError(
                "an export needs all parameters", where=self.file, expected="[identify] constraints", got=FREE,
                remedy='set constraints = "physical"',
            )  # fmt: skip

    @property
    def folder(self) -> Path:
        """Where everything is."""
        return self.file.parent

    def place(self, name: str) -> Path:
        """Return the path of a file that is named relative to the project's folder."""
        return self.folder / name


def labelled(section: str, settings: Any) -> dict[str, Any]:
    """Return the settings of a section as plain data: `[identify] model` -> `robust` and so on."""
    values = {item.name: getattr(settings, item.name) for item in fields(settings)}
    return {f"[{section}] {name}": _plain(value) for name, value in values.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    return list(value) if isinstance(value, tuple) else value


def _inside(name: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        raise ProjectError(f"{name} is out of bounds", expected=f"{least:g} to {most:g}", got=f"{value:g}")
