"""Meshes between samples: contact of two milliseconds is found, and standing apart is proved."""

from pathlib import Path

import numpy as np
import pytest

from excite_cli.config.load import load_spec
from excite_cli.excitation.admissible import path_of
from excite_cli.excitation.inspection import Look, inspect, mesh_check_of
from excite_cli.excitation.mesh_verdict import mesh_verdict
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.geometry.mesh_check import MeshCheck

CONFIGS = Path(__file__).parents[2] / "configs"
CLEAR = np.array([0.0, 0.6, 0.8, 0.0, 0.05])
IN_CONTACT = np.array([0.87, -1.65, -2.39, -1.81, 0.07])


@pytest.fixture(scope="module")
def problem() -> Problem:
    return build_problem(load_spec(CONFIGS / "smoke.yaml"), CONFIGS)


@pytest.fixture(scope="module")
def check(problem: Problem) -> MeshCheck:
    found = mesh_check_of(problem)
    assert found is not None
    return found


def towards_contact(problem: Problem, share: float) -> np.ndarray:
    """One swing from a clear posture towards one in contact."""
    still = problem.still(CLEAR + share * (IN_CONTACT - CLEAR) / 2)
    harmonics = (len(still) - 1) // 2
    still[harmonics] = share * (IN_CONTACT - CLEAR) / 2  # cosine of the base frequency
    return still


def test_a_short_contact_between_samples_is_found(problem: Problem, check: MeshCheck) -> None:
    fine = np.linspace(0, 6.0, 6001)
    low, high = 0.0, 1.0
    for _ in range(40):
        share = (low + high) / 2
        path = path_of(problem, problem.trajectory, towards_contact(problem, share))
        gaps = check.least(path.states_at(fine[:200]).q)
        touching = sum(gap.touching for gap in gaps.broken)  # half of it, the swing being even
        if touching == 1:
            break
        low, high = (low, share) if touching > 1 else (share, high)
    assert touching == 1
    away = np.linspace(0.05, 5.95, 60)  # none at the moment of contact
    verdict = mesh_verdict(path, check, away)
    assert not verdict.gaps.broken
    assert verdict.state == "broken"
    assert "between" in verdict.reason


def test_apart_is_proved(problem: Problem, check: MeshCheck) -> None:
    path = path_of(problem, problem.trajectory, towards_contact(problem, 0.3))
    verdict = mesh_verdict(path, check, np.linspace(0, 6, 100))
    assert verdict.proved
    assert verdict.worst().margin > 0


def test_inspection_counts_what_is_only_between(problem: Problem, check: MeshCheck) -> None:
    """A limit broken between the instants that were looked at counts as one violation."""
    alpha = problem.still(CLEAR)
    alpha[-1, 0], alpha[0, 0] = 1.9, 1.0 + 1e-3  # the yaw swings a thousandth too far, at 1.5 s
    path = path_of(problem, problem.trajectory, alpha)
    seen = inspect(problem, path, None, Look(rate=1.0))  # t = 0, 1, … 6: not at 1.5
    assert all(worst.violations == 0 for worst in seen.worst.values())
    assert seen.violations == 1
    margin = seen.margins["joint_position"]
    assert margin.margin == pytest.approx(-1e-3, abs=2e-4)
    assert margin.time == pytest.approx(1.5, abs=0.1)
    assert seen.certified["joint_position"] is False
    assert seen.meshes is None
    clear = inspect(problem, path_of(problem, problem.trajectory, problem.still(CLEAR)), check,
                    Look(rate=10.0, random=20))  # fmt: skip
    assert clear.violations == 0
    assert all(clear.certified.values())
