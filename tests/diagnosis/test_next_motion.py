"""The motion after a diagnosis: it separates aliases, or excites what was found."""

import shlex
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.spec import Spec
from excite_cli.diagnosis.expectation import expectation
from excite_cli.diagnosis.next_motion import NextMotion, next_experiment, plan_after
from excite_cli.diagnosis.records import Diagnosis, EffectRecord
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.errors import FileError
from excite_cli.excitation.admissible import worst_margins
from excite_cli.excitation.objective import Stack
from excite_cli.excitation.result import Result
from excite_cli.excitation.run import new_result
from tests.diagnosis.synthetic_diagnosis import (
    CONFIG,
    NOISE,
    earlier_data,
    make_diagnosis,
    quadratic,
    smoke_spec,
    viscous,
)
from tests.excitation.smoke import planned

COULOMB = EffectRecord("coulomb_friction", ("elbow",), {}, (1.0,))
ALL = ("shoulder_yaw", "shoulder_pitch", "elbow", "wrist_roll", "slide")
SPRING = EffectRecord("spring", ("shoulder_pitch",), {}, (3.0, 0.2))


def run(following: NextMotion) -> Result:
    begin = new_result(following.model, [("diagnosis.h5", following.prior)], {})
    return planned(following.problem, begin, model=following.model)


@pytest.fixture(scope="module")
def separate() -> NextMotion:
    return plan_after(make_diagnosis(), smoke_spec(), CONFIG.parent)


def test_the_motion_tells_the_pair_apart(separate: NextMotion) -> None:
    """Better than one that only excites, and best of all once the solver has worked on it."""
    assert separate.purpose == "separate"
    assert (
        "separates these indistinguishable effects: viscous_friction on elbow"
        in separate.messages[0]
    )
    result = run(separate)
    (motion,) = result.motions
    outlook = separate.outlook([motion.coefficients])
    assert outlook["expected_kl"] > 3 > outlook["pairs"][0]["kl_so_far"]
    assert outlook["pairs"][0]["motions_needed"] == 1
    assert motion.improved
    (excited,) = run(plan_after(make_diagnosis(rivals=()), smoke_spec(), CONFIG.parent)).motions
    assert outlook["expected_kl"] > 1.3 * separate.outlook([excited.coefficients])["expected_kl"]
    longer = plan_after(make_diagnosis(), smoke_spec("optimizer.max_iterations=15"), CONFIG.parent)
    (solved,) = run(longer).motions
    assert longer.outlook([solved.coefficients])["expected_kl"] > 60
    for each in (motion, solved):
        margins = worst_margins(separate.model, each.coefficients, 700.0)
        assert all(worst.violations == 0 for worst in margins.values())
    # The result belongs to the model without rivals.
    assert result.effect_names == ("viscous_friction[elbow].viscous",)
    block = separate.model.objective().block(motion.coefficients)
    whole = np.vstack([separate.prior.factor, block])
    assert np.allclose(result.stack.factor.T @ result.stack.factor, whole.T @ whole)
    assert motion.stacked_condition_number == pytest.approx(np.linalg.cond(whole), rel=1e-6)
    assert "viscous_friction" in result.config
    assert "nonlinear" not in result.config


def _least_squares(rows: np.ndarray, truth: np.ndarray, free: list[int]) -> float:
    target = rows @ truth
    left = target - rows[:, free] @ np.linalg.lstsq(rows[:, free], target, rcond=None)[0]
    return 0.5 * float(left @ left)


def test_purpose_and_command_without_planning() -> None:
    found = next_experiment(make_diagnosis(), "arm.yaml", "found.h5")
    assert found["purpose"] == "separate"
    (pair,) = found["pairs"]
    assert pair["effect"] == {"kind": "viscous_friction", "joints": ["elbow"], "shape": {}}
    assert pair["alias"]["kind"] == "nonlinear_viscous_friction"
    assert found["command"] == "excite optimize arm.yaml --after found.h5"
    spaced = next_experiment(make_diagnosis(), "my arm.yaml", "it's $found.h5")["command"]
    assert shlex.split(spaced)[2:] == ["my arm.yaml", "--after", "it's $found.h5"]
    assert next_experiment(make_diagnosis(rivals=()))["purpose"] == "excite"
    made = make_diagnosis()
    (named,) = made.effects
    weighed = replace(made, effects=(replace(named, verdict=HeldOutVerdict.WEIGHED),))
    assert next_experiment(weighed)["purpose"] == "excite"  # no motion tells it


def test_divergence_so_far_is_that_of_the_rows_themselves(separate: NextMotion) -> None:
    """Both ways by least squares on the earlier rows in their own units."""
    rows = earlier_data([viscous()], [quadratic()]).rows / NOISE
    rank = rows.shape[1] - 2
    first, second = np.zeros(rank + 2), np.zeros(rank + 2)
    first[rank], second[rank + 1] = viscous().values[0], quadratic().values[0]
    expected = min(
        _least_squares(rows, first, [*range(rank), rank + 1]),
        _least_squares(rows, second, [*range(rank), rank]),
    )
    alpha = separate.problem.still(separate.problem.robot.posture)
    (pair,) = separate.outlook([alpha])["pairs"]
    assert pair["kl_so_far"] == pytest.approx(expected, rel=1e-4)
    assert expected < 3


def test_without_aliases_it_excites_on_top_of_the_data() -> None:
    planned = plan_after(make_diagnosis([viscous(), SPRING], ()), smoke_spec(), CONFIG.parent)
    assert planned.purpose == "excite"
    assert "all effects are distinguishable" in planned.messages[0]
    rows = earlier_data([viscous(), SPRING], ()).rows / NOISE * planned.problem.column_scales
    assert np.allclose(planned.prior.factor.T @ planned.prior.factor, rows.T @ rows)
    assert planned.problem.weighting.rows == pytest.approx(np.full(5, 1 / NOISE))
    (motion,) = run(planned).motions
    assert motion.stacked_condition_number < 0.5 * np.linalg.cond(planned.prior.factor)
    assert planned.outlook([motion.coefficients]) == {"purpose": "excite", "pairs": []}
    # The same torque in other words is not planned for. Coulomb friction of asymmetric friction and
    # an offset: no motion can tell.
    twin = EffectRecord("asymmetric_friction", ("elbow",), {}, (1.0, 1.0))
    planned = plan_after(make_diagnosis([COULOMB], (twin,)), smoke_spec(), CONFIG.parent)
    assert planned.purpose == "excite"
    assert "no motion distinguishes the effects" in planned.messages[0]
    assert any("no motion separates them" in message for message in planned.messages)


def test_several_pairs_the_smallest_counts() -> None:
    cubic = EffectRecord("nonlinear_viscous_friction", ("elbow",), {"power": 3.0}, (6.0,))
    planned = plan_after(make_diagnosis(rivals=(quadratic(), cubic)), smoke_spec(), CONFIG.parent)
    assert planned.problem.separation is not None
    assert len(planned.problem.separation.directions) == 4
    (motion,) = run(planned).motions
    outlook = planned.outlook([motion.coefficients])
    assert len(outlook["pairs"]) == 2
    assert outlook["expected_kl"] == min(pair["expected_kl"] for pair in outlook["pairs"])
    assert outlook["expected_kl"] > 3


@pytest.mark.parametrize(
    ("rival", "words"),
    [
        (
            EffectRecord("contact", ALL, {"start": 1.0, "end": 2.0}, (1.0, 2.0, 3.0)),
            "a touch happens in one run",
        ),
        (replace(quadratic(), values=()), "holds no value"),
        (replace(quadratic(), runs=("run_2",)), "present in recorded runs only (run_2)"),
    ],
)
def test_rivals_that_no_motion_excites_are_told(rival: EffectRecord, words: str) -> None:
    planned = plan_after(make_diagnosis(rivals=(rival,)), smoke_spec(), CONFIG.parent)
    assert planned.purpose == "excite"
    assert any(words in message for message in planned.messages)


def test_diagnoses_that_do_not_fit() -> None:
    made = make_diagnosis()
    known = made.information
    for change, words in (
        ({"fingerprint": "other"}, "another robot"),
        ({"information": replace(known, noise=np.zeros(5))}, "no noise level"),
        ({"information": replace(known, factor=known.factor[:, :-1])}, "columns"),
    ):
        with pytest.raises(FileError, match=words):
            plan_after(replace(made, **change), smoke_spec(), CONFIG.parent)


# Planned for the torques of the work.

FOR_WORK = "criterion.kind=predicted_torque"


def _known(possible: tuple[EffectRecord, ...], spec: Spec) -> tuple[Diagnosis, NextMotion]:
    """A diagnosis without aliases that tested `possible` effects, and what follows."""
    found = make_diagnosis(rivals=possible)
    about = replace(found.information, rivals=(), possible=possible)
    effects = tuple(replace(each, aliases=()) for each in found.effects)
    found = replace(found, effects=effects, information=about)
    return found, plan_after(found, spec, CONFIG.parent)


def test_planned_for_the_work_the_data_count_for_what_was_tested_too() -> None:
    possible = (replace(COULOMB, joints=("slide",)),)
    found, planned = _known(possible, smoke_spec(FOR_WORK))
    assert "excites the model with its 1 effect and 1 that it may have" in planned.messages[0]
    assert planned.problem is planned.model
    kinds = [each.kind for each in planned.problem.extension.effects]
    assert kinds == ["viscous_friction", "coulomb_friction"]
    whole = np.asarray(found.information.factor) * planned.problem.column_scales
    assert np.allclose(planned.prior.factor.T @ planned.prior.factor, whole.T @ whole)
    assert planned.known is not None
    problem, data = planned.known
    assert problem is planned.problem
    result = run(planned)
    told = expectation(planned.model, result, known=planned.known)
    assert told.all_data
    alone = expectation(planned.model, replace(result, prior_stack=Stack.empty(problem.columns)))
    assert told.deviations[0] < alone.deviations[0]
    assert result.motions[0].predicted_deviation == pytest.approx(told.deviations[0])
    assert problem.prediction is not None
    assert told.deviations[0] < problem.prediction.deviation(data.factor)


def test_planned_for_another_criterion_it_is_predicted_with_the_data_as_well() -> None:
    found, planned = _known((replace(COULOMB, joints=("slide",)),), smoke_spec())
    assert planned.problem.prediction is None
    assert planned.known is not None
    problem, data = planned.known
    assert problem.prediction is not None
    assert data.rows == len(found.information.factor)


def test_aliases_are_separated_whatever_motions_are_planned_for() -> None:
    planned = plan_after(make_diagnosis(), smoke_spec(FOR_WORK), CONFIG.parent)
    assert planned.purpose == "separate"
    assert planned.problem.separation is not None
