"""Copies of training data in the held-out part are refused; whatever is measured anew is not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.identification.held_out_copies import refuse_held_out_copies
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Array, Dataset, Run
from excite_cli.measurement.run_identity import Origin
from excite_cli.measurement.stamps import equidistant

RATE, SECONDS, JOINTS = 200, 6, 3
STEP = 1.0 / RATE


def recording(name: str, seed: int, joints: int = JOINTS, noise: float = 0.01) -> Run:
    """Two periods of one motion, the same for every seed; the seed makes the noise."""
    t = STEP * np.arange(SECONDS * RATE)
    phase = 2 * np.pi * t[:, None] / (SECONDS / 2) + np.arange(joints)
    tau = np.cos(phase) + noise * np.random.default_rng(seed).normal(size=(len(t), joints))
    return Run(name, t, np.sin(phase), tau, origin=Origin(f"{name}.h5"))


def judged(*runs: Run, held_out: str | None = None) -> None:
    names = tuple(f"joint_{j}" for j in range(runs[0].q.shape[1]))
    refuse_held_out_copies(split(Dataset(names, runs), held_out))


def coarse(run: Run, step: float) -> Run:
    """Positions and torques as counts of so coarse a step."""
    return replace(
        run, q=step * np.round(run.q / step), tau=step * np.round(run.tau / step)
    )  # fmt: skip


FIRST, SECOND = recording("a", 1), recording("b", 2)
LATER = replace(FIRST, name="copy", origin=Origin("copy.h5"))
COPIES = {
    "as it is": LATER,
    "shifted by a second": LATER.cut(RATE, SECONDS * RATE),
    "cut out": LATER.cut(333, 777),
    "other stamps": replace(LATER, t=1.7 * LATER.t + 40.0),
    "part of something new": replace(
        LATER, tau=np.where(LATER.t[:, None] < 1.0, FIRST.tau, recording("", 7).tau)
    ),
}


@pytest.mark.parametrize("copy", COPIES.values(), ids=COPIES)
def test_copies_are_refused(copy: Run) -> None:
    with pytest.raises(FileError, match="Runs 'copy' and 'a'") as refused:
        judged(FIRST, SECOND, copy)
    assert "hold the same samples to the last digit" in str(refused.value)
    assert "--held-out" in str(refused.value)


def test_the_message_says_which_files_and_how_much() -> None:
    with pytest.raises(FileError, match=r"\(copy.h5, a.h5\).*100% of what is held out"):
        judged(FIRST, SECOND, LATER)
    # Whatever part of a longer run is held out. The copy is the longer one, and begins elsewhere.
    with pytest.raises(FileError, match="'a' and 'copy'"):
        judged(FIRST.cut(101, 900), SECOND, LATER, held_out="a")


def jittering(run: Run, seed: int) -> Run:
    """As a recorder with an uneven clock would have it."""
    t = run.t + 0.1 * STEP * np.random.default_rng(seed).uniform(-1, 1, len(run.t))
    return replace(run, t=t)


@pytest.mark.parametrize("seed", [None, 9])
def test_copies_that_were_interpolated_are_refused(seed: int | None) -> None:
    """The copy has even stamps, or others: its interpolated values differ, what was read not."""
    (first,), _ = equidistant(jittering(FIRST, 8))
    copy = LATER.cut(RATE // 2, SECONDS * RATE)
    if seed is not None:
        (copy,), _ = equidistant(jittering(copy, seed))
    assert np.isin(copy.tau, first.tau).mean() < 0.01
    with pytest.raises(FileError, match="hold the same samples"):
        judged(first, SECOND, copy)


def test_a_run_that_repeats_itself_is_refused() -> None:
    def thrice(x: Array) -> Array:
        return np.concatenate([x[:400]] * 3)

    with pytest.raises(FileError, match=r"Run 'a' \(a.h5\) repeats itself"):
        judged(replace(FIRST, q=thrice(FIRST.q), tau=thrice(FIRST.tau)))


def test_a_motion_that_is_recorded_again_is_no_copy() -> None:
    judged(FIRST, SECOND, recording("c", 3))
    judged(FIRST)


@pytest.mark.parametrize("joints", [1, 6])
def test_repeated_periods_of_coarse_encoders_are_no_copies(joints: int) -> None:
    """Noise below a step: many samples are alike, never dozens in a row."""
    runs = [coarse(recording(str(i), i, joints, 0.004), 0.01) for i in range(3)]
    alike = (runs[0].tau == runs[2].tau) & (runs[0].q == runs[2].q)
    assert alike.all(axis=1).mean() > (0.4 if joints == 1 else 0.005)
    judged(*runs)
    judged(runs[0])


def still(name: str, seed: int, flicker: Sequence[int]) -> Run:
    """Moves a second, then stands, while the torque of some joints flickers by one count."""
    run = recording(name, seed)
    stands = run.t >= 1.0
    q, tau = run.q.copy(), run.tau.copy()
    q[stands], tau[stands] = q[RATE], 0.5
    rng = np.random.default_rng(seed)
    for joint in flicker:
        tau[stands, joint] += 0.01 * rng.integers(0, 2, stands.sum())
    return replace(run, q=q, tau=tau)


@pytest.mark.parametrize("flicker", [(), (0,), (0, 1, 2)])
def test_robots_that_stand_are_no_copies(flicker: tuple[int, ...]) -> None:
    judged(*(still(name, seed, flicker) for seed, name in enumerate("abc")))
