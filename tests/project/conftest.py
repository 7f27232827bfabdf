"""A project that was gone through once, and copies of it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from small_project import new_folder

from tauhat.project import load_project, run_project


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = new_folder(tmp_path_factory.mktemp("project") / "finished")
    assert run_project(load_project(folder)).finished
    return folder


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    return shutil.copytree(finished, tmp_path / "copy")
