"""Candidates of a search: those whose columns say something."""

from excite_cli.config.data_spec import FilterSpec
from excite_cli.diagnosis.candidates import with_columns
from excite_cli.effects.encoder_offset import EncoderOffset
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.regression import signals_of
from tests.simulation.arms import arm, played


def test_columns_of_rounding_are_left_out() -> None:
    """An upright arm's weight does not change with its first axis: what is left there is rounding.

    It differs from one processor to the next, and given 1e11 rad so did all that was found.
    """
    robot = arm()
    (recorded,) = played(robot).dataset.runs
    run = prepare(recorded, choose_processing([recorded], FilterSpec()))
    zeros = [(EncoderOffset((j,)), 1) for j in range(robot.n)]
    seen = signals_of(run, robot)
    places = {each.effect.joints for each in with_columns(zeros, [seen], [run])}
    assert (0,) not in places
    assert (1,) in places
