"""Whether a motion excites all that counts, or which parameter it leaves unseen."""

from __future__ import annotations

import numpy as np

from tauhat.arrays import FloatArray
from tauhat.errors import ExcitationError
from tauhat.excitation.criteria import FLOOR
from tauhat.excitation.information import Information


def excited_spectrum(facts: Information, matrix: FloatArray) -> FloatArray:
    """Return the eigenvalues of an information matrix, (n,), smallest first.

    Raises
    ------
    ExcitationError
        when the smallest is nothing but rounding: names the parameter that weighs most in its direction.
    """
    eigenvalues, axes = np.linalg.eigh(matrix)
    if eigenvalues[0] > FLOOR * eigenvalues[-1]:
        return np.asarray(eigenvalues)
    model = facts.model
    index = int(facts.columns[np.abs(axes[:, 0]).argmax()])
    owner = [term.key for term in model.terms for _ in term.parameters(model.robot)][index]
    parameter = model.parameters[index]
    raise ExcitationError(
        f"no motion was found that excites {parameter.name} of the term {owner}",
        where=f"joint {model.robot.joint_names[parameter.joint]}",
        remedy="widen the limits that hold the joints, or leave the term out",
    )
