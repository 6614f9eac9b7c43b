"""Every criterion: right value, right derivative, honest bounds of the smooth forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.base import Array, Criterion
from excite_cli.criteria.catalogue import CRITERIA, build_criterion
from excite_cli.criteria.condition_number import ConditionNumber
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.errors import ConfigError
from excite_cli.excitation.gradient_check import central_differences, relative_error
from excite_cli.excitation.problem import Problem
from tests.excitation.smoke import one_motion, smoke


def test_unknown_kind_suggests_the_nearest() -> None:
    with pytest.raises(ConfigError, match=r"criterion\.kind: .*Did you mean 'condition_number'\?"):
        build_criterion(CriterionSpec(kind="condition_numbre"))


def _all_members() -> list:
    members = []
    for kind in CRITERIA.members:
        criterion = build_criterion(CriterionSpec(kind=kind))
        members += [criterion, *criterion.continuation()]
    return members


def _spectrum(seed: int, size: int) -> np.ndarray:
    return np.sort(np.exp(np.random.default_rng(seed).uniform(-3, 3, size)))[::-1]


@settings(max_examples=30, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999), size=st.integers(2, 12))
def test_derivative_agrees_with_differences(seed: int, size: int) -> None:
    sigma = _spectrum(seed, size)
    for criterion in _all_members():
        expected = central_differences(criterion.value, sigma, 1e-7 * sigma[-1])
        assert relative_error(criterion.derivative(sigma), expected) < 1e-5, criterion


def test_values_against_their_definitions() -> None:
    matrix = np.random.default_rng(0).normal(size=(30, 5))
    sigma = np.linalg.svd(matrix, compute_uv=False)
    gram = matrix.T @ matrix

    def value(kind: str) -> float:
        return build_criterion(CriterionSpec(kind=kind)).value(sigma)

    assert np.exp(value("condition_number")) == pytest.approx(np.linalg.cond(matrix))
    assert value("log_det") == pytest.approx(-np.linalg.slogdet(gram)[1] / 5)
    assert np.exp(value("trace_inverse")) == pytest.approx(np.trace(np.linalg.inv(gram)))
    assert np.exp(-value("sigma_min")) == pytest.approx(sigma[-1])
    both = np.linalg.cond(matrix) + 1 / sigma[-1]
    assert np.exp(value("condition_and_sigma_min")) == pytest.approx(both)


@settings(max_examples=30, derandomize=True, deadline=None)
@given(seed=st.integers(0, 9999), size=st.integers(2, 40), p=st.floats(2.0, 200.0))
def test_smooth_form_bounds_the_condition_number(seed: int, size: int, p: float) -> None:
    sigma = _spectrum(seed, size)
    exact, smooth = ConditionNumber().value(sigma), SmoothConditionNumber(p).value(sigma)
    assert exact - 1e-12 <= smooth <= exact + 2 * np.log(size) / p + 1e-12


def test_continuation_ends_at_or_near_what_was_asked() -> None:
    sigma = _spectrum(5, 9)
    for kind in CRITERIA.members:
        criterion = build_criterion(CriterionSpec(kind=kind, smoothing=32.0))
        last = criterion.continuation()[-1]
        assert last.value(sigma) == pytest.approx(criterion.value(sigma), abs=0.01), kind


def test_smooth_forms_of_extreme_spectra() -> None:
    """No overflow, no change with scale, and infinite where a parameter does not show."""
    sigma = np.array([1e150, 1.0, 1e-150])
    criterion = SmoothConditionNumber(500.0)
    assert criterion.value(sigma) == pytest.approx(np.log(1e300))
    assert np.all(np.isfinite(criterion.derivative(sigma)))
    sigma = _spectrum(5, 9)
    for criterion in (ConditionNumber(), SmoothConditionNumber(16.0)):
        assert criterion.value(7.0 * sigma) == pytest.approx(criterion.value(sigma))
    assert SmoothConditionNumber(4.0).value(np.array([2.0, 1.0, 0.0])) == np.inf


class WorstThree(Criterion):
    """Minus the mean logarithm of the three smallest singular values."""

    name = "worst_three"

    def value(self, sigma: Array) -> float:
        return -float(np.mean(np.log(sigma[-3:])))

    def derivative(self, sigma: Array) -> Array:
        derivative = np.zeros_like(sigma)
        derivative[-3:] = -1.0 / (3.0 * sigma[-3:])
        return derivative


def _planned(kind: str) -> tuple[Problem, float]:
    problem = smoke(f"criterion.kind={kind}", "optimizer.max_iterations=40")
    objective = problem.objective()
    sigma = objective.spectrum(objective.block(one_motion(problem).coefficients)).sigma
    return problem, WorstThree().value(sigma)


def test_a_plan_by_it_is_better_by_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CRITERIA.members, "worst_three", WorstThree)
    problem, reached = _planned("worst_three")
    assert isinstance(problem.criterion, WorstThree)
    _, by_another = _planned("condition_number")
    assert reached < by_another - 0.05
