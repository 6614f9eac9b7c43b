"""Tables of numbers: those of the records, with units, as pandas DataFrames."""

import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from excite_cli import ConfigError, Diagnosis, Identification, MissingExtraError, diagnose, identify
from excite_cli.config.data_spec import EffectSpec
from tests.api.conftest import Loop
from tests.api.conftest import loop as loop


@pytest.fixture(scope="module")
def fitted(loop: Loop) -> Identification:
    return identify(loop.problem, loop.data)


@pytest.fixture(scope="module")
def found(loop: Loop) -> Diagnosis:
    declared = loop.problem.spec.model_copy(update={"effects": ()})
    return diagnose(replace(loop.problem, spec=declared), loop.data)


def test_parameters_are_those_of_the_fit(fitted: Identification) -> None:
    fit, table = fitted.fit, fitted.table("parameters")
    assert isinstance(table, pd.DataFrame)
    pd.testing.assert_frame_equal(table, fit.table("parameters"))
    assert tuple(table["name"]) == fit.names
    assert tuple(table["unit"]) == fit.units
    for name in ("value", "std", "relative_std"):
        column = {"value": "values"}.get(name, name)
        np.testing.assert_array_equal(table[name], getattr(fit, column))
        assert table[name].dtype == float
    assert table["identifiable"].dtype == bool
    assert fit.effects == ()
    assert list(fit.table("effects")) == ["effect", "joints", "parameter", "value", "std", "unit"]


def test_effects_of_a_fit_are_told_as_people_know_them(loop: Loop) -> None:
    spec = loop.problem.spec.model_copy(update={"effects": (EffectSpec(kind="coulomb_friction"),)})
    fit = identify(replace(loop.problem, spec=spec), loop.data).fit
    rows = fit.table("effects")
    told = [fit.effect_report(k) for k in range(len(fit.effects))]
    assert list(rows["value"]) == [each.value for one in told for each in one.values()]


def test_errors_are_those_by_joint(fitted: Identification, found: Diagnosis) -> None:
    table = fitted.table("errors").set_index("joint")
    assert dict(table["error_held_out"]) == fitted.error.relative_moving
    assert dict(table["rms_held_out"]) == fitted.error.rms_moving
    assert list(table["unit"]) == ["N·m", "N"]
    table = found.table("errors").set_index("joint")
    assert dict(table["error_declared"]) == found.before.relative_moving
    assert dict(table["error_with_effects"]) == found.after.relative_moving
    assert dict(table["rms_with_effects"]) == found.after.rms_moving
    assert "error_textbook" in table


def test_effects_have_a_row_for_every_number(found: Diagnosis) -> None:
    table = found.table("effects")
    friction = table[(table["effect"] == "coulomb_friction") & (table["joints"] == "elbow")]
    (value,) = friction["value"]
    assert value == pytest.approx(2.0, rel=0.02)
    assert list(friction["unit"]) == ["N·m"]
    assert table["p_value"].dtype == float
    assert len(table) == sum(len(each.parameters) for each in found.effects)
    assert {*replace(found, effects=()).table("effects")} < {*table}
    inertias = found.table("parameters")
    np.testing.assert_array_equal(inertias["value"], found.phi)
    assert tuple(inertias["name"]) == found.inertia_names
    assert inertias["unit"][0] == "kg"


def test_what_there_is_not_is_said(fitted: Identification, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ConfigError, match=r"Identification has no table 'error'\. Tables: effects, "
                       r"errors, parameters\. Did you mean 'errors'"):  # fmt: skip
        fitted.table("error")
    with pytest.raises(
        ConfigError, match=r"Fit has no table 'errors'\. Tables: effects, parameters"
    ):
        fitted.fit.table("errors")
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[tables\]'"):
        fitted.table("errors")
