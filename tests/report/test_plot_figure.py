"""Charts of a page as still pictures: the same numbers, looks and grounds."""

from dataclasses import replace

import numpy as np

from excite_cli.report.plot import Curve, Panel, Plot, merged
from excite_cli.report.plot_figure import VERMILION, WIDTH, draw_plots

X = np.linspace(0.0, 4.0, 9)
BROKEN = np.where(X == 2.0, np.nan, X**2)


def plot(*panels: Panel, title: str = "elbow") -> Plot:
    return Plot(title, "words", "time [s]", X, panels, shaded=((1.0, 1.5),))


def two() -> Plot:
    upper = Panel("torque [N·m]", (Curve("model", BROKEN, "vermilion", "dashed"),), span=(-1, 20))
    lower = Panel("left [N·m]", (Curve("left", -X, "blue"),), limits=(-2.0, np.inf))
    return plot(upper, lower)


def test_lines_hold_the_numbers_and_break_where_these_do() -> None:
    upper, lower = draw_plots("title", [two()], 1).axes
    (line,) = upper.lines
    np.testing.assert_array_equal(line.get_xdata(), X)
    np.testing.assert_array_equal(line.get_ydata(), BROKEN)
    assert (line.get_color(), line.get_linestyle()) == (VERMILION, "--")
    assert upper.get_ylim() == (-1, 20)
    np.testing.assert_array_equal(lower.lines[0].get_ydata(), -X)
    assert lower.get_shared_x_axes().joined(upper, lower)
    assert upper.get_xlim() == (0.0, 4.0)
    assert (upper.get_title(loc="left"), lower.get_xlabel()) == ("elbow", "time [s]")


def test_held_out_spans_and_forbidden_values_are_shaded() -> None:
    upper, lower = draw_plots("title", [two()], 1).axes
    spans = [patch.get_extents().transformed(upper.transData.inverted()) for patch in upper.patches]
    assert [np.round([each.x0, each.x1], 6).tolist() for each in spans] == [[1.0, 1.5]]
    below = lower.patches[-1].get_extents().transformed(lower.transData.inverted())
    np.testing.assert_allclose([below.y0, below.y1], [lower.get_ylim()[0], -2.0], atol=1e-9)


def test_points_of_others_do_not_break_a_line_and_whiskers_stand_at_their_own() -> None:
    x, (line, marks) = merged((np.array([0.0, 2.0]), np.array([5.0, 6.0])),
                              (np.array([1.0, 3.0]), np.array([7.0, 8.0])))  # fmt: skip
    series = (
        Curve("law", line, "vermilion"),
        Curve("median", marks, "blue", "marks", low=marks - 1, high=marks + 2),
    )
    both = Plot("a", "b", "speed [rad/s]", x, (Panel("torque [N·m]", series),))
    (axes,) = draw_plots("title", [both], 1).axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [5.0, 6.0])
    (whiskers,) = axes.collections
    assert [each.tolist() for each in whiskers.get_segments()] == [
        [[1.0, 6.0], [1.0, 9.0]], [[3.0, 7.0], [3.0, 10.0]],
    ]  # fmt: skip


def test_one_legend_names_every_look_once_and_nothing_leaves_the_page() -> None:
    long = replace(two(), title="Friction of coupled gears: wrist_2_joint, wrist_3_joint; torque")
    figure = draw_plots("title", [two(), long, two(), two()], 3)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["model", "left"]
    assert len(figure.axes) == 8
    figure.draw_without_rendering()
    height = figure.get_figheight()
    for axes in figure.axes:
        box = axes.get_tightbbox().transformed(figure.dpi_scale_trans.inverted())
        assert box.x0 >= 0
        assert box.x1 <= WIDTH
        assert 0 <= box.y0 < box.y1 <= height - 0.4  # below the title and the legend
    boxes = [axes.get_tightbbox() for axes in figure.axes]
    for k, one in enumerate(boxes):
        assert not any(one.overlaps(other) for other in boxes[k + 2 :])


def test_a_logarithmic_axis_is_one() -> None:
    panel = Panel("error [N·m]", (Curve("rms", X + 1.0, "ink"),), logarithmic=True)
    (axes,) = draw_plots("title", [plot(panel)], 1).axes
    assert axes.get_yscale() == "log"
