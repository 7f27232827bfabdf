"""What is known of many logs after workers have read each of them once, without a sample of them being here."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tauhat.arrays import FloatArray, read_only
from tauhat.dynamics.base import BaseParameters
from tauhat.dynamics.model import TorqueModel
from tauhat.errors import ModelError, RecordingError, TauhatWarning
from tauhat.estimation.estimate import InputLog, input_log
from tauhat.estimation.evidence import Evidence, Gather, collect
from tauhat.estimation.identify import Seen
from tauhat.estimation.tuning import sampled_rows
from tauhat.recordings.choice import choose_cutoff, top_speeds
from tauhat.recordings.log_source import LogSource
from tauhat.recordings.processing import Processing, moving_joints
from tauhat.recordings.recording import Recording
from tauhat.robots.shared_motor import SharedMotor
from tauhat.workers import LocalWorkers, Workers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogFacts:
    """What one log shows when it is read.

    input : name, hash, rows and length, as the estimate notes them
    joint_names : of its columns
    shared_motors : motors that, after its map, turn with two joints
    top_speeds : (n_v,) [rad/s or m/s]
    moves : (n_v,) whether the joint moves
    cutoff : low-pass that its spectrum asks for [Hz]
    doubts : warnings of its reading
    """

    input: InputLog
    joint_names: tuple[str, ...]
    shared_motors: tuple[SharedMotor, ...]
    top_speeds: FloatArray
    moves: NDArray[np.bool_]
    cutoff: float
    doubts: tuple[str, ...]

    def __post_init__(self) -> None:
        read_only(self.top_speeds)
        read_only(self.moves)

    @property
    def name(self) -> str:
        """What messages call the log."""
        return self.input.name


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogSurvey:
    """Logs that workers have read once, and can read again.

    sources : one a log
    facts : about each
    workers : who reads
    """

    sources: tuple[LogSource, ...]
    facts: tuple[LogFacts, ...]
    workers: Workers

    def seen(self) -> Seen:
        """Return what an estimate notes of the logs."""
        return Seen(
            inputs=tuple(fact.input for fact in self.facts),
            top_speeds=np.max([fact.top_speeds for fact in self.facts], axis=0),
            moves=np.any([fact.moves for fact in self.facts], axis=0),
            joint_names=self.facts[0].joint_names,
        )

    def cutoff(self) -> float:
        """Return the low-pass that suits all logs [Hz]: the smallest that any asks for."""
        return min(fact.cutoff for fact in self.facts)

    def sample(self) -> tuple[Recording, ...]:
        """Return the leading rows of at most twenty logs, 20 000 in all: what settings are chosen on."""
        rows = sampled_rows([fact.input.samples for fact in self.facts])
        wanted = [(self.sources[place], count) for place, count in rows.items()]
        return tuple(self.workers.map(_leading, wanted))

    def gather(self, processing: Processing) -> Gather:
        """Return what has the workers read all logs and merge their evidence, through this processing."""

        def gathered(model: TorqueModel, base: BaseParameters, most_blocks: int) -> Evidence:
            task: Callable[[LogSource], Evidence] = partial(
                _evidence, model=model, base=base, processing=processing, most_blocks=most_blocks
            )
            return self.workers.reduce(Evidence.merged, task, self.sources)

        return gathered


def survey_logs(sources: Sequence[LogSource], *, workers: Workers | None = None) -> LogSurvey:
    """Return what workers find in each log, processes on all cores by default.

    Raises
    ------
    ModelError
        when there is no log.
    RecordingError, MapError
        when one cannot be read, or they have different numbers of joints.

    Warns
    -----
    TauhatWarning
        what reading a log warns of.
    """
    if not sources:
        raise ModelError("no recording to identify from")
    readers = workers or LocalWorkers()
    facts = tuple(readers.map(_facts, sources))
    for doubt in dict.fromkeys(doubt for fact in facts for doubt in fact.doubts):
        warnings.warn(doubt, TauhatWarning, stacklevel=2)
    for fact in facts:
        if len(fact.joint_names) != len(facts[0].joint_names):
            raise RecordingError(
                "the logs are not of one robot",
                where=fact.name,
                expected=f"{len(facts[0].joint_names)} joints, as in {facts[0].name}",
                got=len(fact.joint_names),
            )
    return LogSurvey(sources=tuple(sources), facts=facts, workers=readers)


def _facts(source: LogSource) -> LogFacts:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", TauhatWarning)
        recording = source.read()
    return LogFacts(
        input=input_log(recording),
        joint_names=recording.joint_names,
        shared_motors=recording.shared_motors,
        top_speeds=top_speeds([recording]),
        moves=moving_joints(recording),
        cutoff=choose_cutoff(recording),
        doubts=tuple(str(item.message) for item in caught if issubclass(item.category, TauhatWarning)),
    )


@contextmanager
def _said_before() -> Iterator[None]:
    """Do not warn of a log again: the survey has."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TauhatWarning)
        yield


def _leading(wanted: tuple[LogSource, int]) -> Recording:
    source, count = wanted
    with _said_before():
        recording = source.read()
    return recording if count >= recording.n_t else recording.rows(0, count)


def _evidence(
    source: LogSource, *, model: TorqueModel, base: BaseParameters, processing: Processing, most_blocks: int
) -> Evidence:
    with _said_before():
        recording = source.read()
    return collect(model, base, recording, processing, most_blocks=most_blocks)
