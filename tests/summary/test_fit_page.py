"""What a page says of a fit: errors, parameters by form, correlation, data."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import parse_spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.identification.identify import identify
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.error_chart import parameter_charts
from excite_cli.report.page import render
from excite_cli.shown.answer import Choice, Page, Table
from excite_cli.store.fit_file import read_fit, write_fit
from excite_cli.summary.identification import (
    _stored_parts,
    correlated_parameters,
    fit_figures,
    fit_sections,
    parameter_section,
)
from tests.identification.synthetic import measured
from tests.report.structure import Structure
from tests.robot.random_robots import random_robot

PROBLEM = "robot: {urdf: x.urdf}\neffects: [{kind: viscous_friction}]\n"


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> StoredFit:
    robot = random_robot(3, joints=3, prismatic=False)
    data = measured(robot, standard_parameters(robot), noise=0.1, seconds=5.0, seeds=(1, 2, 3))
    found = identify(robot, find_base_parameters(robot), data, parse_spec(PROBLEM))
    path: Path = tmp_path_factory.mktemp("fit") / "fit.h5"
    write_fit(path, found, PROBLEM, "/somewhere", "abc", ("a.h5",))
    return read_fit(path)


def test_the_page_is_sound_and_says_what_matters(stored: StoredFit) -> None:
    floor = {joint: 0.5 * stored.error.rms[joint] for joint in stored.fit.joint_names}
    stored = replace(stored, noise_floor=floor, traces=stored.traces[1:])
    text = Structure(render(Page("f", "", fit_figures(stored), tuple(fit_sections(stored))))).text
    assert f"{stored.error.mean_relative:.2%}" in text
    assert "r3 took no part in the fit" in text
    assert stored.closed_loop_bias[1:] in text
    for name in stored.fit.names:
        assert name in text
    assert "2.0 times the noise of repeated periods" in text


def test_parameters_are_told_by_form(stored: StoredFit) -> None:
    count = len(stored.fit.names)
    loose, minor = np.ones(count, bool), np.ones(count, bool)
    loose[1] = minor[0] = False
    fit = replace(stored.fit, identifiable=loose, essential=minor & loose)
    charts = parameter_charts(fit)
    assert {chart.title.split("[")[1].split("]")[0] for chart in charts} == set(fit.units)
    told = " ".join(chart.alternative for chart in charts)
    assert f"not identifiable: {fit.names[1]}" in told
    words = "".join(chart.svg for chart in charts)
    for form in ("identifiable", "identifiable, zero within error", "not identifiable"):
        assert f">{form}<" in words.replace("\n", "")


def test_an_unseen_parameter_has_no_end(stored: StoredFit) -> None:
    std = stored.fit.std.copy()
    std[0] = np.inf
    covariance = stored.fit.covariance.copy()
    covariance[0, 0] = np.inf
    fit = replace(stored.fit, std=std, relative_std=std, covariance=covariance,
                  identifiable=np.isfinite(std))  # fmt: skip
    found = parameter_section(fit)
    assert any("> 1000%" in row for b in found.blocks if isinstance(b, Table) for row in b.rows)


def test_strong_correlations_are_listed(stored: StoredFit) -> None:
    std, names = stored.fit.std, stored.fit.names
    covariance = np.diag(std**2)
    (text,) = correlated_parameters(replace(stored.fit, covariance=covariance))
    assert "No two parameters" in str(text)
    covariance[0, 2] = covariance[2, 0] = -0.98 * std[0] * std[2]
    (table,) = correlated_parameters(replace(stored.fit, covariance=covariance))
    assert isinstance(table, Table)
    assert table.rows == ((names[0], names[2], "-0.980"),)


def test_runs_in_time(stored: StoredFit) -> None:
    (choice,) = fit_sections(stored)[2].blocks
    assert isinstance(choice, Choice)
    assert choice.options[0][0].startswith("r3 (held out")
    assert fit_sections(replace(stored, traces=()))[2].blocks == ()


def test_page_and_terminal_have_the_same_table_of_errors(stored: StoredFit) -> None:
    told = [part for part in _stored_parts(stored) if isinstance(part, Table)]
    shown = [block for section in fit_sections(stored) for block in section.blocks]
    assert [table for table in told if table.title.startswith("Error of the torque")] == [
        block for block in shown if isinstance(block, Table) and "Error" in block.title
    ]
