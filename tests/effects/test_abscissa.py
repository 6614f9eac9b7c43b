"""The quantity over which a person sees an effect."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from excite_cli.effects.base import Effect, Parameter, Signals
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.robot.model import Array
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

ROBOT = random_robot(4, joints=3, branches=False, prismatic=False)
MOVED = signals_of(ROBOT, 400)
SIGNALS = replace(MOVED, torque=1.5 * MOVED.load)


@pytest.mark.parametrize("kind", sorted(catalogue()))
def test_every_kind_can_be_drawn(kind: str) -> None:
    effect_kind = kind_named(kind)
    shape, _ = effect_kind.planted(1.0, {})
    whole = effect_kind.scope == "base"
    place = tuple(range(ROBOT.n)) if whole else effect_kind.places(ROBOT)[0]
    found = effect_kind(place, shape).abscissa(SIGNALS)
    if found is None:  # drawn over the torque that it predicts
        assert kind in {
            "backlash", "base_tilt", "cable_force", "coupled_armature", "elasticity",
            "encoder_offset", "payload",
            "torque_delay", "wrench_gain",
        }  # fmt: skip
        return
    assert found.values.shape == SIGNALS.t.shape
    assert np.isfinite(found.values).all()
    assert found.name
    assert found.unit


@pytest.mark.parametrize(
    ("kind", "series", "unit"),
    [("coulomb_friction", "v", "rad/s"), ("spring", "q", "rad"), ("armature", "a", "rad/s²"),
     ("torque_gain", "load", "N·m")],
)  # fmt: skip
def test_one_quantity_of_its_joint(kind: str, series: str, unit: str) -> None:
    found = kind_named(kind)((1,)).abscissa(SIGNALS)
    assert found is not None
    assert np.array_equal(found.values, getattr(SIGNALS, series)[:, 1])
    assert found.unit == unit


def test_ripple_repeats_within_its_period() -> None:
    effect = kind_named("ripple")((0,), {"periods": 12.0})
    found = effect.abscissa(SIGNALS)
    assert found is not None
    assert found.period == pytest.approx(2 * np.pi / 12.0)
    angle = np.mod(found.values, found.period) * 12.0
    columns = effect.columns(SIGNALS)[:, 0]
    assert columns == pytest.approx(np.stack([np.cos(angle), np.sin(angle)], axis=1), abs=1e-9)
    # Friction with load is a line over its abscissa.
    effect = kind_named("load_dependent_friction")((2,))
    found = effect.abscissa(SIGNALS)
    assert found is not None
    assert np.array_equal(found.values, effect.columns(SIGNALS)[:, 0, 0])
    # Of losses that differ, a line for each.
    effect = kind_named("gear_loss")((2,))
    found = effect.abscissa(SIGNALS)
    assert found is not None
    sliding = np.abs(SIGNALS.v[:, 2]) > 0.01
    driving = (SIGNALS.load * SIGNALS.v)[:, 2] > 0.0
    torque = effect.columns(SIGNALS)[:, 0] @ [0.15, 0.05]
    slopes = np.where(driving, 0.15, 0.05)
    assert torque[sliding] == pytest.approx((slopes * found.values)[sliding])
    # Effects of users need none.
    assert Own((0,)).abscissa(SIGNALS) is None


class Own(Effect):
    """An effect of a user, who says nothing of how to draw it."""

    kind: ClassVar = "own"
    title: ClassVar = "own"
    signature: ClassVar = ""
    parameters: ClassVar = (Parameter("size", "N·m", 0.1, 1.0),)

    def columns(self, signals: Signals) -> Array:
        return np.ones((len(signals.t), 1, 1))
