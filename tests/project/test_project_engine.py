"""Steps of text files: what is kept, what is made again, and that no moment is a bad one to be killed."""

from __future__ import annotations

import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from tauhat.errors import OutputError, ProjectError, TauhatWarning
from tauhat.files import write_text
from tauhat.project.lock import only_run
from tauhat.project.manifest import load_manifest, manifest_path
from tauhat.project.running import ProjectRun, plan_steps, run_steps
from tauhat.project.step import Step, log_files, with_named_files

MADE = ("made", "made", "made")
KEPT = ("kept", "kept", "kept")


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def double(folder: Path, source: str, outputs: tuple[str, ...]) -> None:
    for output in outputs:
        write_text(folder / output, 2 * text_of(folder / source))


def first(folder: Path, letters: int) -> None:
    write_text(folder / "one/a.txt", text_of(folder / "source.txt")[:letters])


def three_steps(folder: Path, *, letters: int = 2) -> tuple[Step, ...]:
    """Return a chain: the first letters of a file, doubled into two files, of which one is doubled again."""
    return (
        Step(
            name="one",
            settings={"letters": letters},
            files=(folder / "source.txt",),
            outputs=("one/a.txt",),
            make=partial(first, folder, letters),
        ),
        Step(
            name="two",
            settings={},
            reads=("one/a.txt",),
            outputs=("b.txt", "c.txt"),
            make=partial(double, folder, "one/a.txt", ("b.txt", "c.txt")),
        ),
        Step(
            name="three",
            settings={},
            reads=("c.txt",),
            outputs=("d.txt",),
            make=partial(double, folder, "c.txt", ("d.txt",)),
        ),
    )


def states(run: ProjectRun) -> tuple[str, ...]:
    return tuple(step.state for step in run.steps)


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "source.txt").write_text("abcdef", encoding="utf-8")
    return tmp_path


@pytest.fixture
def made(place: Path) -> Path:
    assert states(run_steps(place, three_steps(place))) == MADE
    assert text_of(place / "d.txt") == 4 * "ab"
    return place


def test_what_did_not_change_is_kept(made: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in made.rglob("*.txt")}
    assert states(run_steps(made, three_steps(made))) == KEPT
    assert {path: path.stat().st_mtime_ns for path in made.rglob("*.txt")} == before


def test_a_changed_setting_makes_its_step_and_those_after_it(made: Path) -> None:
    steps = three_steps(made, letters=3)
    planned = plan_steps(made, steps)
    assert [step.reasons for step in planned.steps] == [
        ("letters changed",),
        ("one is made before it",),
        ("two is made before it",),
    ]
    assert states(run_steps(made, steps)) == MADE
    assert text_of(made / "d.txt") == 4 * "abc"


def test_a_changed_file_makes_its_step_and_only_those_whose_input_became_another(made: Path) -> None:
    (made / "source.txt").write_text("abXYZ", encoding="utf-8")
    run = run_steps(made, three_steps(made))
    assert states(run) == ("made", "kept", "kept")  # the first two letters are the same
    assert run.steps[0].reasons == ("file source.txt changed",)
    (made / "source.txt").write_text("xy", encoding="utf-8")
    assert states(run_steps(made, three_steps(made))) == MADE


@pytest.mark.parametrize(
    ("name", "expected"),
    [("one/a.txt", ("made", "kept", "kept")), ("b.txt", ("kept", "made", "kept")), ("d.txt", ("kept", "kept", "made"))],
)
@pytest.mark.parametrize("spoil", [lambda path: path.write_text("ab?"), Path.unlink], ids=["damaged", "missing"])
def test_an_output_that_is_damaged_or_missing_is_made_again(
    made: Path, name: str, expected: tuple[str, ...], spoil: Callable[[Path], object]
) -> None:
    good = text_of(made / name)
    spoil(made / name)
    assert any(name in reason for step in plan_steps(made, three_steps(made)).steps for reason in step.reasons)
    assert states(run_steps(made, three_steps(made))) == expected
    assert text_of(made / name) == good


@pytest.mark.parametrize("text", ["", "{", "[]", '{"step": "two"}'])
def test_a_damaged_manifest_only_costs_its_step(made: Path, text: str) -> None:
    path = manifest_path(made, "two")
    path.write_text(text, encoding="utf-8")
    assert states(run_steps(made, three_steps(made))) == ("kept", "made", "kept")


def test_a_manifest_that_was_edited_is_not_believed(made: Path) -> None:
    path = manifest_path(made, "one")
    path.write_text(text_of(path).replace('"letters": 2', '"letters": 3'), encoding="utf-8")
    assert load_manifest(made, "one") is None
    assert load_manifest(made, "two") is not None


def test_a_forced_step_is_made_and_those_after_it_are_kept_when_it_comes_out_the_same(made: Path) -> None:
    run = run_steps(made, three_steps(made), forced=["two"])
    assert states(run) == ("kept", "made", "kept")
    assert run.steps[1].reasons == ("it is asked for",)


def test_a_plan_changes_nothing(place: Path) -> None:
    assert states(plan_steps(place, three_steps(place))) == ("to make", "to make", "to make")
    assert [path.name for path in place.iterdir()] == ["source.txt"]


def test_a_folder_that_moved_is_up_to_date(made: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    moved = shutil.copytree(made, tmp_path_factory.mktemp("elsewhere") / "folder")
    assert states(run_steps(moved, three_steps(moved))) == KEPT


def test_another_version_makes_everything_again(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauhat.__version__", "99.0")
    run = run_steps(made, three_steps(made))
    assert states(run) == MADE
    assert run.steps[0].reasons == ("tauhat changed",)


def test_a_step_waits_for_files_that_people_bring_and_then_goes_on(place: Path) -> None:
    log = place / "log.csv"
    one, two, three = three_steps(place)
    steps = (one, Step(name="two", settings={}, outputs=two.outputs, reads=two.reads, awaited=(log,), make=two.make))
    steps = (*steps, three)
    for run in (plan_steps(place, steps[1:]), run_steps(place, steps)):
        assert run.awaited == (log,)
        assert not run.finished
        assert states(run)[-2:] == ("waits", "not reached")
    assert (place / "one/a.txt").exists()
    log.write_text("1", encoding="utf-8")
    assert states(run_steps(place, steps)) == ("kept", "made", "made")
    log.write_text("2", encoding="utf-8")
    assert states(run_steps(place, steps)) == ("kept", "made", "kept")


def test_a_step_that_fails_leaves_those_before_it(place: Path) -> None:
    def fail() -> None:
        raise ProjectError("no")

    one, two, three = three_steps(place)
    bad = Step(name="two", settings={}, outputs=two.outputs, make=fail)
    with pytest.raises(ProjectError, match=r"^no$"):
        run_steps(place, (one, bad, three))
    assert states(run_steps(place, three_steps(place))) == ("kept", "made", "made")


def test_a_step_that_leaves_nothing_is_an_error(place: Path) -> None:
    idle = Step(name="idle", settings={}, outputs=("x.txt",), make=lambda: None)
    with pytest.raises(ProjectError, match=r"step idle did not leave x\.txt"):
        run_steps(place, (idle,))


def test_warnings_of_a_step_are_given_again_when_it_is_kept(place: Path) -> None:
    def warn() -> None:
        warnings.warn("doubtful: 7", TauhatWarning, stacklevel=1)
        write_text(place / "x.txt", "x")

    step = Step(name="warns", settings={}, outputs=("x.txt",), make=warn)
    for state in ("made", "kept"):
        with pytest.warns(TauhatWarning, match="doubtful: 7"):
            run = run_steps(place, (step,))
        assert (run.steps[0].state, run.steps[0].warnings) == (state, ("doubtful: 7",))


class KilledError(BaseException):
    """Stands for the end of the process: nothing cleans up after it."""


def killed_at(write: int, folder: Path, monkeypatch: pytest.MonkeyPatch, *, renamed: bool) -> bool:
    """Run until a certain file is about to be renamed, or just was; return whether the run got that far."""
    writes = 0
    rename = Path.replace

    def dying(self: Path, target: Path) -> Path:
        nonlocal writes
        if writes == write:
            if renamed:
                rename(self, target)
            raise KilledError
        writes += 1
        return rename(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", dying)
        patch.setattr("tauhat.files._discard", lambda _: None)
        try:
            run_steps(folder, three_steps(folder, letters=3))
        except KilledError:
            return True
    return False


@pytest.mark.parametrize("renamed", [False, True], ids=["before the rename", "after it"])
@pytest.mark.parametrize("old", [False, True], ids=["new folder", "over an older result"])
def test_killed_at_any_write_a_run_goes_on_to_the_same_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, renamed: bool, old: bool
) -> None:
    write, whole = 0, True
    while whole:
        folder = tmp_path / str(write)
        folder.mkdir()
        (folder / "source.txt").write_text("abcdef", encoding="utf-8")
        if old:
            run_steps(folder, three_steps(folder))
        whole = killed_at(write, folder, monkeypatch, renamed=renamed)
        assert len(list(folder.rglob("*.part"))) == (1 if whole and not renamed else 0)
        assert run_steps(folder, three_steps(folder, letters=3)).finished
        texts = {path.name: text_of(path) for path in folder.rglob("*.txt")}
        assert texts == {
            "source.txt": "abcdef",
            "a.txt": "abc",
            "b.txt": 2 * "abc",
            "c.txt": 2 * "abc",
            "d.txt": 4 * "abc",
        }
        assert list(folder.rglob("*.part")) == []
        write += 1
    assert write == 8  # four outputs, three manifests, and the run that was not killed


def test_only_unfinished_files_of_the_project_are_deleted(made: Path) -> None:
    own = made / "one" / f".a.txt.{12 * 'a'}.part"
    others = [made / f".other.txt.{12 * 'a'}.part", made / ".b.txt.part", made / f".b.txt.{12 * 'x'}.part"]
    for path in (own, *others):
        path.write_text("", encoding="utf-8")
    run_steps(made, three_steps(made))
    assert [path.exists() for path in (own, *others)] == [False, True, True, True]


def test_a_second_run_is_told_who_works(made: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from tauhat.project.lock import only_run\n"
        f"with only_run(Path({str(made)!r})):\n    print('held', flush=True); sys.stdin.read()"
    )
    holder = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "held\n"
    with pytest.raises(ProjectError, match=rf"another run works in this folder; got process {holder.pid}, since 2"):
        run_steps(made, three_steps(made))
    assert states(plan_steps(made, three_steps(made))) == KEPT
    holder.kill()
    holder.communicate()
    assert f'"pid": {holder.pid}' in text_of(made / ".tauhat" / "lock")  # what it left is no lock
    assert states(run_steps(made, three_steps(made))) == KEPT
    assert text_of(made / ".tauhat" / "lock") == ""


def test_a_folder_that_cannot_be_written_to_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written to"), only_run(tmp_path / "nowhere"):
        pass


def test_files_that_a_settings_file_names_are_inputs_with_it(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.toml").write_text('limits = "b.toml"\nother = "gone.stl"\nlist = [{file = "sub/c.csv"}, 3]', "utf-8")
    (tmp_path / "b.toml").write_text('[[meshes]]\nfile = "d.stl"\nback = "a.toml"', "utf-8")
    (tmp_path / "d.stl").write_text("", "utf-8")
    (tmp_path / "sub" / "c.csv").write_text("", "utf-8")
    named = {path.relative_to(tmp_path).as_posix() for path in with_named_files(tmp_path / "a.toml")}
    assert named == {"a.toml", "b.toml", "d.stl", "sub/c.csv"}
    (tmp_path / "b.toml").write_text("no = toml = at all", "utf-8")
    assert tmp_path / "b.toml" in with_named_files(tmp_path / "a.toml")


def test_a_log_brings_its_map_and_the_files_that_the_map_names(tmp_path: Path) -> None:
    log, log_map = tmp_path / "run.csv", tmp_path / "run.map.toml"
    assert log_files(log, None) == (log,)
    log_map.write_text('[torque]\nfile = "tau.csv"', "utf-8")
    (tmp_path / "tau.csv").write_text("", "utf-8")
    assert log_files(log, None) == (log, log_map, tmp_path / "tau.csv")
    assert log_files(log, tmp_path / "other.toml") == (log, tmp_path / "other.toml")
