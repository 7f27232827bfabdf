"""Zero-phase low-pass filters and differentiators of finite length, applied to whole matrices of signals.

A Butterworth filter run forwards and backwards has the zero-phase response `|H(f)|^2`. Its impulse response is
symmetric and dies out, so it is kept here as a finite symmetric kernel: the same operator can then be applied chunk by
chunk, to every regressor column and to the torque alike, together with the decimation (the parallel filter).
Derivatives are the same response times `2 pi i f`, so position, velocity and acceleration belong together.

Source: Gautier, "Dynamic identification of robots with power model", 1997 (parallel filter and decimation).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tauhat.arrays import FloatArray, read_only
from tauhat.errors import RecordingError

ORDER = 4  # of the Butterworth filter, run in both directions
TAIL = 1e-4  # a low-pass kernel is cut where its envelope has fallen below this part of its peak
DERIVATIVE_TAIL = 1e-6  # derivatives need their tails: ddq is 0.7 % off at a quarter of the cut-off with 1e-4
_SPAN = 8  # outputs made by one matrix product
LONGEST_KERNEL = 2**20  # [samples] on each side; a cut-off that needs more is an error of its unit
HIGHEST_CUTOFF = 0.45  # of the rate; above it nothing is filtered


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirFilter:
    """Symmetric finite filter with decimation.

    kernel : (2 half + 1,) weights; output k is `sum_m kernel[half + m] x[k decimation - m]`
    decimation : every how many samples an output is made
    """

    kernel: FloatArray
    decimation: int = 1

    @property
    def half(self) -> int:
        """Samples of context needed on each side."""
        return int(self.kernel.size // 2)

    def apply(self, rows: FloatArray) -> FloatArray:
        """Filter `rows` (n_rows, half + n + half) along time; return (n_rows, ceil(n / decimation)).

        The first and last `half` samples are context only.
        """
        if self.kernel.size == 1 and self.decimation == 1:
            return np.asarray(rows * self.kernel[0])
        n = rows.shape[1] - 2 * self.half
        n_out = -(-n // self.decimation)
        stride = _SPAN * self.decimation
        groups = -(-n_out // _SPAN)
        span = self.kernel.size + (_SPAN - 1) * self.decimation
        wanted = (groups - 1) * stride + span
        if wanted > rows.shape[1]:
            rows = np.pad(rows, ((0, 0), (0, wanted - rows.shape[1])))
        windows = np.lib.stride_tricks.sliding_window_view(rows, span, axis=1)[:, ::stride][:, :groups]
        product = np.matmul(windows.transpose(1, 0, 2), self._band())
        return np.ascontiguousarray(product.transpose(1, 0, 2)).reshape(rows.shape[0], groups * _SPAN)[:, :n_out]

    def _band(self) -> FloatArray:
        span = self.kernel.size + (_SPAN - 1) * self.decimation
        band = np.zeros((span, _SPAN))
        for k in range(_SPAN):
            band[k * self.decimation : k * self.decimation + self.kernel.size, k] = self.kernel[::-1]
        return band


def filtered(rows: FloatArray, fir: FirFilter) -> FloatArray:
    """Return whole signals `rows` (n_rows, n) through the filter, ends continued by reflection."""
    windows = with_context([rows], fir.half, multiple=fir.decimation)
    return np.concatenate([fir.apply(window) for window in windows], axis=1)


def low_pass(cutoff: float, rate: float, *, decimation: int = 1) -> FirFilter:
    """Return the zero-phase Butterworth low-pass of fourth order as a finite filter.

    Parameters
    ----------
    cutoff : [Hz], where a single pass has fallen by 3 dB; from 0.45 of the rate on nothing is filtered
    rate : samples per second [Hz]
    decimation : keep one output in so many
    """
    if cutoff >= HIGHEST_CUTOFF * rate:
        return FirFilter(kernel=read_only(np.ones(1)), decimation=decimation)
    kernel = _impulse_response(cutoff, rate, 0, TAIL)
    return FirFilter(kernel=read_only(kernel / kernel.sum()), decimation=decimation)


def high_pass(cutoff: float, rate: float) -> FirFilter:
    """Return what the zero-phase low-pass at `cutoff` [Hz] takes away."""
    kernel = -low_pass(cutoff, rate).kernel
    kernel[kernel.size // 2] += 1.0
    return FirFilter(kernel=read_only(kernel))


def differentiators(cutoff: float, rate: float) -> tuple[FirFilter, FirFilter, FirFilter]:
    """Return filters for the low-passed signal, its first and its second derivative; exact on parabolas.

    Parameters
    ----------
    cutoff : [Hz]; from 0.45 of the rate on plain central differences are returned
    rate : samples per second [Hz]
    """
    if cutoff >= HIGHEST_CUTOFF * rate:
        smooth = np.array([0.0, 1.0, 0.0])
        first = np.array([0.5, 0.0, -0.5]) * rate
        second = np.array([1.0, -2.0, 1.0]) * rate**2
    else:
        smooth, first, second = (_impulse_response(cutoff, rate, order, DERIVATIVE_TAIL) for order in range(3))
        age = (np.arange(smooth.size) - smooth.size // 2) / rate
        smooth = smooth / smooth.sum()
        first = -first / (age @ first)
        second = second - second.sum() * smooth
        second = 2.0 * second / (age**2 @ second)
    return tuple(FirFilter(kernel=read_only(kernel)) for kernel in (smooth, first, second))  # type: ignore[return-value]


@lru_cache(maxsize=16)
def _impulse_response(cutoff: float, rate: float, derivative: int, tail: float) -> FloatArray:
    """Return the symmetric (or antisymmetric) kernel of `|H|^2 (2 pi i f)^derivative`, cut where it has died out."""
    from scipy.signal import butter, sosfreqz

    if not 0.0 < cutoff < np.inf:
        raise RecordingError("the cut-off frequency must be positive", got=f"{cutoff} Hz")
    slowest = np.abs(butter(ORDER, cutoff, fs=rate, output="zpk")[1]).max()
    if slowest >= 1.0 or np.log(tail) / np.log(slowest) > LONGEST_KERNEL:
        raise RecordingError(
            "the cut-off frequency is far too low", got=f"{cutoff:g} Hz at {rate:g} samples per second",
            remedy="give it in Hz, above the frequencies of the motion",
        )  # fmt: skip
    half = int(np.ceil(np.log(tail) / np.log(slowest))) + 1
    size = 1 << int(np.ceil(np.log2(8 * half)))
    sections = butter(ORDER, cutoff, fs=rate, output="sos")
    frequency = np.arange(size // 2 + 1) * rate / size
    _, response = sosfreqz(sections, worN=frequency, fs=rate)
    spectrum = np.abs(response) ** 2 * (2j * np.pi * frequency) ** derivative
    if derivative % 2:
        spectrum[-1] = 0.0
    impulse = np.fft.irfft(spectrum, size)
    return read_only(np.roll(impulse, half)[: 2 * half + 1])


def with_context(chunks: Iterable[FloatArray], half: int, *, multiple: int = 1) -> Iterator[FloatArray]:
    """Join consecutive chunks (n_rows, n) and yield windows with `half` samples of context on both sides.

    The interiors of the windows are consecutive, without overlap; all but the last have a length that `multiple`
    divides. Ends are continued by reflection through the end point, `2 x_0 - x_m`. Every result is the same whatever
    the chunks were.
    """
    buffer: FloatArray | None = None
    for chunk in chunks:
        if buffer is None:
            buffer = chunk
            started = False
        else:
            buffer = np.concatenate([buffer, chunk], axis=1)
        if not started and buffer.shape[1] > half:
            buffer = np.concatenate([_reflected(buffer, half), buffer], axis=1)
            started = True
        interior = (buffer.shape[1] - 2 * half) // multiple * multiple if started else 0
        if interior > 0:
            yield buffer[:, : interior + 2 * half]
            buffer = buffer[:, interior:]
    if buffer is None:
        return
    after = _reflected(buffer[:, ::-1], half)[:, ::-1]
    before = buffer[:, :0] if started else _reflected(buffer, half)
    yield np.concatenate([before, buffer, after], axis=1)


def _reflected(rows: FloatArray, half: int) -> FloatArray:
    """Return `half` samples that continue `rows` before its first one; short rows stay at their far end."""
    index = np.minimum(np.arange(half, 0, -1), rows.shape[1] - 1)
    return 2.0 * rows[:, :1] - rows[:, index]
