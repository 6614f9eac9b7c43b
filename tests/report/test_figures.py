"""Figures hold the data of the result, with every axis labelled."""

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
from excite_cli.excitation.admissible import fine_margins, fine_times
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.report.condition_figure import draw_condition_numbers, draw_spectrum
from excite_cli.report.motion_figure import draw_margins, draw_motion, watched_constraints
from excite_cli.report.style import matplotlib_part, new_figure, save_figure, save_pages
from tests.report.case import Case

CONFIG = Path(__file__).parents[2] / "configs" / "smoke.yaml"


def _line(axes: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    line = next(line for line in axes.lines if str(line.get_label()).startswith(label))
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def _levels(axes: Axes) -> list[float]:
    """Heights of the lines drawn across the panel at a limit."""
    return [line.get_ydata()[0] for line in axes.lines if len(line.get_ydata()) == 2]


def _unlimited(problem: Problem) -> Problem:
    return build_problem(load_spec(CONFIG, ["constraints={joint_limits: null}"]), CONFIG.parent)


@pytest.mark.parametrize("name", ["condition numbers", "spectrum", "motion", "margins"])
def test_every_axis_has_a_label_with_a_unit(case: Case, name: str) -> None:
    problem, result = case
    figure = {
        "condition numbers": lambda: draw_condition_numbers(result),
        "spectrum": lambda: draw_spectrum(result, problem),
        "motion": lambda: draw_motion(result.motions[0], problem),
        "margins": lambda: draw_margins(result.motions[0], problem),
    }[name]()
    assert figure.axes
    for axes in figure.axes:
        assert "[" in axes.get_ylabel()
        below = axes.get_xlabel()
        shares = len(axes.get_shared_x_axes().get_siblings(axes)) > 1
        assert "[" in below or shares or not axes.xaxis.get_tick_params()["labelbottom"]
    assert any("[" in axes.get_xlabel() for axes in figure.axes)


def test_motion_shows_positions_velocities_and_accelerations(case: Case) -> None:
    problem, result = case
    motion = result.motions[0]
    figure = draw_motion(motion, problem)
    assert len(figure.axes) == 2 * problem.robot.n
    limits = problem.robot.limits
    for joint, name in enumerate(problem.robot.joint_names):
        upper, lower = figure.axes[2 * joint : 2 * joint + 2]
        assert upper.get_title(loc="left") == name
        position = upper.lines[-1]
        times = np.asarray(position.get_xdata())
        q, v, a = problem.trajectory.basis(times).states(motion.coefficients)
        np.testing.assert_allclose(position.get_ydata(), q[:, joint])
        np.testing.assert_allclose(lower.lines[0].get_ydata(), a[:, joint] / 10.0)
        np.testing.assert_allclose(lower.lines[1].get_ydata(), v[:, joint] / limits.velocity[joint])
    assert f"{motion.condition_number:.2f} alone" in figure.get_suptitle()


def test_motion_draws_the_limits_that_the_problem_keeps(case: Case) -> None:
    problem, result = case
    figure = draw_motion(result.motions[0], problem)
    names = problem.robot.joint_names
    elbow = figure.axes[2 * names.index("elbow")]
    assert _levels(elbow) == [-2.6, 2.6]
    assert elbow.get_ylim()[0] < -2.6
    assert elbow.get_ylim()[1] > 2.6
    assert _levels(figure.axes[2 * names.index("wrist_roll")]) == []


def test_a_sliding_joint_is_in_metres(case: Case) -> None:
    problem, result = case
    figure = draw_motion(result.motions[0], problem)
    units = [axes.get_ylabel() for axes in figure.axes[::2]]
    assert units == ["q [rad]", "q [rad]", "q [rad]", "q [rad]", "q [m]"]


def test_without_limits_the_shares_are_of_the_peak_and_dotted(case: Case) -> None:
    problem, result = case
    figure = draw_motion(result.motions[0], _unlimited(problem))
    for axes in figure.axes[1::2]:
        assert _levels(axes) == []
        for line in axes.lines:
            assert np.abs(line.get_ydata()).max() == pytest.approx(1.0)
            assert line.is_dashed()
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "no limit: share of peak" in legend


def test_a_broken_limit_stays_inside_the_panel(case: Case) -> None:
    problem, result = case
    motion = replace(result.motions[0], coefficients=5 * result.motions[0].coefficients)
    for axes in draw_motion(motion, problem).axes:
        for line in axes.lines:
            low, high = axes.get_ylim()
            assert low <= np.min(line.get_ydata())
            assert np.max(line.get_ydata()) <= high


def test_margins_are_the_smallest_of_all_columns(case: Case) -> None:
    problem, result = case
    motion = result.motions[0]
    figure = draw_margins(motion, problem)
    times = fine_times(problem)
    margins = dict(
        zip(
            [constraint.name for constraint in problem.constraints],
            fine_margins(problem, motion.coefficients, times),
            strict=True,
        )
    )
    torque, collision = watched_constraints(problem)
    assert [torque.name, collision.name] == ["joint_torque", "self_collision"]
    expected = (margins["joint_torque"] / torque.scale, margins["self_collision"])
    for axes, columns in zip(figure.axes, expected, strict=True):
        line = next(line for line in axes.lines if len(line.get_xdata()) == len(times))
        np.testing.assert_allclose(line.get_xdata(), times)
        np.testing.assert_allclose(line.get_ydata(), columns.min(axis=1))
    worst = motion.margins["self_collision"]
    said = figure.axes[1].get_title(loc="right")
    assert said == f"worst: {worst.margin:.3g} m at {worst.time:.2f} s, {worst.label}"


def test_no_constraints_to_watch(case: Case) -> None:
    assert watched_constraints(_unlimited(case[0])) == ()


def test_condition_numbers_of_both_kinds(case: Case) -> None:
    _, result = case
    axes = draw_condition_numbers(result).axes[0]
    assert axes.get_yscale() == "log"
    for word, motions in (("optimised", result.motions), ("random", result.random)):
        indices, own = _line(axes, f"{word}, motion alone")
        np.testing.assert_array_equal(indices, [m.index for m in motions])
        np.testing.assert_allclose(own, [m.condition_number for m in motions])
        _, stacked = _line(axes, f"{word}, stacked")
        np.testing.assert_allclose(stacked, [m.stacked_condition_number for m in motions])
    assert "20 admissible out of 30 drawn" in axes.get_title(loc="left")


def test_condition_numbers_without_a_baseline(case: Case) -> None:
    axes = draw_condition_numbers(replace(case[1], random=())).axes[0]
    assert [str(line.get_label()) for line in axes.lines] == [
        "optimised, stacked",
        "optimised, motion alone",
    ]
    assert "random" not in axes.get_title(loc="left")


def test_a_condition_number_that_is_not_finite_is_told(case: Case, tmp_path: Path) -> None:
    result = case[1]
    motion = replace(result.motions[0], condition_number=float("inf"))
    figure = draw_condition_numbers(replace(result, motions=(motion,), random=()))
    assert "1 not finite, not shown" in figure.axes[0].get_title(loc="left")
    save_figure(figure, tmp_path / "figure", "png")


def test_the_spectrum_is_that_of_the_stack(case: Case) -> None:
    problem, result = case
    axes = draw_spectrum(result, problem).axes[0]
    numbers, sigma = _line(axes, "optimised")
    np.testing.assert_array_equal(numbers, np.arange(1, problem.base.rank + 1))
    np.testing.assert_allclose(sigma, singular_values(result.stack.factor))
    assert sigma[0] / sigma[-1] == pytest.approx(result.motions[-1].stacked_condition_number)
    _, random = _line(axes, "random")
    block = problem.objective().block(result.random[0].coefficients)
    np.testing.assert_allclose(random, singular_values(np.vstack([block, block])), rtol=1e-9)


@pytest.mark.parametrize(
    ("kind", "beginning"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_equal_results_give_equal_files(
    case: Case, tmp_path: Path, kind: str, beginning: bytes
) -> None:
    for name in ("first", "second"):
        save_figure(draw_condition_numbers(case[1]), tmp_path / name, kind)
    assert (tmp_path / "first").read_bytes().startswith(beginning)
    assert (tmp_path / "first").read_bytes() == (tmp_path / "second").read_bytes()


def test_pages_of_one_file(tmp_path: Path) -> None:
    save_pages([new_figure(1.0), new_figure(1.0), new_figure(1.0)], tmp_path / "pages")
    assert b"/Count 3" in (tmp_path / "pages").read_bytes()


def test_drawing_leaves_the_users_settings_alone(case: Case) -> None:
    import matplotlib

    with matplotlib.rc_context({"font.size": 31.0}):
        before = dict(matplotlib.rcParams)
        figure = draw_condition_numbers(case[1])
        assert dict(matplotlib.rcParams) == before
    assert isinstance(figure, Figure)
    assert figure.axes[0].yaxis.label.get_size() < 12


def test_a_missing_matplotlib_names_the_extra(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[plot\]'"):
        draw_condition_numbers(case[1])
    with pytest.raises(MissingExtraError):
        matplotlib_part("")
