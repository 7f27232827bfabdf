"""A project that is killed (SIGKILL) at random moments and run again, against one that nobody disturbed.

    python benchmarks/project_kills.py [--kills 20] [--seed 0] [--json]

Each trial is a new folder with a small arm's project, motion to report. `tauhat run` is started in a process of its own,
killed at a moment drawn evenly between its start and the time that the undisturbed run took (drawn again, in a new
folder, where the run had ended before), and started again. Counted are files that differ in any byte from those of the
undisturbed run (the report's line that says when it was written is left out), unfinished files that are still there, and
what the second run did not have to do again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

PROJECT = """
[robot]
source = "two_link"

[motion]
seconds = 4.0
periods = 1
harmonics = 3
starts = 1

[record]
rate = 200.0

[identify]
model = "plain"
constraints = "physical"

[verify]
seconds = 4.0

[export]
formats = ["urdf", "mjcf", "c"]
"""
WRITTEN = re.compile(rb"\d{4}-\d\d-\d\d \d\d:\d\d UTC")


def command(folder: Path) -> list[str]:
    return [sys.executable, "-m", "tauhat", "run", str(folder), "--json"]


def new_folder(folder: Path, text: str = PROJECT) -> Path:
    folder.mkdir(parents=True)
    (folder / "project.toml").write_text(text, encoding="utf-8")
    return folder


def finished(folder: Path) -> dict:
    done = subprocess.run(command(folder), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{folder}: the run failed: {done.stderr}")
    return json.loads(done.stdout)


def left_in(folder: Path) -> dict[str, str]:
    """Every file of a project's folder with the digest of its content, the time in the report left out."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and ".tauhat" not in path.parts)
    contents = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
    return {name: hashlib.sha256(WRITTEN.sub(b"", content)).hexdigest() for name, content in contents.items()}


def killed(folder: Path, seconds: float) -> bool:
    """Run, kill after some seconds; return whether there was something to kill."""
    with subprocess.Popen(command(folder), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        time.sleep(seconds)
        alive = run.poll() is None
        run.kill()
    return alive


def trial(folder: Path, whole: float, reference: dict[str, str], *, chance: np.random.Generator) -> dict:
    seconds = chance.uniform(0.0, whole)
    while not killed(new_folder(folder), seconds):
        shutil.rmtree(folder)
        seconds = chance.uniform(0.0, whole)
    unfinished = len(list(folder.rglob("*.part")))
    steps = finished(folder)["steps"]
    found = left_in(folder)
    different = sorted(name for name in reference.keys() | found.keys() if reference.get(name) != found.get(name))
    return {
        "killed_after": seconds,
        "unfinished_files": unfinished,
        "kept": [step["name"] for step in steps if step["state"] == "kept"],
        "made": [step["name"] for step in steps if step["state"] == "made"],
        "different": different,
        "still_unfinished": len(list(folder.rglob("*.part"))),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    chance = np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        finished(new_folder(folder / "warm"))  # compiles what is compiled once a machine
        began = time.monotonic()
        finished(new_folder(folder / "undisturbed"))
        whole = time.monotonic() - began
        reference = left_in(folder / "undisturbed")
        trials = [trial(folder / f"{number}", whole, reference, chance=chance) for number in range(options.kills)]
    trials.sort(key=lambda one: one["killed_after"])
    result = {
        "seconds": whole,
        "files": len(reference),
        "kills": len(trials),
        "same_result": sum(not one["different"] and not one["still_unfinished"] for one in trials),
        "trials": trials,
    }
    if options.json:
        print(json.dumps(result, indent=1))
        return
    print(f"undisturbed: {whole:.1f} s, {len(reference)} files")
    print(f"{'killed after':>12}  {'unfinished':>10}  {'kept':>4}  {'made':>4}  different")
    for one in trials:
        kept, made = len(one["kept"]), len(one["made"])
        print(
            f"{one['killed_after']:10.2f} s  {one['unfinished_files']:10}  "
            f"{kept:4}  {made:4}  {', '.join(one['different']) or '-'}"
        )
    print(f"same result: {result['same_result']} of {len(trials)}")


if __name__ == "__main__":
    main()
