"""The library keeps its own rules: names resolve, imports point one way and stay light, data is read-only."""

from __future__ import annotations

import ast
import importlib
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest

import tauhat
from sample_arms import planar_arm, planar_truth
from tauhat.dynamics import base_parameters
from tauhat.dynamics.tree import kernel_tree
from tauhat.estimation import OrdinaryLeastSquares, collect, identify
from tauhat.recordings.filters import low_pass
from tauhat.recordings.processing import Processing
from tauhat.robots import forward_kinematics, load_robot
from tauhat.verification import verify

ROOT = Path(tauhat.__file__).parent
MODULES = sorted(path.relative_to(ROOT).with_suffix("").parts for path in ROOT.rglob("*.py"))
ROOMS = sorted(name for _, name, is_package in pkgutil.iter_modules([str(ROOT)]) if is_package)

LEVELS = {
    name: level
    for level, names in enumerate(
        [
            ("kernel_cache",),
            ("", "errors", "blas"),
            ("workers",),
            ("cluster",),
            ("arrays",),
            ("files", "plain_data"),
            ("robots",),
            ("recordings",),
            ("dynamics",),
            ("control",),
            ("estimation", "excitation"),
            ("simulation", "sensing"),
            ("verification",),
            ("studies",),
            ("export", "report"),
            ("live",),
            ("project",),
            ("cli",),
            ("__main__",),
        ]
    )
    for name in names
}
HOMES = {
    "pinocchio": {"robots", "dynamics", "excitation/limits", "sensing/wrench"},
    "coal": {"robots", "dynamics", "excitation/limits", "sensing/wrench"},
    "mujoco": {"simulation"},
    "plotly": {"report"},
    "viser": {"report"},
    "websockets": {"live"},
    "jinja2": {"report"},
    "typer": {"cli"},
    "distributed": {"cluster"},
}
HEAVY = (
    "numba",
    "pinocchio",
    "mujoco",
    "plotly",
    "polars",
    "scipy",
    "jinja2",
    "viser",
    "websockets",
    "rich.table",
    "pandas",
    "distributed",
)


def imports(parts: tuple[str, ...]) -> Iterator[str]:
    """Yield the full name of every module that a file imports, also inside functions."""
    tree = ast.parse(ROOT.joinpath(*parts).with_suffix(".py").read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in {parts}"
            yield str(node.module)


def room(parts: tuple[str, ...]) -> str:
    return "" if parts == ("__init__",) else parts[0]


@pytest.mark.parametrize("parts", MODULES, ids="/".join)
def test_imports_point_upwards_only(parts):
    own = room(parts)
    for name in imports(parts):
        if name.startswith("tauhat.") and name.split(".")[1] != own:
            other = name.split(".")[1]
            assert LEVELS[other] < LEVELS[own], f"{'/'.join(parts)} imports {name}"


@pytest.mark.parametrize("parts", MODULES, ids="/".join)
def test_special_libraries_stay_in_their_rooms(parts):
    places = {parts[0], "/".join(parts[:2])}
    for name in imports(parts):
        homes = HOMES.get(name.split(".")[0])
        assert homes is None or places & homes, f"{'/'.join(parts)} imports {name}"


def test_the_layer_rule_knows_every_room():
    assert set(ROOMS) <= set(LEVELS)
    assert {"robots", "recordings", "dynamics", "estimation", "verification", "cli"} <= set(ROOMS)


@pytest.mark.parametrize("name", ["tauhat", *(f"tauhat.{name}" for name in ROOMS)])
def test_every_public_name_resolves_and_is_listed_once(name):
    module = importlib.import_module(name)
    listed = getattr(module, "__all__", [])
    assert len(set(listed)) == len(listed)
    assert [entry for entry in listed if not hasattr(module, entry)] == []


@pytest.mark.parametrize("name", [name for name in ROOMS if name != "cli"])
def test_a_rooms_init_only_hands_names_on(name):
    tree = ast.parse((ROOT / name / "__init__.py").read_text(encoding="utf-8"))
    for node in tree.body:
        handed = isinstance(node, ast.ImportFrom | ast.Expr)
        assert handed or (isinstance(node, ast.Assign) and node.targets[0].id == "__all__"), ast.unparse(node)


@pytest.mark.parametrize("statement", ["import tauhat", "import tauhat.cli", "import tauhat.cli.app"])
def test_the_command_line_starts_without_heavy_libraries(statement):
    code = f"{statement}; import sys; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_importing_scientific_rooms_does_not_load_what_few_need():
    code = "import tauhat.recordings, tauhat.estimation, tauhat.verification, sys; print(sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(ast.literal_eval(done.stdout))
    assert not loaded & {"pinocchio", "mujoco", "plotly", "polars", "scipy.signal", "jinja2"}


def test_no_module_uses_print_assert_or_a_broad_except():
    for parts in MODULES:
        tree = ast.parse(ROOT.joinpath(*parts).with_suffix(".py").read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            where = f"{'/'.join(parts)}, line {getattr(node, 'lineno', 0)}"
            assert not isinstance(node, ast.Assert), where
            assert not (isinstance(node, ast.ExceptHandler) and node.type is None), where
            assert not (isinstance(node, ast.Name) and node.id == "print"), where


def dataclasses_of(parts: tuple[str, ...]) -> list[type]:
    if parts[-1].startswith("__main__"):
        return []
    name = ".".join(("tauhat", *(part for part in parts if part != "__init__")))
    module = importlib.import_module(name)
    found = [value for value in vars(module).values() if isinstance(value, type) and is_dataclass(value)]
    return [value for value in found if value.__module__ == name]


@pytest.mark.parametrize("parts", MODULES, ids="/".join)
def test_every_dataclass_is_frozen_and_slotted(parts):
    for found in dataclasses_of(parts):
        assert found.__dataclass_params__.frozen, found
        assert "__slots__" in vars(found), found


@pytest.mark.parametrize("name", ROOMS)
def test_every_public_dataclass_takes_keywords_only(name):
    module = importlib.import_module(f"tauhat.{name}")
    public = [getattr(module, entry) for entry in getattr(module, "__all__", [])]
    for found in public:
        if isinstance(found, type) and is_dataclass(found):
            assert all(field.kw_only for field in fields(found) if field.init), found


@pytest.fixture(scope="module")
def specimens() -> tuple[object, ...]:
    truth, settings = planar_truth(), Processing(cutoff=10.0, motion_cutoff=30.0)
    recording = truth.recording(seconds=5.0)
    base = base_parameters(truth.model)
    evidence = collect(truth.model, base, recording, settings)
    estimate = identify(truth.model, [recording], processing=settings)
    panda = load_robot("panda")
    pose = forward_kinematics(panda, np.zeros(panda.n_v), frame=panda.joint_names[-1])
    return (
        *(planar_arm(), planar_arm().joints[0], panda, *panda.frames, pose, kernel_tree(panda)),
        *(recording, low_pass(5.0, 100.0), base, evidence, evidence.blocks[0], evidence.total),
        *(OrdinaryLeastSquares().fit(evidence), estimate, verify(estimate, [recording]).logs[0]),
    )


def arrays_in(value: object) -> Iterator[np.ndarray]:
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from arrays_in(item)


def arrays_of(specimen: object) -> list[tuple[str, np.ndarray]]:
    names = [field.name for field in fields(specimen)]
    return [
        (f"{type(specimen).__name__}.{name}", array) for name in names for array in arrays_in(getattr(specimen, name))
    ]


def test_arrays_of_data_classes_are_read_only(specimens):
    held = [pair for specimen in specimens for pair in arrays_of(specimen)]
    assert len(held) > 40
    assert sorted({name for name, array in held if array.flags.writeable}) == []


def test_fields_of_data_classes_cannot_be_set(specimens):
    for specimen in specimens:
        with pytest.raises(FrozenInstanceError):
            setattr(specimen, fields(specimen)[0].name, None)


def test_constructors_copy_what_they_are_given():
    gravity = np.array([0.0, 0.0, -9.81])
    robot = planar_arm().with_gravity(gravity)
    gravity[2] = 5.0
    assert robot.gravity[2] == -9.81
