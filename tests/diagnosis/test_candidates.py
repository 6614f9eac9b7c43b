"""Candidates of a search: those whose columns say something."""

from pathlib import Path

from excite_cli.api.loading import load_case, load_data
from excite_cli.config.data_spec import FilterSpec
from excite_cli.diagnosis.candidates import with_columns
from excite_cli.effects.encoder_offset import EncoderOffset
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import signals_of

KR300 = Path(__file__).parents[2] / "data" / "kr300"


def test_columns_of_rounding_are_left_out() -> None:
    """An upright arm's weight does not change with its first axis: what is left there is rounding.

    It differs from one processor to the next, and given 1e11 rad so did all that was found.
    """
    case = load_case(KR300 / "kr300.yaml")
    recorded = load_data(case, KR300 / "kr300.h5", tell=lambda note: None).runs[0]
    run = prepare(recorded, choose_processing([recorded], FilterSpec()))
    zeros = [(EncoderOffset((j,)), 1) for j in range(case.robot.n)]
    found = with_columns(zeros, [signals_of(run, case.robot)], [run])
    places = {each.effect.joints for each in found}
    assert (0,) not in places
    assert (1,) in places
