"""Figures of motions hold the numbers of their pages, with every axis labelled."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from excite_cli.config.load_spec import load_spec
from excite_cli.criteria.base import singular_values
from excite_cli.errors import MissingExtraError
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.report.plot_figure import matplotlib_part, new_figure, save_figure, save_pages
from excite_cli.summary.figures import result_figures
from tests.report.case import Case

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def drawn(case: Case, name: str) -> Figure:
    problem, result = case
    figure = result_figures(result, problem)[name]()
    assert isinstance(figure, Figure)
    return figure


def lines(axes: Axes) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    return {
        str(line.get_label()): (np.asarray(line.get_xdata()), np.asarray(line.get_ydata()))
        for line in axes.lines
    }


def _unlimited(problem: Problem) -> Problem:
    return build_problem(load_spec(CONFIG, ["constraints={joint_limits: null}"]), CONFIG.parent)


@pytest.mark.parametrize("name", ["condition_numbers", "spectrum", "motion_1", "margins_1"])
def test_every_axis_has_a_label_with_a_unit(case: Case, name: str) -> None:
    figure = drawn(case, name)
    assert figure.axes
    for axes in figure.axes:
        assert "[" in axes.get_ylabel()
        assert "[" in axes.get_xlabel() or not axes.xaxis.get_tick_params()["labelbottom"]
    assert any("[" in axes.get_xlabel() for axes in figure.axes)


def test_motion_shows_positions_speeds_and_accelerations(case: Case) -> None:
    problem, result = case
    motion = result.motions[0]
    figure = drawn(case, "motion_1")
    assert len(figure.axes) == 2 * problem.robot.n
    for joint, name in enumerate(problem.robot.joint_names):
        upper, lower = figure.axes[2 * joint : 2 * joint + 2]
        assert upper.get_title(loc="left") == name
        times, position = lines(upper)["position"]
        q, v, a = problem.trajectory.basis(times).states(motion.coefficients)
        np.testing.assert_allclose(position, q[:, joint])
        np.testing.assert_allclose(lines(lower)["acceleration"][1], a[:, joint] / 10.0)
        limit = problem.robot.limits.velocity[joint]
        np.testing.assert_allclose(lines(lower)["speed"][1], v[:, joint] / limit)
    assert f"{motion.condition_number:.2f} alone" in figure.get_suptitle()
    units = [axes.get_ylabel() for axes in figure.axes[::2]]
    assert units == ["q [rad]", "q [rad]", "q [rad]", "q [rad]", "q [m]"]


def test_motion_shades_what_is_beyond_the_limits_that_the_problem_keeps(case: Case) -> None:
    figure = drawn(case, "motion_1")
    names = case[0].robot.joint_names
    elbow = figure.axes[2 * names.index("elbow")]
    bands = [patch.get_extents().transformed(elbow.transData.inverted()) for patch in elbow.patches]
    (below, above) = bands
    assert (round(below.y1, 6), round(above.y0, 6)) == (-2.6, 2.6)
    assert not figure.axes[2 * names.index("wrist_roll")].patches


def test_without_limits_the_shares_are_of_the_peak_and_dotted(case: Case) -> None:
    problem, result = case
    for axes in drawn((_unlimited(problem), result), "motion_1").axes[1::2]:
        assert not axes.patches
        for line in axes.lines:
            assert np.abs(line.get_ydata()).max() == pytest.approx(1.0)
            assert line.is_dashed()


def test_a_broken_limit_stays_inside_the_panel(case: Case) -> None:
    problem, result = case
    motion = replace(result.motions[0], coefficients=5 * result.motions[0].coefficients)
    for axes in drawn((problem, replace(result, motions=(motion,))), "motion_1").axes:
        for line in axes.lines:
            low, high = axes.get_ylim()
            assert low <= np.min(line.get_ydata())
            assert np.max(line.get_ydata()) <= high


def test_margins_are_those_of_watched_constraints_with_the_worst(case: Case) -> None:
    figure = drawn(case, "margins_1")
    worst = case[1].motions[0].margins["self_collision"]
    titles = [" ".join(axes.get_title(loc="left").split()) for axes in figure.axes]
    assert len(titles) == 2
    assert f"at {worst.time:.3f} s, {worst.label}" in titles[1]
    smallest = lines(figure.axes[1])["smallest margin"][1]
    assert smallest.min() == pytest.approx(worst.margin)
    problem, result = case
    assert "margins_1" not in result_figures(result, _unlimited(problem))


def test_condition_numbers_of_both_kinds(case: Case) -> None:
    _, result = case
    figure = drawn(case, "condition_numbers")
    (axes,) = figure.axes
    assert axes.get_yscale() == "log"
    found = lines(axes)
    for word, motions in (("optimised", result.motions), ("random", result.random)):
        for kind, number in (
            ("alone", "condition_number"),
            ("stacked", "stacked_condition_number"),
        ):
            indices, values = found[f"{word}, {kind}"]
            own = dict(zip(indices, values, strict=True))
            for motion in motions:
                assert own[motion.index] == pytest.approx(getattr(motion, number))
    assert "the best of 20 admissible out of 30 drawn" in figure.get_suptitle()
    beside = {text.get_text() for text in axes.texts}
    assert f"{result.motions[0].condition_number:.3g}" in beside


def test_a_condition_number_that_is_not_finite_is_left_out(case: Case, tmp_path: Path) -> None:
    problem, result = case
    motion = replace(result.motions[0], condition_number=float("inf"))
    figure = drawn((problem, replace(result, motions=(motion,), random=())), "condition_numbers")
    assert set(lines(figure.axes[0])) == {"optimised, alone", "optimised, stacked"}
    save_figure(figure, tmp_path / "figure", "png")


def test_the_spectrum_is_that_of_the_stack(case: Case) -> None:
    problem, result = case
    found = lines(drawn(case, "spectrum").axes[0])
    numbers, sigma = found["optimised"]
    np.testing.assert_array_equal(numbers, np.arange(1, problem.base.rank + 1))
    np.testing.assert_allclose(sigma, singular_values(result.stack.factor))
    assert sigma[0] / sigma[-1] == pytest.approx(result.motions[-1].stacked_condition_number)
    block = problem.objective().block(result.random[0].coefficients)
    expected = singular_values(np.vstack([block, block]))
    np.testing.assert_allclose(found["random"][1], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("kind", "beginning"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_equal_results_give_equal_files(
    case: Case, tmp_path: Path, kind: str, beginning: bytes
) -> None:
    for name in ("first", "second"):
        save_figure(drawn(case, "condition_numbers"), tmp_path / name, kind)
    assert (tmp_path / "first").read_bytes().startswith(beginning)
    assert (tmp_path / "first").read_bytes() == (tmp_path / "second").read_bytes()


def test_pages_of_one_file(tmp_path: Path) -> None:
    save_pages([new_figure(1.0), new_figure(1.0), new_figure(1.0)], tmp_path / "pages")
    assert b"/Count 3" in (tmp_path / "pages").read_bytes()


def test_drawing_leaves_the_users_settings_alone(case: Case) -> None:
    import matplotlib

    with matplotlib.rc_context({"font.size": 31.0}):
        before = dict(matplotlib.rcParams)
        figure = drawn(case, "condition_numbers")
        assert dict(matplotlib.rcParams) == before
    assert figure.axes[0].yaxis.label.get_size() < 12


def test_a_missing_matplotlib_names_the_extra(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[plot\]'"):
        drawn(case, "condition_numbers")
    with pytest.raises(MissingExtraError):
        matplotlib_part("")
