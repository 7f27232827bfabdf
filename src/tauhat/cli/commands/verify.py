"""`tauhat verify`: how well an estimate predicts recordings it was not fitted to."""

from __future__ import annotations

from dataclasses import dataclass

from tauhat.cli.options import CutoffOption, EstimateArgument, JsonOption, LogArguments, MapOption, RowsOption
from tauhat.cli.output import show
from tauhat.cli.reporting import working


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What `tauhat verify` takes."""

    estimate: EstimateArgument
    logs: LogArguments
    map_file: MapOption = None
    cutoff: CutoffOption = None
    rows: RowsOption = None
    as_json: JsonOption = False


def run(options: Options) -> None:
    """Predict the torque of recordings and tell how far it is from the measured one, joint by joint."""
    from tauhat.cli.inputs import processing_of, recordings_of_estimate
    from tauhat.cli.views.verification import verification_view
    from tauhat.estimation.estimate import load_estimate
    from tauhat.verification.prediction import verify

    estimate = load_estimate(options.estimate)
    processing = processing_of(estimate, cutoff=options.cutoff)
    with working("predicting"):
        recordings = recordings_of_estimate(estimate, options.logs, map_file=options.map_file, rows=options.rows)
        verification = verify(estimate, recordings, processing=processing)
    show(verification.to_dict(), lambda: verification_view(verification), as_json=options.as_json)
