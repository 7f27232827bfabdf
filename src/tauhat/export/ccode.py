"""One C99 header with a robot's dynamics for a controller: no allocation, no loops, nothing but math.h."""

from __future__ import annotations

import re

from tauhat.errors import ExportError
from tauhat.export.cfunctions import CFunction, c_functions
from tauhat.export.chead import header_comment
from tauhat.export.exported import ExportedText
from tauhat.export.parameters import StandardParameters, check_parameters
from tauhat.export.traced_memory import STATE
from tauhat.robots.robot import Robot

_LONGEST_PREFIX = 60
_PREFIX = re.compile(r"[a-z][a-z0-9_]*")
_SIGN = re.compile(r"\bsign\(")


def ccode(robot: Robot, parameters: StandardParameters, *, prefix: str = "", fingerprint: str = "") -> ExportedText:
    """Return a header-only C99 file: inverse dynamics, bias, gravity, mass matrix, friction, and the whole torque.

    All numbers of the robot are written into straight-line code, in which what is zero or one is gone. Arrays are of
    fixed size, results may be written over arguments, and every function can be called from any thread. Friction with a
    memory is there twice: as in steady motion, and step by step with states in a struct of the caller.

    Parameters
    ----------
    prefix : of all names, lower case; made from the robot's name by default
    fingerprint : of the model, for the head of the file; the robot's own by default

    Raises
    ------
    ExportError
        when a link is no body, naming it, the parameters are of another robot, or the prefix is no C name.
    """
    check_parameters(robot, parameters)
    prefix = prefix or c_prefix(robot.name)
    if not _PREFIX.fullmatch(prefix) or len(prefix) > _LONGEST_PREFIX:
        expected = f"lower-case letters, digits and _, at most {_LONGEST_PREFIX}"
        raise ExportError("the prefix is no C name", expected=expected, got=prefix[:80])
    guard = f"TAUHAT_{prefix.upper()}_H"
    functions = c_functions(robot, parameters)
    written = [_written(function, prefix, robot.n_v) for function in functions]
    parts = [
        header_comment(robot, parameters, prefix, fingerprint or robot.fingerprint),
        f"#ifndef {guard}\n#define {guard}\n\n#include <math.h>\n\n#define {prefix.upper()}_JOINTS {robot.n_v}\n",
        *([_sign_function(prefix)] if any(f"{prefix}_sign(" in text for text in written) else []),
        *([_state_struct(prefix, robot.n_v, functions[-1].n_bent)] if functions[-1].n_bent else []),
        *written,
        f"#endif /* {guard} */\n",
    ]
    return ExportedText(text="\n".join(parts))


def c_prefix(name: str) -> str:
    """Return a robot's name as the beginning of C names: lower case, `robot_` before a digit."""
    words = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[: _LONGEST_PREFIX - 6]
    return words if words[:1].isalpha() else f"robot_{words}".rstrip("_")


def _written(function: CFunction, prefix: str, n_v: int) -> str:
    lines = function.trace.statements(function.results)
    body = "\n".join(lines)
    size = f"[{n_v}][{n_v}]" if function.output == "mass" else f"[{n_v}]"
    arguments = [
        *([f"{prefix}_friction_state *{STATE}"] if function.n_bent else []),
        *(f"const double {name}[{n_v}]" for name in function.inputs),
        *([f"double {function.output}{size}"] if function.output else []),
    ]
    unused = "".join(f"    (void){name};\n" for name in function.inputs if not re.search(rf"(?<!>)\b{name}\[", body))
    indented = "".join(f"    {re.sub(_SIGN, f'{prefix}_sign(', line)}\n" for line in lines)
    declared = f"static inline void {prefix}_{function.name}({', '.join(arguments)})"
    return f"/* {function.says} */\n{declared}\n{{\n{unused}{indented}}}\n"


def _sign_function(prefix: str) -> str:
    body = "return (double)((value > 0.0) - (value < 0.0));"
    return f"/* -1, 0 or 1. */\nstatic inline double {prefix}_sign(double value)\n{{\n    {body}\n}}\n"


def _state_struct(prefix: str, n_v: int, n_bent: int) -> str:
    return (
        "/* What friction remembers: where the joints were, and how far each gear is bent, -1 to 1. */\n"
        f"typedef struct {{\n    double q[{n_v}];\n    double bent[{n_bent}];\n}} {prefix}_friction_state;\n"
    )
