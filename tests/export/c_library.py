"""The C header compiled, and its functions called on rows of inputs."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tauhat.arrays import FloatArray
from tauhat.export import StandardParameters, c_prefix, ccode
from tauhat.robots import Robot

COMPILER = shutil.which("gcc") or shutil.which("cc")
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror")
INPUTS = {
    "inverse_dynamics": 3, "bias": 2, "gravity": 1, "mass_matrix": 1, "friction": 3, "torque": 3,
}  # fmt: skip
STEPS = ("friction_step", "torque_step")

needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (gcc or cc) on this machine")


def built(folder: Path, robot: Robot, parameters: StandardParameters) -> Callable[..., FloatArray]:
    """Return a function that calls the compiled header by name on rows of inputs; steps are called in order."""
    n_v, prefix = robot.n_v, c_prefix(robot.name)
    header = ccode(robot, parameters)
    header.save(folder / f"{prefix}.h")
    lines = [f'#include "{prefix}.h"']
    for name, count in INPUTS.items():
        given = ", ".join(f"const double *x{k}" for k in range(count))
        out = f"(double (*)[{n_v}])out" if name == "mass_matrix" else "out"
        passed = ", ".join(f"x{k}" for k in range(count))
        lines.append(f"void call_{name}({given}, double *out) {{ {prefix}_{name}({passed}, {out}); }}")
    if "_friction_state" in header.text:
        kept = f"static {prefix}_friction_state kept;"
        lines += [kept, f"void call_start(const double *x0) {{ {prefix}_friction_start(&kept, x0); }}"]
        given = "const double *x0, const double *x1, const double *x2, double *out"
        lines += [f"void call_{name}({given}) {{ {prefix}_{name}(&kept, x0, x1, x2, out); }}" for name in STEPS]
    (folder / "calls.c").write_text("\n".join(lines) + "\n")
    library = folder / f"{prefix}.so"
    flags = ("-Wno-missing-prototypes", "-O0", "-shared", "-fPIC")
    subprocess.run([COMPILER, *STRICT, *flags, "calls.c", "-o", str(library), "-lm"], check=True, cwd=folder)
    loaded = ctypes.CDLL(str(library))

    def call(name: str, *inputs: FloatArray) -> FloatArray:
        shape = (len(inputs[0]), n_v, n_v) if name == "mass_matrix" else (len(inputs[0]), n_v)
        out = np.full(shape, np.nan)
        rows = [np.ascontiguousarray(part) for part in inputs]
        if name in STEPS:
            loaded.call_start(ctypes.c_void_p(rows[0][0].ctypes.data))
        for row, target in enumerate(out):
            pointers = [ctypes.c_void_p(part[row].ctypes.data) for part in rows]
            getattr(loaded, f"call_{name}")(*pointers, ctypes.c_void_p(target.ctypes.data))
        return out

    return call


def close(found: FloatArray, expected: FloatArray) -> None:
    """Compare to 1e-12 of each joint's largest value; of all joints' where a joint carries nothing but rounding."""
    scale, largest = np.abs(expected).max(axis=0), np.abs(expected).max()
    assert np.isfinite(found).all()
    assert (np.abs(found - expected) <= 1e-12 * np.where(scale > 1e-12 * largest, scale, largest)).all()


def code_of(header: str) -> str:
    """Return a header without its comments."""
    return re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)
