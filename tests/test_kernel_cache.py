"""After an upgrade no compiled function of another version is left; else nothing is touched."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import tauhat
from tauhat.kernel_cache import forget_older_kernels

MAIN = """
from numba import njit
from package.inner import inner
@njit(cache=True)
def outer(x):
    return inner(x) * 10
"""
INNER = """
from numba import njit
@njit(cache=True)
def inner(x):
    return x + {}
"""


def package(folder: Path) -> Path:
    place = folder / "package"
    (place / "deep" / "__pycache__").mkdir(parents=True)
    (place / "__init__.py").write_text("")
    (place / "outer.py").write_text(MAIN)
    (place / "inner.py").write_text(INNER.format(1))
    (place / "deep" / "__pycache__" / "other_kernel.step-1.py311.1.nbc").write_text("")
    return place


def answer(folder: Path) -> int:
    command = [sys.executable, "-c", "from package.outer import outer; print(outer(1))"]
    return int(subprocess.run(command, cwd=folder, capture_output=True, check=True, text=True).stdout)


def kept(place: Path) -> list[Path]:
    return sorted(place.rglob("*.nb[ci]"))


def test_a_kernel_that_another_file_calls_is_new_after_an_upgrade(tmp_path: Path) -> None:
    place = package(tmp_path)
    forget_older_kernels(place, "1.0")
    assert answer(tmp_path) == 20
    (place / "inner.py").write_text(INNER.format(100))
    assert answer(tmp_path) == 20  # what this is against: Numba goes on with the old one
    forget_older_kernels(place, "1.1")
    assert kept(place) == []
    assert answer(tmp_path) == 1010


def test_within_one_version_nothing_is_deleted(tmp_path: Path) -> None:
    place = package(tmp_path)
    forget_older_kernels(place, "1.0")
    (place / "__pycache__" / "a_kernel.step-1.py311.nbi").write_text("")
    forget_older_kernels(place, "1.0")
    assert len(kept(place)) == 1
    forget_older_kernels(place, "1.1")
    forget_older_kernels(place, "1.0")  # back again: that one is unknown by now
    assert kept(place) == []
    assert [path.name for path in (place / "__pycache__").glob("kernels-*")] == ["kernels-1.0"]


def test_this_package_forgets_its_own_older_kernels_when_it_is_imported(tmp_path: Path) -> None:
    shutil.copytree(Path(tauhat.__file__).parent, tmp_path / "tauhat", ignore=shutil.ignore_patterns("__pycache__"))
    place = tmp_path / "tauhat" / "dynamics" / "__pycache__"
    place.mkdir()
    (place / "old_kernel.step-1.py311.1.nbc").write_text("")
    subprocess.run([sys.executable, "-c", "import tauhat"], cwd=tmp_path, check=True)
    assert kept(tmp_path) == []


def test_other_files_stay_and_a_folder_that_cannot_be_made_is_no_error(tmp_path: Path) -> None:
    place = package(tmp_path)
    forget_older_kernels(place, "1.0")
    assert sorted(path.name for path in place.glob("*.py")) == ["__init__.py", "inner.py", "outer.py"]
    forget_older_kernels(place / "outer.py", "1.0")  # a file: no folder can be made in it
