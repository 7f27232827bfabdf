"""MuJoCo's own functions by their addresses, for kernels that step the plant without Python in between."""

from __future__ import annotations

import ctypes
import functools
import warnings
from pathlib import Path
from typing import Any, NamedTuple

from tauhat.errors import TauhatWarning

_NAMES = ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll")


class NativeFunctions(NamedTuple):
    """Addresses of `mj_step`, `mj_forward` and `mj_implicit`, each `void (const mjModel*, mjData*)`."""

    step: int
    forward: int
    implicit: int


@functools.cache
def native_functions(mujoco: Any) -> NativeFunctions | None:
    """Return the addresses in the library that the module itself runs on, or None, with a warning, where none is found.

    Parameters
    ----------
    mujoco : the module
    """
    found = _from_library(mujoco)
    if isinstance(found, str):
        message = f"this MuJoCo is stepped from Python, about ten times slower: {found}"
        warnings.warn(TauhatWarning(message), stacklevel=2)
        return None
    return found


def _from_library(mujoco: Any) -> NativeFunctions | str:
    """Return the addresses, or what is missing."""
    if None in {getattr(kind, "_address", None) for kind in (mujoco.MjModel, mujoco.MjData)}:
        return "its models do not tell their address"
    beside = Path(mujoco.__file__).parent
    files = sorted(path for name in _NAMES for path in beside.glob(name))
    if not files:
        return f"no library beside {beside.name}/__init__.py"
    try:
        library = ctypes.CDLL(str(files[0]))
        if library.mj_version() != mujoco.mj_version():
            return f"{files[0].name} is of another version"
        found = [ctypes.cast(getattr(library, f"mj_{name}"), ctypes.c_void_p).value for name in NativeFunctions._fields]
    except (OSError, AttributeError) as error:
        return str(error)
    return NativeFunctions(*(int(address or 0) for address in found))
