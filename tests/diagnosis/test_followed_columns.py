"""A joint whose friction falls by half with a temperature, in MuJoCo: six runs in forty minutes.

The robot pauses and cools in between, so that time is no substitute for the column. Friction of
another joint falls with time, and so does a battery.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load_spec import load_spec, spec_as_yaml
from excite_cli.diagnosis.records import Diagnosis, NamedEffect
from excite_cli.diagnosis.words import changes_in_words
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.errors import ConfigError
from excite_cli.export.parameters import found_config
from excite_cli.identification.identify import identify
from excite_cli.measurement.covariates import with_declared
from excite_cli.measurement.dataset import Dataset
from excite_cli.simulation.covariate_series import CovariateSeries
from excite_cli.simulation.ground_truth import plant
from excite_cli.store.diagnosis_file import read_diagnosis, write_diagnosis
from excite_cli.store.fit_file import read_fit, write_fit
from tests.cli.program import SMOKE
from tests.diagnosis import simulated_arm
from tests.diagnosis.simulated_arm import BASE, ELBOW, PITCH, ROBOT, YAW, planted, played
from tests.diagnosis.test_changes import ALWAYS, RUNS, what

pytestmark = pytest.mark.long

KINDS = (
    "viscous_friction,coulomb_friction,torque_offset,friction_change,friction_drift,"
    "covariate_friction,covariate_offset"
)
CLOCK = tuple(np.linspace(0.0, 2400.0, RUNS))
TEMP = CovariateSeries("temp", CLOCK, (25.0, 39.0, 45.0, 33.0, 28.0, 41.0), 0.2)
AMBIENT = CovariateSeries("ambient", CLOCK, (20.0, 20.6, 20.1, 21.0, 21.3, 20.8), 0.05)
BATTERY = CovariateSeries("battery", CLOCK, tuple(np.linspace(50.0, 44.0, RUNS)), 0.01)
COLUMNS = ["ambient", "battery", "temp"]
AT_25, COULOMB, VISCOUS = 25.0, 4.1, 1.0  # both fall by half over 20 degrees


@pytest.fixture(scope="module")
def measured() -> Dataset:
    slopes = {"viscous_slope": -VISCOUS / 40.0, "reference": AT_25}
    kind = kind_named("covariate_friction")
    line = {"time_constant": 20.0 * CLOCK[-1], "span": CLOCK[-1]}
    effects = [
        planted("coulomb_friction", YAW, 3.0),
        planted("coulomb_friction", PITCH, COULOMB),
        planted("viscous_friction", PITCH, VISCOUS),
        planted("coulomb_friction", ELBOW, 2.0),
        planted("friction_change", ELBOW, -0.9, **line),
        plant(kind, (PITCH,), -COULOMB / 40.0, slopes, covariate="temp"),
    ]
    pause = (CLOCK[-1] - 4.0 * RUNS) / (RUNS - 1)
    columns = (TEMP, AMBIENT, BATTERY)
    return played(effects, range(1, RUNS + 1), 4.0, 100.0, pause=pause, covariates=columns)


def diagnosed(data: Dataset, kinds: str, columns: list[str], *keys: str) -> Diagnosis:
    declared = f"measurement.covariates=[{','.join(columns)}]"
    return simulated_arm.told(with_declared(data, columns), kinds, declared, *keys)


@pytest.fixture(scope="module")
def told(measured: Dataset) -> Diagnosis:
    return diagnosed(measured, KINDS, COLUMNS)


@pytest.fixture(scope="module")
def untold(measured: Dataset) -> Diagnosis:
    """With few kinds: the runs of what changed take time to search."""
    few = "coulomb_friction,friction_change"
    return diagnosed(measured, few, [], "effects=[{kind: viscous_friction}]")


def followed(found: Diagnosis, joint: str = "shoulder_pitch") -> NamedEffect:
    """What is told of that joint beside plain friction."""
    (one,) = [
        each
        for each in found.effects
        if each.effect.joints == (joint,) and catalogue()[each.effect.kind].changes_of
    ]
    return one


def test_the_temperature_is_named_and_the_decoy_is_not(told: Diagnosis) -> None:
    found = followed(told)
    assert {each for each in what(told) if each[1] != "elbow"} == {
        *(each for each in ALWAYS if each[1] != "elbow"),
        ("covariate_friction", "shoulder_pitch", ()),
    }
    assert "ambient" not in {each.effect.covariate for each in told.effects}
    assert found.effect.covariate == "temp"
    assert not found.approximates
    for name, true in (("coulomb_slope", -COULOMB / 40.0), ("viscous_slope", -VISCOUS / 40.0)):
        size = found.parameters[name]
        assert size.value == pytest.approx(true, abs=max(3.0 * size.std, 0.02 * abs(true)))
    # Friction beside it is that at the reference.
    reference = found.parameters["reference"].value
    assert reference == pytest.approx(np.mean(TEMP.values[:-1]), abs=1.0)
    (dry,) = [
        each.parameters["coulomb"].value
        for each in told.effects
        if (each.effect.kind, each.effect.joints) == ("coulomb_friction", ("shoulder_pitch",))
    ]
    assert dry == pytest.approx(COULOMB * (1.0 - (reference - AT_25) / 40.0), rel=0.03)
    assert any(
        text.startswith("Coulomb friction of shoulder_pitch falls by 0.1")
        and f"N·m per unit of temp; it is {dry:.3g} at {reference:.4g}." in text
        for text in changes_in_words(told)
    )
    # A column that says the same as time is its alias.
    found = followed(told, "elbow")
    names = {(each.kind, each.covariate) for each in (found.effect, *found.aliases)}
    assert names >= {("covariate_friction", "battery"), ("friction_change", "")}


def test_with_the_column_the_held_out_error_is_that_of_noise_and_without_it_more(
    told: Diagnosis, untold: Diagnosis
) -> None:
    """And a change over time is named in its place."""
    joint = "shoulder_pitch"
    assert told.after.relative_moving[joint] < 0.02 < 0.04 < untold.after.relative_moving[joint]
    assert not told.joints_with_residual
    there = [each.effect for each in untold.effects if each.effect.joints == (joint,)]
    assert any(each.runs or each.kind == "friction_change" for each in there)


def test_what_was_found_is_stored_and_goes_into_a_config_that_is_identified(
    measured: Dataset, told: Diagnosis, tmp_path: Path
) -> None:
    columns = f"measurement.covariates=[{','.join(COLUMNS)}]"
    given = load_spec(SMOKE, [f"diagnosis.kinds=[{KINDS}]", columns])
    write_diagnosis(tmp_path / "d.h5", replace(told, config=spec_as_yaml(given)))
    back = read_diagnosis(tmp_path / "d.h5")
    assert [each.effect for each in back.effects] == [each.effect for each in told.effects]
    better = tmp_path / "better.yaml"
    text = found_config(given, SMOKE.parent, back, better)
    better.write_text(text, encoding="utf-8")
    found = identify(ROBOT, BASE, with_declared(measured, COLUMNS), load_spec(better, []))
    at = found.fit.names.index("covariate_friction.coulomb_slope[shoulder_pitch; temp]")
    assert found.fit.values[at] == pytest.approx(-COULOMB / 40.0, rel=0.03)
    write_fit(tmp_path / "f.h5", found, text, str(tmp_path), ROBOT.fingerprint())
    assert read_fit(tmp_path / "f.h5").fit.effects == found.fit.effects
    fewer = load_spec(better, ["measurement.covariates=[ambient]"])
    with pytest.raises(ConfigError, match=r"covariate: 'temp' is not declared.*ambient"):
        identify(ROBOT, BASE, with_declared(measured, ["ambient"]), fewer)


def test_what_fits_no_name_is_told_to_depend_on_the_column(measured: Dataset) -> None:
    keys = [
        "diagnosis.exclude=[viscous_friction, coulomb_friction]",
        "effects=[{kind: viscous_friction}, {kind: coulomb_friction}]",
    ]
    kinds = "viscous_friction,coulomb_friction,torque_offset"
    found = diagnosed(measured, kinds, ["ambient", "temp"], *keys)
    (left,) = [each for each in found.unexplained if each.joint == "shoulder_pitch"]
    assert left.depends_on[0].code == "column[temp]"
