"""Exported C against Pinocchio's RNEA and CRBA, both compiled, in one run.

    python benchmarks/ccode.py [--json] [--eigen FOLDER] [--samples N]

One C++ program builds Pinocchio's model (header-only templates from the wheel, same compiler, same options), includes
the exported header, and times both in turns on the same random states: nothing of Python is in the loop. It needs g++
and Eigen's headers (libeigen3-dev, or `pip install cmeel-eigen` and `--eigen FOLDER`). Without them Pinocchio is timed
from Python, less the cost of a call that does next to nothing, which is the less certain figure. Pinocchio's joints
are the fast fixed-axis ones (JointModelRZ ...) wherever an axis allows. `ratio` takes the faster of Pinocchio's two
figures, compiled here and from the wheel's library less the binding. Aim: faster than Pinocchio's RNEA.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pinocchio as pin

from tauhat.export import c_prefix, ccode, plain_parameters
from tauhat.robots import Robot, central_inertia, load_robot, pinocchio_model

ROBOTS = ("ur5e", "panda", "kuka_iiwa14")
PREFIX = Path(pin.__file__).parents[4]
AXES = {(1, 0, 0): "X", (0, 1, 0): "Y", (0, 0, 1): "Z"}
OPTIONS = (
    "-std=c++17",
    "-O3",
    "-march=native",
    "-DNDEBUG",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
)

PROGRAM = r"""
#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <chrono>
#include <cstdio>
#include <vector>
%(includes)s
using Clock = std::chrono::steady_clock;
using Vector = Eigen::Map<Eigen::VectorXd>;
static pinocchio::SE3 at(std::vector<double> r, std::vector<double> p) {
  return pinocchio::SE3(Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data()), Eigen::Map<Eigen::Vector3d>(p.data())); }
template <int N> struct State { double q[N], v[N], a[N]; };
template <class Rows, class F> static double micro(Rows& rows, F&& once) {
  auto start = Clock::now(); for (auto& row : rows) once(row);
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count() / rows.size(); }
template <int N, class Torque, class Mass>
static void run(pinocchio::Model& model, Torque* torque_in, Mass* matrix_in) {
  Torque* volatile torque = torque_in;  // called through a pointer: nothing is left out because its result is not read
  Mass* volatile matrix = matrix_in;
  std::vector<State<N>> rows(%(samples)d);
  unsigned long long s = 1;
  auto random = [&] { s = s * 6364136223846793005ULL + 1442695040888963407ULL; return 6.0 * ((s >> 11) * (1.0 / 9007199254740992.0)) - 3.0; };
  for (auto& row : rows) for (int j = 0; j < N; ++j) { row.q[j] = random(); row.v[j] = random(); row.a[j] = random(); }
  pinocchio::Data data(model);
  double best[4] = {1e9, 1e9, 1e9, 1e9}, worst = 0, scale = 0, tau[N], mass[N][N], sink = 0;
  auto rnea = [&](auto& row) { pinocchio::rnea(model, data, Vector(row.q, N), Vector(row.v, N), Vector(row.a, N)); sink += data.tau[0]; };
  auto ours = [&](auto& row) { torque(row.q, row.v, row.a, tau); sink += tau[0]; };
  for (auto& row : rows) { rnea(row); ours(row);
    for (int j = 0; j < N; ++j) { worst = std::max(worst, std::abs(tau[j] - data.tau[j])); scale = std::max(scale, std::abs(tau[j])); } }
  for (int k = 0; k < 15; ++k) {
    best[0] = std::min(best[0], micro(rows, rnea));
    best[1] = std::min(best[1], micro(rows, ours));
    best[2] = std::min(best[2], micro(rows, [&](auto& row) { pinocchio::crba(model, data, Vector(row.q, N)); sink += data.M(0, 0); }));
    best[3] = std::min(best[3], micro(rows, [&](auto& row) { matrix(row.q, mass); sink += mass[0][0]; })); }
  std::printf("%%.17g %%.17g %%.17g %%.17g %%.17g %%d\n", best[0], best[1], best[2], best[3], worst / scale, sink == 12345.0);
}
int main() {
%(body)s
}
"""


def array(values: np.ndarray) -> str:
    return "{" + ", ".join(repr(float(value)) for value in np.ravel(values)) + "}"


def joint_model(robot: Robot, index: int) -> str:
    joint = robot.joints[index]
    letter = AXES.get(tuple(joint.axis.tolist()), "")
    if letter:
        return f"pinocchio::JointModel{'R' if joint.kind == 'revolute' else 'P'}{letter}()"
    kind = "Revolute" if joint.kind == "revolute" else "Prismatic"
    return f"pinocchio::JointModel{kind}Unaligned({', '.join(repr(float(x)) for x in joint.axis)})"


def robot_lines(robot: Robot) -> str:
    gravity = ", ".join(repr(float(x)) for x in robot.gravity)
    lines = ["  {\n  pinocchio::Model model;", f"  model.gravity.linear() = Eigen::Vector3d({gravity});"]
    for index, joint in enumerate(robot.joints):
        mass, com, central = central_inertia(joint.inertia)
        place = f"at({array(joint.rotation)}, {array(joint.translation)})"
        body = f"pinocchio::Inertia({mass!r}, at({array(np.eye(3))}, {array(com)}).translation(), at({array(central)}, {{0, 0, 0}}).rotation())"
        lines += [
            f'  model.addJoint({joint.parent + 1}, {joint_model(robot, index)}, {place}, "j{index}");',
            f"  model.appendBodyToJoint({index + 1}, {body}, pinocchio::SE3::Identity());",
        ]
    prefix = c_prefix(robot.name)
    lines.append(f"  run<{robot.n_v}>(model, {prefix}_inverse_dynamics, {prefix}_mass_matrix);\n  }}")
    return "\n".join(lines)


def compiled_times(robots: list[Robot], eigen: Path, samples: int) -> list[list[float]]:
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for robot in robots:
            ccode(robot, plain_parameters(robot.inertia)).save(folder / f"{c_prefix(robot.name)}.h")
        includes = "\n".join(f'#include "{c_prefix(robot.name)}.h"' for robot in robots)
        body = "\n".join(robot_lines(robot) for robot in robots)
        (folder / "main.cpp").write_text(PROGRAM % {"includes": includes, "body": body, "samples": samples})
        places = [f"-I{place}" for place in (PREFIX / "include", eigen, folder)]
        words = ["g++", *OPTIONS, *places, str(folder / "main.cpp"), "-o", str(folder / "timed")]
        built = subprocess.run(words, capture_output=True, text=True, check=False)
        if built.returncode:
            raise SystemExit("\n".join(line for line in built.stderr.splitlines() if "error" in line)[:2000])
        done = subprocess.run([str(folder / "timed")], check=True, capture_output=True, text=True)
    return [[float(word) for word in line.split()[:5]] for line in done.stdout.splitlines()]


def best_of(action, samples: int, repeats: int = 5) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / samples


def python_times(robot: Robot, samples: int) -> tuple[float, float]:
    """Microseconds of `pin.rnea` in a Python loop, and of a binding that takes the same arguments and does little."""
    model = pinocchio_model(robot)
    data = model.createData()
    states = np.random.default_rng(0).normal(size=(samples, 3, robot.n_v))
    rows = [tuple(state) for state in states]

    def solve() -> None:
        for q, v, a in rows:
            pin.rnea(model, data, q, v, a)

    def call() -> None:
        for q, v, _ in rows:
            pin.integrate(model, q, v)

    return best_of(solve, samples), best_of(call, samples)


def measure(eigen: Path | None, samples: int) -> list[dict[str, object]]:
    robots = [load_robot(name) for name in ROBOTS]
    rows: list[dict[str, object]] = []
    for robot in robots:
        whole, binding = python_times(robot, min(samples, 20_000))
        rows.append({"robot": robot.name, "joints": robot.n_v, "pinocchio_python_us": whole, "binding_us": binding})
    if eigen is not None:
        for row, (rnea, ours, crba, mass, error) in zip(rows, compiled_times(robots, eigen, samples), strict=True):
            best = min(rnea, float(row["pinocchio_python_us"]) - float(row["binding_us"]))  # type: ignore[arg-type]
            row |= {"rnea_us": rnea, "inverse_dynamics_us": ours, "ratio": best / ours, "crba_us": crba}
            row |= {"mass_matrix_us": mass, "mass_ratio": crba / mass, "largest_relative_difference": error}
    return rows


def found_eigen(given: Path | None) -> Path | None:
    places = [given] if given else [PREFIX / "include" / "eigen3", Path("/usr/include/eigen3")]
    return next((place for place in places if (place / "Eigen" / "Core").is_file()), None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--eigen", type=Path, help="folder that holds Eigen/Core")
    parser.add_argument("--samples", type=int, default=20_000)
    options = parser.parse_args()
    eigen = found_eigen(options.eigen)
    if eigen is None:
        print("no Eigen headers: only Pinocchio's Python binding is timed", file=sys.stderr)
    rows = measure(eigen, options.samples)
    if options.json:
        print(json.dumps(rows))
        return
    print("microseconds a call, best of 15 (compiled) or 5 (Python)")
    for row in rows:
        print(
            ", ".join(
                f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()
            )
        )


if __name__ == "__main__":
    main()
