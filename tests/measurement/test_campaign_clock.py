"""When recordings began on the campaign's clock: by absolute stamps, else by their order."""

import numpy as np
import pytest

from excite_cli.measurement.campaign_clock import on_campaign_clock
from excite_cli.measurement.dataset import Run
from excite_cli.measurement.run_identity import Part

NOON = 1.7e9


def run(name: str, epoch: float | None = None, first: float = 0.0, part: Part = Part()) -> Run:
    t = first + np.arange(101) * 0.1
    return Run(name, t, np.zeros((101, 1)), np.zeros((101, 1)), epoch=epoch, part=part)


def starts(*runs: Run) -> list[float]:
    return [each.start for each in on_campaign_clock(runs)]


def test_stamps_count_from_the_earliest_recording_whatever_the_order_of_files() -> None:
    assert starts(run("b", NOON + 3600.0), run("a", NOON)) == pytest.approx([3600.0, 0.0])


def test_a_first_sample_later_than_zero_is_where_the_campaign_begins() -> None:
    assert starts(run("a", NOON, 5.0), run("b", NOON + 60.0)) == pytest.approx([-5.0, 55.0])


@pytest.mark.parametrize("epoch", [None, NOON, NOON + 8.0])
def test_without_stamps_or_with_such_that_overlap_the_order_counts(epoch: float | None) -> None:
    """A clock that starts anew gives all recordings one epoch; one may also be missing."""
    assert starts(run("a", NOON), run("b", epoch), run("c", NOON + 900.0)) == pytest.approx(
        [0.0, 10.0, 20.0]
    )


def test_clocks_that_are_set_while_they_run_may_cross_a_little() -> None:
    assert starts(run("a", NOON), run("b", NOON + 9.5)) == pytest.approx([0.0, 9.5])


def test_stretches_of_a_recording_share_its_beginning() -> None:
    cut = [run("a", first=20.0 * k, part=Part(k + 1, start=20.0 * k)) for k in range(2)]
    assert starts(*cut, run("b")) == pytest.approx([0.0, 0.0, 30.0])
