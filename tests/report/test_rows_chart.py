"""Rows of marks along one axis: places to scale, ticks that read, words that are safe."""

import math
import re
from itertools import pairwise

import pytest

from excite_cli.report.rows_chart import Axis, Bar, Mark, Row, rows_chart

CIRCLE = re.compile(r'<circle cx="([\d.]+)" cy="([\d.]+)"[^>]*><title>([^<]*)</title>')


def _circles(svg: str) -> dict[str, tuple[float, float]]:
    return {told: (float(x), float(y)) for x, y, told in CIRCLE.findall(svg)}


def test_marks_lie_where_their_values_do() -> None:
    axis = Axis.about("torque [N·m]", [0.0, 10.0])
    rows = [Row("a", (Mark(2.0, "m", "blue"),)), Row("b", (Mark(6.0, "m", "blue"),)),
            Row("c", (Mark(10.0, "m", "blue"),))]  # fmt: skip
    found = _circles(rows_chart("t", "w", axis, rows).svg)
    (x1, y1), (x2, y2), (x3, y3) = (
        found[f"{n}, m {v}"] for n, v in (("a", 2), ("b", 6), ("c", 10))
    )
    assert x2 - x1 == pytest.approx(x3 - x2, abs=0.11)
    assert y1 < y2 < y3


def test_a_logarithmic_axis_has_equal_ratios_and_room() -> None:
    axis = Axis.logarithmic_about("error [%]", [1.0, 10.0, 100.0])
    one, ten, hundred = (axis.share(x) for x in (1.0, 10.0, 100.0))
    assert ten - one == pytest.approx(hundred - ten)
    assert 0.0 < one < hundred < 1.0
    assert {1.0, 10.0, 100.0} <= set(axis.ticks)
    narrow = Axis.logarithmic_about("error [%]", [5.0, 5.5])
    assert min(narrow.ticks) <= 5.0 < 5.5 < max(narrow.ticks)


@pytest.mark.parametrize("values", [[-3.0, 500.0], [0.002, 80.0], [-900.0, -0.01]])
def test_decades_to_both_sides_of_zero_keep_order_and_signs(values: list[float]) -> None:
    axis = Axis.about("x [kg]", [0.0, *values], linear=0.01)
    assert axis.linear == 0.01
    xs = sorted([0.0, *values, 0.005, -0.005])
    shares = [axis.share(x) for x in xs]
    assert shares == sorted(shares)
    assert len(set(shares)) == len(shares)
    assert 0.0 in axis.ticks
    assert list(axis.ticks) == sorted(axis.ticks)
    for tick in axis.ticks:
        assert tick == 0.0 or math.log10(abs(tick)) == pytest.approx(round(math.log10(abs(tick))))


def test_values_of_one_size_have_an_even_axis() -> None:
    axis = Axis.about("x [kg]", [-0.4, 1.3], linear=1.0)
    assert axis.linear is None
    steps = {round(b - a, 9) for a, b in pairwise(axis.ticks)}
    assert len(steps) == 1
    assert 3 <= len(axis.ticks) <= 7


def test_every_word_is_once_in_the_legend_and_nothing_is_markup() -> None:
    evil = '<script>"&'
    row = Row(evil, (Mark(1.0, evil, "blue"), Mark(2.0, "b", "green", "cross")),
              (Bar(0.5, 3.0, "muted", word="range"),), "5 %")  # fmt: skip
    chart = rows_chart("t", "w", Axis.about(evil, [0.0, 3.0]), [row, row], noted="std")
    assert "<script" not in chart.svg
    assert chart.svg.count(">b</text>") == chart.svg.count(">range</text>") == 1
    assert chart.svg.count(">5 %</text>") == 2
    assert chart.svg.count("<title>") == 6  # two marks in two rows and in the legend


def test_figures_of_ticks_do_not_cover_each_other() -> None:
    axis = Axis.about("x [kg]", [-500.0, 500.0], linear=1e-4)
    svg = rows_chart("t", "w", axis, [Row("a", (Mark(1.0, "m", "blue"),))]).svg
    ticks = re.findall(
        r'<text x="([\d.]+)" y="[\d.]+" text-anchor="middle" [^>]*>(-?[\d.e-]+)<', svg
    )
    ends = [(float(x) - 2.25 * len(t), float(x) + 2.25 * len(t)) for x, t in ticks]
    assert len(ends) >= 3
    assert all(one[1] < two[0] for one, two in pairwise(ends))
