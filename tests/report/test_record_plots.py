"""Plots of records: what is drawn is what the record holds, measured behind, model on top."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from excite_cli import Diagnosis, MissingExtraError, Problem, Result, identify, motions_of, plan
from excite_cli.api import diagnosing as diagnosing  # which connects records with their plots
from excite_cli.errors import ConfigError
from tests.api.conftest import Loop
from tests.api.conftest import loop as loop
from tests.api.conftest import problem as problem
from tests.diagnosis.synthetic_diagnosis import make_diagnosis, make_traces


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    plt.switch_backend("agg")
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    made = make_diagnosis()
    traces, held_out = make_traces(made.joint_names)
    return replace(made, traces=traces, held_out_traces=held_out)


def words(ax: Any) -> list[str]:
    told = ax.get_legend()
    return [ax.get_title("left"), *(each.get_text() for each in (told.get_texts() if told else []))]


def test_residuals_of_all_joints_have_a_row_each(found: Diagnosis) -> None:
    axes = found.plot_residual()
    assert axes.shape == (5, 2)
    (trace,) = found.held_out_traces
    j = found.joint_names.index("elbow")
    torque, residual = axes[j]
    dots, line = torque.lines
    np.testing.assert_array_equal(dots.get_ydata(), trace.measured[:, j])
    np.testing.assert_array_equal(line.get_ydata(), trace.predicted[:, j])
    assert (dots.get_linestyle(), dots.get_marker()) == ("None", "o")
    assert dots.get_zorder() <= line.get_zorder()
    assert dots.get_color() != line.get_color()
    assert words(torque) == ["elbow", "measured", "model"]
    before, after = residual.lines
    np.testing.assert_array_equal(after.get_ydata(), trace.measured[:, j] - trace.predicted[:, j])
    assert np.nanstd(before.get_ydata()) > 5 * np.nanstd(after.get_ydata())
    assert torque.get_ylabel() == "torque [N·m]"
    assert residual.get_ylabel().startswith("residual [")
    assert axes[-1, 0].get_xlabel() == "time [s]"
    assert "run_3" in torque.figure.get_suptitle()


def test_one_joint_in_axes_of_ones_own(found: Diagnosis) -> None:
    assert found.plot_residual("elbow").shape == (1, 2)
    _, ax = plt.subplots()
    assert found.plot_residual("elbow", ax) is ax
    assert len(ax.lines) == 2
    assert words(ax)[0] == "elbow"
    with pytest.raises(ConfigError, match=r"Name one of: .*shoulder_yaw"):
        found.plot_residual(ax=ax)
    with pytest.raises(ConfigError, match=r"no 'elbo' to plot\. Did you mean 'elbow'"):
        found.plot_residual("elbo")
    with pytest.raises(ConfigError, match="No torque over time"):
        replace(found, traces=None, held_out_traces=()).plot_residual()


def test_friction_is_the_law_over_measured_samples(found: Diagnosis) -> None:
    ax = found.plot_friction("elbow")
    dots, _, law = ax.lines
    assert len(dots.get_xdata()) > 100
    for line, most in ((law, 0.05), (dots, 0.3)):
        np.testing.assert_allclose(line.get_ydata(), 2.0 * line.get_xdata(), atol=most)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("speed [rad/s]", "torque [N·m]")
    assert words(ax)[0] == "elbow"
    with pytest.raises(ConfigError, match=r"no 'wrist_roll' to plot\. There are: elbow"):
        found.plot_friction("wrist_roll")


def test_a_fit_and_a_planned_motion_are_drawn(loop: Loop) -> None:
    fitted = identify(loop.problem, loop.data)
    axes = fitted.plot_residual()
    assert axes.shape == (2, 2)
    assert [ax.get_ylabel()[-4:] for ax in axes[:, 0]] == ["N·m]", " [N]"]
    assert words(axes[1, 0]) == ["slide", "measured", "model"]
    assert len(axes[0, 1].lines) == 1


def test_motions_are_drawn_with_units_and_names(problem: Problem, tmp_path: Path) -> None:
    result: Result = plan(problem)
    axes, names = result.plot(), problem.robot.joint_names
    assert axes.shape == (5, 3)
    units = [[ax.get_ylabel() for ax in axes[names.index(name)]] for name in ("elbow", "slide")]
    assert units == [
        [f"{word} [{u}{per}]" for word, per in (("position", ""), ("speed", "/s"),
                                                ("acceleration", "/s²"))]
        for u in ("rad", "m")
    ]  # fmt: skip
    motion = motions_of(result)[-1]
    t = axes[0, 0].lines[0].get_xdata()
    drawn = np.array([[ax.lines[0].get_ydata() for ax in row] for row in axes])
    np.testing.assert_allclose(drawn.transpose(1, 2, 0), motion.at(t), atol=1e-12)
    assert [words(ax) for ax in axes[:, 0]] == [[name] for name in names]
    _, ax = plt.subplots()
    assert result.plot(1, "elbow", ax) is ax
    with pytest.raises(ConfigError, match=r"no motion 7 to plot\. Motions: \[1\]"):
        result.plot(7)
    one = motion.at(0.5)
    np.testing.assert_array_equal(one, [x[0] for x in motion.at(np.array([0.5]))])
    for bad in (-0.1, motion.trajectory.duration + 1.0, np.nan, np.zeros((2, 2))):
        with pytest.raises(ConfigError, match="give t from 0 to"):
            motion.at(bad)


def test_without_matplotlib_the_extra_is_named(
    found: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"excite-cli\[plot\]"):
        found.plot_residual()
