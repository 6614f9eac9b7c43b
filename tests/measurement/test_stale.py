"""What repeats is called stale, or stuck, only where the robot really moves."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.measurement.dataset import Run
from excite_cli.measurement.stretches import moves
from excite_cli.measurement.stuck import mask_stuck
from tests.measurement.recordings import JOINTS, check, recorded, without_speed

COUNT = 5e-5  # rad


def _still(seed: int = 0) -> Run:
    """Nothing moves; positions and torques are constant to the last digit."""
    run = without_speed(recorded(seed=seed))
    return replace(
        run, q=np.tile(run.q[0], (len(run.t), 1)), tau=np.tile(run.tau[0], (len(run.t), 1))
    )


def _flickering(seed: int = 0) -> Run:
    """Encoders change by a count now and then, torques are coarse."""
    run, rng = _still(seed), np.random.default_rng(seed)
    counts = rng.uniform(size=run.q.shape) < 0.02
    steps = 0.3 * np.round(rng.normal(0.0, 0.3, run.tau.shape))
    return replace(run, q=run.q + COUNT * counts, tau=run.tau + steps)


def _noisy(seed: int = 0) -> Run:
    """Noise of encoders and torques; a message comes twice now and then."""
    run, rng = _still(seed), np.random.default_rng(seed)
    q = run.q + rng.normal(0.0, COUNT, run.q.shape)
    tau = run.tau + rng.normal(0.0, 0.1, run.tau.shape)
    for at in rng.choice(len(run.t) - 10, 30, replace=False):
        q[at + 1 : at + 3], tau[at + 1 : at + 3] = q[at], tau[at]
    return replace(run, q=q, tau=tau)


def _creeping_sensor(seed: int = 0) -> Run:
    """Encoders flicker; a torque that is read rarely stands for a second, and goes on."""
    run, rng = _flickering(seed), np.random.default_rng(seed)
    tau = run.tau + rng.normal(0.0, 0.1, run.tau.shape)
    tau[400:600, 1] = tau[400, 1]
    return replace(run, tau=tau)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("made", [_still, _flickering, _noisy, _creeping_sensor])
def test_nothing_is_stale_where_nothing_moves(made: Callable[[int], Run], seed: int) -> None:
    run = made(seed)
    for columns in (slice(None), slice(0, 1), slice(1, 2)):  # also of a single joint
        part = replace(run, q=run.q[:, columns], tau=run.tau[:, columns])
        back, findings = mask_stuck(part, JOINTS[columns])
        assert findings == []
        assert back.valid is None


def _frozen(run: Run, at: int) -> Run:
    """Row `at` is repeated up to the end."""
    held = np.minimum(np.arange(len(run.t)), at)
    return replace(run, q=run.q[held], tau=run.tau[held], dq=None)


def test_a_robot_that_comes_to_rest_is_not_stale() -> None:
    """The motion slows down; then nothing changes any more."""
    run = recorded()
    clock = np.cumsum(np.clip((1200 - np.arange(len(run.t))) / 600, 0.0, 1.0)) / 200.0
    q = np.column_stack([np.interp(clock, run.t, column) for column in run.q.T])
    assert mask_stuck(_frozen(replace(run, q=q), 1200), JOINTS)[1] == []


@pytest.mark.parametrize("at", [899, 1000, 1580])
@pytest.mark.parametrize("count", [0.0, COUNT, 1e-3])
def test_a_record_that_freezes_in_motion_is(at: int, count: float) -> None:
    run = _frozen(recorded(), at)
    if count:
        run = replace(run, q=count * np.round(run.q / count))
    back, findings = mask_stuck(run, JOINTS)
    (found,) = findings
    assert (found.kind, found.severity) == ("stale", "warning")
    assert back.usable()[: at + 1].all()
    assert not back.usable()[at + 1 :].any()


def test_a_torque_that_is_constant_where_an_encoder_flickers_is_no_dead_channel() -> None:
    """The elbow is held in one of two runs; its brake says nothing of its torque."""
    moving, rng = without_speed(recorded()), np.random.default_rng(1)
    q, tau = moving.q.copy(), moving.tau.copy()
    q[:, 1] = 0.3 + COUNT * (rng.uniform(size=len(q)) < 0.1)
    tau[:, 1] = 0.0
    runs, findings = check(moving, replace(moving, name="held", q=q, tau=tau))
    assert [(found.kind, found.severity) for found in findings] == [("held", "warning")]
    assert not runs[1].usable()[:, 1].any()
    assert runs[1].usable()[:, [0, 2]].all()


def both_move(*columns: np.ndarray) -> list[bool]:
    return moves(np.column_stack(columns), 150, 250).tolist()


def test_what_moves_and_what_only_flickers() -> None:
    """Seven counts of the same way are within what noise can do, thirty are not."""
    k, rng = np.arange(400), np.random.default_rng(0)
    count = 1e-3  # rad of the encoder
    flicker = count * (k % 7 < 3)
    assert both_move(count * np.floor(k / 40), flicker) == [False, False]
    assert both_move(count * np.floor(k / 10), flicker) == [True, False]
    # A slow wave and noise, both as wide as a few of their steps.
    wave, noise = np.sin(2 * np.pi * k / 15), rng.normal(size=len(k))
    assert both_move(wave, noise, 0.0 * k) == [True, False, False]
    assert moves(np.zeros((1, 2)), 0, 1).tolist() == [False, False]  # of one sample


@pytest.mark.parametrize(("samples", "told"), [(50, []), (150, ["stuck"])])
def test_a_torque_that_stands_for_less_than_a_tenth_of_a_second_is_none(
    samples: int, told: list[str]
) -> None:
    run = recorded(rate=1000.0)
    tau = run.tau.copy()
    tau[3000 : 3000 + samples, 1] = tau[3000, 1]
    assert [found.kind for found in mask_stuck(replace(run, tau=tau), JOINTS)[1]] == told
