"""From what a controller tells, rad and ampere, to the joint side, by the map that logs of the robot are read with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tauhat.arrays import FloatArray
from tauhat.errors import MapError
from tauhat.recordings.binding import joint_side
from tauhat.recordings.logmap import LogMap, SignalMap, TimeMap

_REMEDY = "give the Nm at the joint per ampere: gain in the map's [torque] section, with unit A"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CurrentMap:
    """A map whose positions are in rad and whose torques are currents in A: torque constants, signs, offsets, names.

    Which columns, files and rows it names is of no concern here, nor is any quantity but position and torque.
    """

    log_map: LogMap
    n_v: int = 6

    def __post_init__(self) -> None:
        where = self.log_map.source or "map"
        if self.log_map.torque is None or self.log_map.torque.scale is None:
            raise MapError("no torque constants", where=f"{where}, [torque]", remedy=_REMEDY)
        for signal, unit in ((self.position, "rad"), (self.torque, "A")):
            given = ", ".join(sorted(set(signal.unit)))
            place = f"{where}, [{signal.kind}]"
            if given != unit:
                raise MapError(
                    "a controller tells another unit", where=f"{place} unit", expected=unit, got=given, remedy=_REMEDY
                )
            if signal.delay_samples:
                raise MapError(
                    "what comes live cannot be shifted in time", where=f"{place} delay_samples",
                    got=signal.delay_samples, remedy="leave it out and let `identify` find the delay",
                )  # fmt: skip
            signal.factors(self.n_v)
            signal.offsets(self.n_v)
        self._check_joints(where)

    def _check_joints(self, where: str) -> None:
        counts = [len(self.log_map.joints)] if self.log_map.joints else []
        coupling = self.log_map.coupling
        counts += [len(matrix) for matrix in (coupling.position, coupling.torque) if matrix is not None]
        if any(count != self.n_v for count in counts):
            got = ", ".join(map(str, counts))
            raise MapError("the map is of another robot", where=where, expected=f"{self.n_v} joints", got=got)

    @property
    def position(self) -> SignalMap:
        """How positions are read."""
        return self.log_map.position

    @property
    def torque(self) -> SignalMap:
        """How currents are read."""
        return self.log_map.torque or self.log_map.position  # the first: without one there is no such map

    def joint_side(self, q: FloatArray, current: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return position and motor torque on the joint side, each (n_v,) [rad, Nm].

        Parameters
        ----------
        q, current : (n_v,) as the controller tells them [rad, A]
        """
        position = joint_side(q[None], self.position, self.log_map)
        return position[0], joint_side(current[None], self.torque, self.log_map)[0]

    def text(self) -> str:
        """Return the map of a log of the controller's own numbers: columns q_1 .., current_1 .., temperature_1 .. ."""
        columns = f"{{1..{self.n_v}}}"
        lines = ["[time]", 'column = "t"', 'unit = "s"']
        lines += ["", "[position]", f'columns = "q_{columns}"', *_numbers(self.position)]
        lines += ["", "[torque]", f'columns = "current_{columns}"', *_numbers(self.torque)]
        lines += ["", "[temperature]", f'columns = "temperature_{columns}"']
        if self.log_map.joints:
            lines += ["", "[joints]", f"names = {_listed([_quoted(name) for name in self.log_map.joints])}"]
        coupling = self.log_map.coupling
        matrices = {"position": coupling.position, "torque": coupling.torque}
        rows = [
            f"{name} = {_listed([_listed(row) for row in matrix.tolist()])}"
            for name, matrix in matrices.items()
            if matrix is not None
        ]
        return "\n".join([*lines, *(["", "[coupling]", *rows] if rows else [])]) + "\n"


def map_of_constants(constants: Sequence[float]) -> CurrentMap:
    """Return the map of a robot of which only the torque constants are known [Nm at the joint per ampere].

    Raises
    ------
    MapError
        not one number, nor one for each of six joints, or a zero.
    """
    return CurrentMap(
        log_map=LogMap(
            time=TimeMap(column="t"), position=SignalMap(kind="position", columns=("q",)),
            torque=SignalMap(kind="torque", columns=("current",), unit=("A",), scale=tuple(map(float, constants))),
            source="torque constants",
        )
    )  # fmt: skip


def _numbers(signal: SignalMap) -> list[str]:
    """Return the keys of a section that make numbers SI, those that do nothing left out."""
    word = "gain" if signal.kind == "torque" else "scale"
    lines = [f'unit = "{signal.unit[0]}"']
    lines += [f"{word} = {_listed(signal.scale)}"] if signal.scale is not None else []
    lines += [f"sign = {_listed(signal.sign)}"] if any(sign != 1.0 for sign in signal.sign) else []
    return lines + ([f"offset = {_listed(signal.offset)}"] if any(signal.offset) else [])


def _listed(values: Sequence[object]) -> str:
    return f"[{', '.join(map(str, values))}]"


def _quoted(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
