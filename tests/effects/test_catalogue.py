"""Every kind of the catalogue keeps the contract of `Effect`."""

import numpy as np
import pytest

from excite_cli.config.data_spec import EffectSpec
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, declared_effects, kind_named
from excite_cli.errors import ConfigError
from excite_cli.measurement.run_identity import RunId
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

ROBOT = random_robot(9, joints=3, branches=False)
KINDS = list(catalogue())


def _every_effect(kind: type[Effect], samples: int) -> list[Effect]:
    signals = [signals_of(ROBOT, samples)]
    return [
        kind(place, shape)
        for place in (kind.places(ROBOT) or [tuple(range(ROBOT.n))])
        for shape in [kind.planted(1.0, {})[0], *kind.grid(ROBOT, place, signals)[:6]]
    ]


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("samples", [1, 2, 40])
def test_columns_fit_rows_and_parameters(name: str, samples: int) -> None:
    kind, signals = catalogue()[name], signals_of(ROBOT, samples)
    for effect in _every_effect(kind, samples):
        columns = effect.columns(signals)
        assert columns.shape == (samples, len(effect.rows(3)), len(kind.parameters))
        assert np.isfinite(columns).all()
        assert set(effect.shape) == {shape.name for shape in kind.shapes}
        if kind.excitable:
            found = effect.pull_back(signals, np.ones_like(columns))
            parts = (found.q, found.v, found.a, found.load, found.torque)
            assert all(part.shape == (samples, 3) for part in parts if part is not None)


@pytest.mark.parametrize("name", KINDS)
def test_parameters_have_units_ranges_and_unique_names(name: str) -> None:
    kind = catalogue()[name]
    everything = (*kind.parameters, *kind.shapes)
    assert len({p.name for p in everything}) == len(everything)
    assert all(p.unit and p.low < p.high for p in everything)
    assert kind.kind == name
    assert kind.title
    assert kind.signature
    count = len(kind.parameters)
    shape, values = kind.planted(1.5, {})
    assert values.shape == (count,)
    assert values[0] == 1.5
    found = kind((0, 1, 2), shape).report(values, np.eye(count))
    assert {p.name for p in everything} <= set(found)
    assert found[kind.parameters[0].name].std == pytest.approx(1.0)


@pytest.mark.parametrize("name", KINDS)
def test_standing_still_leaves_no_nan(name: str) -> None:
    signals = signals_of(ROBOT, 5)
    still = type(signals)(**{**vars(signals), "v": signals.v * 0, "load": signals.load * 0})
    for effect in _every_effect(catalogue()[name], 5):
        columns = effect.columns(still)
        assert np.isfinite(columns).all()
        if effect.excitable:
            found = effect.pull_back(still, np.ones_like(columns))
            parts = (found.q, found.v, found.a, found.load, found.torque)
            assert all(np.isfinite(part).all() for part in parts if part is not None)


def test_an_effect_is_silent_in_the_runs_it_does_not_name() -> None:
    kind = kind_named("torque_offset")
    effect = kind((1,), {}, ("second",))
    first, second = (
        type(s)(**{**vars(s), "run": run})
        for run in (RunId("first"), RunId("second", 2))
        for s in [signals_of(ROBOT, 4)]
    )
    assert not effect.torque(first, np.array([2.0])).any()
    assert effect.torque(second, np.array([2.0]))[:, 1] == pytest.approx(2.0)


def test_declared_effects_are_placed_and_checked() -> None:
    specs = (EffectSpec(kind="torque_delay"), EffectSpec(kind="coupled_friction"))
    found = declared_effects(specs, ROBOT)
    assert [effect.joints for effect in found] == [(0, 1, 2), (0, 1), (1, 2)]
    assert found[1].shape == {"direction": 1.0}
    # Shape of a declared effect is checked.
    spec = EffectSpec(kind="stribeck_friction", shape={"stribeck_sped": 0.1})
    with pytest.raises(ConfigError, match="Did you mean 'stribeck_speed'"):
        declared_effects((spec,), ROBOT)
    with pytest.raises(ConfigError, match="Did you mean 'coulomb_friction'"):
        kind_named("coulom_friction")
