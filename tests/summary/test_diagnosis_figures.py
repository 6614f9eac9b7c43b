"""Figures of a diagnosis: which there are, and that they show what the page does."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.summary.figures import diagnosis_figures as figures_of
from tests.diagnosis.synthetic_diagnosis import make_diagnosis, make_traces


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    plain = make_diagnosis()
    traces, held_out = make_traces(plain.joint_names)
    return replace(plain, traces=traces, held_out_traces=held_out)


def test_the_figures_are_of_runs_with_held_out_data(diagnosis: Diagnosis) -> None:
    (run,) = {trace.run for trace in diagnosis.held_out_traces}
    names = list(figures_of(diagnosis))
    assert names == [f"before_{run}", f"after_{run}", "errors", "effects_1"]


def test_without_samples_there_are_the_errors_alone() -> None:
    assert list(figures_of(make_diagnosis())) == ["errors"]


def test_before_shows_the_declared_model_and_after_the_one_with_effects(
    diagnosis: Diagnosis,
) -> None:
    (run,) = {trace.run for trace in diagnosis.held_out_traces}
    trace, *others = diagnosis.held_out_traces
    declared = trace.predicted + 3.0
    assert not others
    figures = figures_of(replace(diagnosis, held_out_traces=(replace(trace, before=declared),)))
    for name, model in (("before", declared), ("after", trace.predicted)):
        upper = figures[f"{name}_{run}"]().axes[0]
        lines = {str(line.get_label()): np.asarray(line.get_ydata()) for line in upper.lines}
        for label, values in (("measured", trace.measured), ("model", model)):
            assert len(lines[label]) > 20
            shown = set(np.round(lines[label][np.isfinite(lines[label])], 6))
            assert set(np.round(values[:, 0].astype(float), 6)) >= shown


def test_errors_are_those_of_the_records(diagnosis: Diagnosis) -> None:
    joints = diagnosis.joint_names
    moving = {name: 0.02 * (k + 1) for k, name in enumerate(joints)}
    moving[joints[1]] = float("nan")  # it does not move
    after = replace(diagnosis.after, relative_moving=moving, mean_relative_moving=0.07)
    before = replace(diagnosis.before, relative_moving=moving, mean_relative_moving=0.2)
    floor = {joints[0]: 0.5}
    found = replace(diagnosis, before=before, after=after, noise_floor=floor)
    relative, *rms = figures_of(found)["errors"]().axes
    labels = [tick.get_text() for tick in relative.get_yticklabels()]
    known = [each for each in joints if each != joints[1]]
    assert labels == [*known, "mean"]
    (line,) = [each for each in relative.lines if each.get_label() == "with effects"]
    np.testing.assert_allclose(line.get_xdata(), [100 * moving[each] for each in known] + [7.0])
    assert relative.yaxis_inverted()  # the first joint on top
    shown = [tick.get_text() for axes in rms for tick in axes.get_yticklabels()]
    assert sorted(shown) == sorted(joints)
    ticks = [x for axes in rms for each in axes.lines if each.get_label() == "repeatability"
             for x in np.asarray(each.get_xdata()) if np.isfinite(x)]  # fmt: skip
    assert ticks == [0.5]


def test_a_unit_of_which_no_torque_was_measured_has_no_panel(diagnosis: Diagnosis) -> None:
    assert diagnosis.traces is not None
    *units, _ = diagnosis.traces.torque_units
    traces = replace(diagnosis.traces, torque_units=(*units, "N"))
    slide = diagnosis.joint_names[-1]
    before, after = (
        replace(each, rms={**each.rms, slide: float("nan")})
        for each in (diagnosis.before, diagnosis.after)
    )
    measured = figures_of(replace(diagnosis, traces=traces))["errors"]()
    assert len([axes for axes in measured.axes if "[N]" in axes.get_xlabel()]) == 1
    found = replace(diagnosis, traces=traces, before=before, after=after)
    figure = figures_of(found)["errors"]()
    assert not [axes for axes in figure.axes if "[N]" in axes.get_xlabel()]
    figure.draw_without_rendering()
