"""Errors to expect by speed and load: levels, the own range, joints that nothing is known of."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.report.validity_chart import validity_section
from excite_cli.shown.answer import Charts
from tests.scoring.test_validity import FILTERED, trace

NAMES, UNITS = ("shoulder", "slide"), ("N·m", "N")


def charts(section) -> tuple:
    (block,) = section.blocks
    assert isinstance(block, Charts)
    return block.charts


def test_curves_follow_what_was_left_and_rise_beyond_the_data() -> None:
    section = validity_section([trace(0.2)], FILTERED.as_data(), NAMES, UNITS)
    one, two = charts(section)
    assert (one.title, two.title) == NAMES
    assert (one.axis, two.axis) == ("speed [rad/s]", "speed [m/s]")
    assert one.panels[0].axis == "error to expect [N·m]"
    none, most, more = (curve.y for curve in one.panels[0].series)
    assert np.all(none[:80] == pytest.approx(0.2, rel=0.1))
    assert more[0] == pytest.approx(1.5 * most[0], rel=0.01)
    assert none[-1] == pytest.approx(1.5 * none[0], rel=0.05)
    ((start, end),) = one.shaded
    assert start == pytest.approx(1.0, rel=0.03)
    assert end == pytest.approx(1.5 * start)
    assert "largest load of the data, 9." in one.alternative


def test_joints_without_samples_have_no_chart_and_none_no_section_of_it() -> None:
    made = trace(0.2)
    made = replace(made, measured=np.where([False, True], made.measured, np.nan))
    assert [each.title for each in charts(validity_section([made], {}, NAMES, UNITS))] == ["slide"]
    assert validity_section([], {}, NAMES, UNITS).blocks == ()
