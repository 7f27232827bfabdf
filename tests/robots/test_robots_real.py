from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tauhat.errors import TauhatWarning
from tauhat.robots import load_robot, pinocchio_model

DATA = Path(os.environ.get("TAUHAT_REAL_DATA", Path(__file__).parents[3] / "shared" / "data"))
# file -> joints, how many doubts the file deserves (impossible tensors)
FILES = {
    "kinova_gen3/gen3.urdf": (7, 3),
    "kr300/kr300_from_dh.urdf": (6, 0),
    "panda/panda.urdf": (7, 0),
    "tx40/tx40_mdh_modified.urdf": (6, 1),
    "ur10e/ur10e.urdf": (6, 0),
    "ur3/ur3_robot.urdf": (6, 0),
    "ur5/ur5_robot.urdf": (6, 0),
}
LOCKED = {"panda/panda.urdf": {"panda_finger_joint1": 0.0}}

pytestmark = [
    pytest.mark.real,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"no measured data at {DATA} (set TAUHAT_REAL_DATA)"),
]


@pytest.mark.parametrize("name", FILES)
def test_a_real_urdf_has_the_dynamics_that_pinocchio_reads_from_it(name) -> None:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not in {DATA}")
    joints, doubts = FILES[name]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = load_robot(path, locked=LOCKED.get(name))
    assert [warning.category for warning in caught] == [TauhatWarning] * doubts
    assert robot.n_v == joints
    full = pin.buildModelFromUrdf(str(path))
    locked = [full.getJointId(joint) for joint in full.names if "finger" in joint]
    theirs = pin.buildReducedModel(full, locked, pin.neutral(full)) if locked else full
    ours = pinocchio_model(robot)
    for state in np.random.default_rng(0).normal(size=(20, 3, joints)):
        expected = pin.rnea(theirs, theirs.createData(), *state)
        found = pin.rnea(ours, ours.createData(), *state)
        np.testing.assert_allclose(found, expected, atol=1e-10, rtol=1e-12)
