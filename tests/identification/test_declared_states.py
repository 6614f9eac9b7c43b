"""Samples that no fit may use: until a joint has gone its way."""

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.config.load_spec import parsed_spec
from excite_cli.effects.catalogue import kind_named
from excite_cli.errors import ConfigError
from excite_cli.identification.declared_states import LeftOut, check_states, declared_sets
from excite_cli.identification.prepare import prepare
from excite_cli.identification.processing import choose_processing
from excite_cli.measurement.dataset import Run


def test_a_joint_counts_once_it_has_gone_its_way() -> None:
    q = np.stack([np.linspace(0.0, 1.0, 101), np.linspace(0.0, -2.0, 101)], axis=1)
    there = LeftOut(ways=((1, 0.5),)).on_the_way(q, q[:0])
    assert there[:, 0].all()
    assert np.flatnonzero(there[:, 1])[0] == 25
    assert LeftOut().on_the_way(q, q[:0]).all()
    behind = LeftOut(ways=((1, 0.5),)).on_the_way(q[40:], q[30:40])  # 0.2 rad before
    assert np.flatnonzero(behind[:, 1])[0] == 15
    # Of a run that hardly goes further a third of the way is enough.
    swinging = 0.1 * np.sin(np.linspace(0.0, 4 * np.pi, 801))[:, None]  # 0.8 rad altogether
    first = np.flatnonzero(LeftOut(ways=((0, 5.0),)).on_the_way(swinging, swinging[:0])[:, 0])[0]
    assert np.abs(np.diff(swinging[: first + 1, 0])).sum() > 0.8 / 3 - 1e-3
    assert 200 < first < 300


def test_it_is_what_effects_ask_for() -> None:
    dahl, pair = kind_named("dahl_friction"), kind_named("coupled_friction")
    effects = [dahl((1,), {"distance": 0.01}), pair((0, 1), {"direction": -1.0}), dahl((0,), {
        "distance": 0.02
    })]  # fmt: skip
    assert LeftOut.by(effects) == LeftOut(((0, 1, -1.0),), ((0, 0.08), (1, 0.04)))


def test_readings_near_a_cut_are_left_out_of_its_joint() -> None:
    cut = kind_named("torque_saturation")((1,), {"level": 10.0})
    tau = np.array([[20.0, 9.0], [20.0, -9.9], [20.0, 10.1], [20.0, -3.0]])
    assert LeftOut.by([cut]).below_cuts(tau).all()  # only where it is asked for
    below = LeftOut.by([], [cut]).below_cuts(tau)
    assert below[:, 0].all()
    assert below[:, 1].tolist() == [True, False, False, True]


def test_a_fit_uses_nothing_of_it() -> None:
    t = np.arange(2000) / 200.0
    q = np.stack([np.sin(t), np.cos(1.3 * t)], axis=1)
    run = Run("run", t, q, 5.0 * q)
    processing = choose_processing([run], FilterSpec())
    every = prepare(run, processing)
    some = prepare(run, processing, LeftOut(ways=((1, 1.0),)))
    gone = np.abs(some.averaged(some.q)[:, 1] - some.q[0, 1])
    early = np.arange(len(gone)) < np.argmax(gone > 0.8)
    assert every.usable[early, 1].any()
    assert not some.usable[early, 1].any()
    assert np.array_equal(every.usable[:, 0], some.usable[:, 0])
    assert some.usable[-20:, 1].any()
    assert np.array_equal(some.valid, every.valid)  # errors are of all that was measured


NAMES = ("monday", "tuesday", "friday")
STATES = {
    "monday": {"payload": "tool"},
    "tuesday": {"payload": "none", "torque_gain": "old"},
    "friday": {"payload": "tool"},
}


def test_runs_of_one_label_are_one_set_and_none_is_in_none() -> None:
    assert declared_sets("payload", STATES) == [("monday", "friday")]
    assert declared_sets("torque_gain", STATES) == [("tuesday",)]
    assert declared_sets("payload", {"monday": {"payload": "none"}}) == []
    assert declared_sets("contact", STATES) is None
    # The config takes them and refuses numbers.
    robot = {"urdf": "arm.urdf"}
    assert parsed_spec({"robot": robot, "runs": STATES}).runs == STATES
    with pytest.raises(ConfigError, match="runs"):
        parsed_spec({"robot": robot, "runs": {"monday": {"payload": 2}}})
    # What fits is accepted.
    check_states({**STATES, "friday": {"contact": "a", "viscous_friction": "b"}}, NAMES)


@pytest.mark.parametrize(
    ("states", "told"),
    [
        ({"tuesdy": {"payload": "a"}}, "no run 'tuesdy' in the data. Did you mean 'tuesday'?"),
        ({"monday": {"paylod": "a"}}, "runs.monday: there is no effect 'paylod'"),
        ({"monday": {"spring": "a"}}, "runs.monday: spring is not of single runs."),
    ],
)
def test_unknown_runs_and_kinds_are_refused(states: dict, told: str) -> None:
    with pytest.raises(ConfigError) as error:
        check_states(states, NAMES)
    assert told in str(error.value)
