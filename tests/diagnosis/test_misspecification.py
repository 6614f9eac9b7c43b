"""Effects that only come near something else, by what is left beside them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.diagnosis.candidates import Candidate
from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.misspecification import approximations
from excite_cli.diagnosis.records import Approximation, ExcessResidual
from excite_cli.diagnosis.training import TrainingData
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue
from tests.diagnosis.explicit_data import (
    FIXED,
    FOLDS,
    SAMPLES,
    Allowed,
    effect,
    planted,
    prepared,
    traced,
)
from tests.effects.motions import signals_of
from tests.robot.random_robots import random_robot

NAMES = ("a", "b")


def left(joint: str, *codes: str, share: float) -> ExcessResidual:
    """What surely is left of a joint: this share of it is predicted, and no more exceeds noise."""
    of = tuple(Covariate.of_code(code) for code in codes)
    return ExcessResidual(joint, 1.0, 0.1, None, "", True, share, of)


def function_of(*codes: str) -> Approximation:
    return Approximation(tuple(Covariate.of_code(code) for code in codes))


def all_but(vetoed: int) -> Allowed:
    """A veto of one candidate."""
    return lambda parameters, chosen, added: vetoed not in added


def beside(kind: str, words: Sequence[str], energy: float, joints: tuple[int, ...] = (0,)) -> bool:
    """Whether an effect of this energy, beside structure of energy one on joint a, is doubted.

    The structure is half of the residual: of 2 per sample, with noise and what is not modelled.
    """
    width = len(catalogue()[kind].parameters)
    torque = np.zeros((width + 1, 2))
    torque[0, list(joints)] = 0.999 * np.sqrt(energy)
    torque[0, joints[0]] = np.sqrt(energy)
    torque[width] = [1.0, 2.0]  # half of the residual of joint a has no candidate
    data, candidates = planted([effect(kind, *joints)], torque)
    rests = [left("a", *words, share=0.5)]
    found = approximations(traced(data, candidates, [0]), NAMES, rests)
    assert found in ({}, {0: function_of(*words)})
    return bool(found)


@pytest.mark.parametrize(
    ("kind", "words", "joints"),
    [
        ("spring", ["q[a]"], (0,)),
        ("viscous_friction", ["v[a]"], (0,)),
        ("coulomb_friction", ["history of q[a]"], (0,)),
        ("stribeck_friction", ["history of q[a]"], (0,)),
        ("armature", ["a[a]"], (0,)),
        ("torque_gain", ["load[a]"], (0,)),
        ("load_dependent_friction", ["history of load[a]"], (0,)),
        ("friction_drift", ["time"], (0,)),
        ("friction_drift", ["v[a]"], (0,)),
        ("cable_force", ["q[b]"], (0, 1)),
    ],
)
def test_a_tenth_of_an_effect_left_over_its_own_quantity_is_too_much(
    kind: str, words: list[str], joints: tuple[int, ...]
) -> None:
    assert beside(kind, words, 9.9, joints)
    assert not beside(kind, words, 10.1, joints)


@pytest.mark.parametrize(
    ("kind", "words", "share"),
    [
        ("spring", ["v[a]"], 1.0),
        ("spring", ["q[b]"], 1.0),  # the position of another joint
        ("spring", ["history of q[a]"], 1.0),
        ("spring", ["v[b]", "q[a]"], 0.5),  # its own and another
        ("armature", ["v[a]", "load[a]"], 1.0),
        ("torque_gain", ["a[a]"], 1.0),
        ("viscous_friction", ["q[a]"], 0.3),  # may be the mean of anything
        ("viscous_friction", ["history of load[a]"], 0.3),
        ("viscous_friction", ["time"], 0.3),
        ("torque_offset", ["q[a]", "time"], 0.5),
    ],
)
def test_what_depends_on_something_else_must_be_more_than_a_share_of_the_effect(
    kind: str, words: list[str], share: float
) -> None:
    assert beside(kind, words, 0.98 / share)
    assert not beside(kind, words, 1.02 / share)


def test_a_line_through_a_cubic_is_no_spring() -> None:
    """Of q³ on ±1 a line explains 21/25, and 4/21 of that are left; of q³ + q it leaves less."""
    for straight, expected in ((0.0, {0: function_of("q[a]")}), (1.0, {})):
        rng = np.random.default_rng(2)
        q = [rng.uniform(-1.0, 1.0, SAMPLES) for _ in FOLDS]
        declared = tuple(rng.normal(size=(SAMPLES, 2, FIXED)) for _ in FOLDS)
        tau = tuple(
            np.stack([10.0 * (x**3 + straight * x), 0 * x], axis=1) + rng.normal(size=(SAMPLES, 2))
            for x in q
        )
        line = tuple(np.stack([x, np.ones(SAMPLES)], axis=1)[:, None] for x in q)
        usable = tuple(prepared(np.ones((SAMPLES, 2), bool)) for _ in FOLDS)
        data = TrainingData(usable, FOLDS, declared, tau)
        spring = Candidate(effect("spring"), (0,), line)
        # What a free function of q would take off the residual, by plain least squares.
        x = np.concatenate([np.column_stack([d[:, 0], z[:, 0]])
                            for d, z in zip(declared, line, strict=True)])  # fmt: skip
        position, torque = np.concatenate(q), np.concatenate(tau)[:, 0]
        curve = np.column_stack([x, position**2, position**3])
        errors = [torque - z @ np.linalg.lstsq(z, torque, rcond=None)[0] for z in (x, curve)]
        share = 1.0 - float(errors[1] @ errors[1]) / float(errors[0] @ errors[0])
        rests = [left("a", "q[a]", share=share)]
        assert approximations(traced(data, [spring], [0]), NAMES, rests) == expected


def test_straight_friction_is_measured_without_what_refines_it() -> None:
    """Beside its refinement, which shares nearly all, little of Coulomb friction would be left."""
    mix = np.array([[1.0, 1.0], [0.0, 0.2]])
    torque = np.array([[4.0, 0.0], [1.0, 0.0]])
    rests = [left("a", "v[a]", share=1.0)]  # energy one
    for kind, expected in (
        ("load_dependent_friction", {1}),  # 16 + 1 of Coulomb, 1 of the refinement
        ("armature", {0}),  # refines nothing: 1/26 of Coulomb's, and no function of speed
    ):
        data, candidates = planted([effect("coulomb_friction"), effect(kind)], torque, mix)
        found = approximations(traced(data, candidates, [0, 1]), NAMES, rests)
        assert set(found) == expected
    # Structure counts on the joint where an effect is most. The effect explains more on b than on
    # a, where another explains most of the torque.
    effects = [effect("viscous_friction", 0, 1), effect("armature", 0)]
    torque = np.array([[3.0, 4.0], [9.0, 0.0]])
    data, candidates = planted(effects, torque)
    both = traced(data, candidates, [0, 1])
    assert approximations(both, NAMES, [left("b", "time", share=0.99)]) == {}
    large = [left("b", "time", share=20.0)]  # of the residual's energy of one
    assert approximations(both, NAMES, large) == {0: function_of("time")}
    assert approximations(both, NAMES, [left("a", "time", share=20.0)]) == {}
    # What cannot be on another joint is no matter.
    kinds = (("viscous_friction", 0), ("stribeck_friction", 1), ("viscous_friction", 1))
    effects = [effect(kind, joint) for kind, joint in kinds]
    data, candidates = planted(effects, np.array([[1.0, 0.0], [0.0, 9.0], [0.0, 2.0]]))
    found = approximations(traced(data, candidates, [0, 2], all_but(1)), NAMES, [])
    assert set(found) == {2}


@pytest.mark.parametrize("rival", [2.9, 3.1])
def test_what_cannot_be_and_explains_more_makes_a_name_doubtful(rival: float) -> None:
    other = "stribeck_friction"
    effects = [effect("viscous_friction"), effect(other), effect("torque_offset")]
    data, candidates = planted(effects, np.array([[3.0, 0.0], [rival, 0.0], [2.0, 0.0]]))
    expected = {0: Approximation(kind=other)}
    found = approximations(traced(data, candidates, [0], all_but(1)), NAMES, [])
    assert found == (expected if rival > 3.0 else {})
    assert approximations(traced(data, candidates, [0]), NAMES, []) == {}
    # The offset that cannot be explains less, whatever the other friction would.
    assert approximations(traced(data, candidates, [0], all_but(2)), NAMES, []) == {}
    # Once the other is in, it stands for nothing else.
    assert approximations(traced(data, candidates, [0, 1], all_but(1)), NAMES, []) == {}


@pytest.mark.parametrize(
    ("size", "certain", "expected"),
    [(0.5, True, {0}), (0.5, False, set()), (2.0, True, set())],
)
def test_what_can_be_predicted_and_is_more_makes_a_name_doubtful(
    size: float, certain: bool, expected: set[int]
) -> None:
    """The residual has the energy one; of that, 0.8 can be predicted."""
    data, candidates = planted([effect("load_dependent_friction")], np.array([[size, 0.0]]))
    depends = (Covariate("position", "a"), Covariate("load", "a"))
    rest = ExcessResidual("a", 1.0, 0.1, 0.4, "band", certain, 0.8, depends)
    found = approximations(traced(data, candidates, [0]), NAMES, [rest])
    assert set(found) == expected
    assert all(each == Approximation(covariates=depends) for each in found.values())
    elsewhere = replace(rest, joint="b")
    assert approximations(traced(data, candidates, [0]), NAMES, [elsewhere]) == {}
    data, candidates = planted([effect("armature")], np.array([[0.95, 0.0]]))
    assert approximations(traced(data, candidates, [0]), NAMES, [rest]) == {}
    unforeseen = replace(rest, noise=0.1, predictable=0.0, depends_on=())  # 0.99 exceed the noise
    found = approximations(traced(data, candidates, [0]), NAMES, [unforeseen])
    assert found == ({0: Approximation()} if certain else {})


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize(
    ("kind", "runs", "share"),
    [
        ("torque_offset", (), 0.5),
        ("coulomb_friction", (), 0.3),
        ("coulomb_friction", ("a",), 0.25),
        ("friction_change", (), 0.25),
    ],
)
def test_a_mean_beside_a_large_rest_is_doubted_for_all_of_it(
    kind: str, runs: tuple[str, ...], share: float, above: bool
) -> None:
    """The residual has the energy one; 0.35 of it can be predicted, 0.99 are no noise."""
    mean = replace(effect(kind), runs=runs)
    torque = np.zeros((len(mean.parameters), 2))
    torque[0, 0] = np.sqrt(0.99 / share) * (1.05 if above else 0.95)
    data, candidates = planted([mean], torque)
    depends = (Covariate("position", "b"), Covariate("speed", "b"))
    rest = ExcessResidual("a", 1.0, 0.1, 0.1, "band", True, 0.35, depends)
    found = approximations(traced(data, candidates, [0]), NAMES, [rest])
    assert set(found) == (set() if above else {0})
    noisy = replace(rest, predictable=0.25)  # and no map, of which a constant is the mean
    found = approximations(traced(data, candidates, [0]), NAMES, [noisy])
    assert set(found) == (set() if above or kind == "torque_offset" else {0})
    data, candidates = planted([effect("armature")], np.array([[1.3, 0.0]]))
    assert approximations(traced(data, candidates, [0]), NAMES, [rest]) == {}


@pytest.mark.parametrize(("cycles", "doubted"), [(1.5, True), (2.9, True), (3.1, False)])
def test_a_wave_that_was_not_seen_to_repeat_is_doubted_beside_a_large_rest(
    cycles: float, doubted: bool
) -> None:
    """It explains a hundred times what is left; the constant beside it is the curve's, too."""
    robot = random_robot(4, joints=3, branches=False, prismatic=False)
    signals = signals_of(robot, samples=SAMPLES)
    periods = 2 * np.pi * cycles / float(np.ptp(signals.q[:, 0]))
    wave, constant = effect("ripple", periods=periods), effect("torque_offset")
    torque = np.array([[10.0, 0.0], [10.0, 0.0], [3.0, 0.0]])
    data, candidates = planted([wave, constant], torque)
    there = replace(traced(data, candidates, [0, 1]), signals=(signals,) * len(FOLDS))
    rest = ExcessResidual("a", 1.0, 0.1, 0.2, "band", True, 0.1, ())
    assert set(approximations(there, NAMES, [rest])) == ({0, 1} if doubted else set())
    elsewhere = replace(rest, joint="b")
    assert 0 not in approximations(there, NAMES, [elsewhere])
    unsure = replace(rest, certain=False)
    assert 0 not in approximations(there, NAMES, [unsure])


@pytest.mark.parametrize(("size", "expected"), [(7.0, {1}), (5.0, {0, 1})])
def test_friction_is_the_mean_of_what_varies_it_and_is_none(
    size: float, expected: set[int]
) -> None:
    """Coulomb friction of energy 49 or 25 beside one that varies it, of 10, with 2 left."""
    varied = effect("position_friction", periods=1.0, power=0.0)
    torque = np.array([[size, 0.0], [np.sqrt(10.0), 0.0], [0.0, 0.0], [1.4, 0.0]])
    data, candidates = planted([effect("coulomb_friction"), varied], torque)
    rests = [left("a", "q[a]", share=0.7)]
    found = approximations(traced(data, candidates, [0, 1]), NAMES, rests)
    assert set(found) == expected
    assert all(each == function_of("q[a]") for each in found.values())


@pytest.mark.parametrize(("size", "runs", "doubted"), [
    (0.9, ("a",), True), (1.1, ("a",), False), (0.9, (), False),
])  # fmt: skip
def test_a_change_must_explain_more_than_is_left_in_its_runs(
    size: float, runs: tuple[str, ...], doubted: bool
) -> None:
    """Of energy 0.81 or 1.21, in noise of one."""
    change = replace(effect("torque_offset"), runs=runs)
    data, candidates = planted([change], np.array([[size, 0.0]]))
    found = approximations(traced(data, candidates, [0]), NAMES, [])
    assert found == ({0: Approximation()} if doubted else {})


SHAPES = [effect("stribeck_friction", stribeck_speed=speed) for speed in (0.1, 0.2)]


@pytest.mark.parametrize(
    ("effects", "chosen", "doubted"),
    [
        ([effect("viscous_friction"), effect("stribeck_friction")], [0], {0}),
        ([effect("viscous_friction"), effect("elasticity")], [0], {0}),  # of several quantities
        ([effect("viscous_friction"), effect("armature")], [0], set()),  # not of speed
        (SHAPES, [0], set()),  # another shape of what is chosen
        ([effect("viscous_friction"), effect("stribeck_friction")], [], set()),
    ],
)
def test_whether_what_cannot_be_makes_a_name_doubtful(
    effects: list[Effect], chosen: list[int], doubted: set[int]
) -> None:
    """It explains much more than what is chosen."""
    data, candidates = planted(effects, np.array([[1.0, 0.0], [9.0, 0.0]]))
    there = traced(data, candidates, chosen, all_but(1))
    assert set(approximations(there, NAMES, [])) == doubted
    rests = [left("a", "v[a]", "time", share=0.95)]
    found = approximations(there, NAMES, rests)
    assert found == (dict.fromkeys(chosen, function_of("v[a]", "time"))), "told before a rival"
