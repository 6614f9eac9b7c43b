"""Nothing of the held-out part is used but for the errors: changed, it changes nothing else."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from excite_cli.diagnosis.records import HELD_OUT_DIFFERS, Assumption, Diagnosis
from excite_cli.diagnosis.verdict import HeldOutVerdict
from excite_cli.diagnosis.words import assumption_in_words
from excite_cli.effects.catalogue import EVERYDAY, EVERYDAY_FRICTION
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.robot.model import Array
from tests.diagnosis.simulated_arm import ELBOW, PITCH, ROBOT, planted, played, told

pytestmark = pytest.mark.long

RATE = 200.0
# What may differ: what is measured on the held-out part, and the time it took.
FREE = {"before", "after", "textbook", "untouched", "held_out_traces", "seconds"}
FRICTION = planted("coulomb_friction", ELBOW, 1.5)


def found_in(data: Dataset, held_out: str | None = None) -> Diagnosis:
    """A few kinds only: every part of the program is gone through, quickly."""
    kinds = "viscous_friction,coulomb_friction,payload,armature"
    return told(data, kinds, held_out=held_out)


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    """Three runs of an arm with dry friction and, in the last two, a payload."""
    payload = planted("payload", tuple(range(ROBOT.n)), 0.5, 2, 3)
    return played([FRICTION, payload], rate=RATE)


@pytest.fixture(scope="module")
def baseline(dataset: Dataset) -> Diagnosis:
    """Of the data as they are, the last run held out."""
    return found_in(dataset)


def differences(one: Diagnosis, other: Diagnosis) -> set[str]:
    """Fields that are not the same, bit by bit; what is measured on held-out data is left out."""
    one, other = unjudged(one), unjudged(other)
    names = [field.name for field in fields(Diagnosis)]
    return {name for name in names if not same(getattr(one, name), getattr(other, name))}


def unjudged(found: Diagnosis) -> Diagnosis:
    effects = tuple(replace(each, verdict=None, removes={}, parts={}) for each in found.effects)
    findings = tuple(each for each in found.findings if each.kind != HELD_OUT_DIFFERS)
    return replace(found, effects=effects, findings=findings)


def same(one: Any, other: Any) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and one.tobytes() == other.tobytes()
    if hasattr(one, "__dataclass_fields__"):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[k], other[k]) for k in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one.hex() == other.hex() if isinstance(one, float) else bool(one == other)


def disturbed(run: Run, where: np.ndarray | None = None) -> Run:
    """Other positions, speeds and torques, and masks, at the samples `where` (T,), or all."""
    rng = np.random.default_rng(5)
    at = np.ones((len(run.t), 1), bool) if where is None else where[:, None]
    wave = 0.03 * np.sin(2 * np.pi * 7.0 * run.t[:, None] + np.arange(ROBOT.n))  # a faster line
    noise = rng.normal(size=run.tau.shape) * run.tau.std(axis=0)
    q = np.where(at, run.q + wave + 1e-4 * rng.normal(size=run.q.shape), run.q)
    tau = np.where(at, 1.3 * run.tau + noise + 2.0, run.tau)
    valid = run.usable() & ~(at & (rng.random(run.tau.shape) < 0.02))
    assert run.dq is not None
    return replace(run, q=q, tau=tau, dq=np.where(at, 1.1 * run.dq, run.dq), valid=valid)


def test_a_held_out_run_is_used_for_the_errors_only(dataset: Dataset, baseline: Diagnosis) -> None:
    """The last one; and one by name, another length of which matters as little."""
    first, second, last = dataset.runs
    other = found_in(replace(dataset, runs=(first, second, disturbed(last))))
    assert baseline.held_out_run == "r3"
    assert baseline.effects, "something was chosen and fitted"
    assert differences(baseline, other) == FREE
    assert other.after.mean_relative > 2 * baseline.after.mean_relative
    changed = replace(dataset, runs=(disturbed(first).cut(0, 700), second, last))
    one, other = (found_in(data, "r1") for data in (dataset, changed))
    assert one.held_out_run == "r1"
    assert differences(one, other) == FREE


def test_training_data_do_matter(dataset: Dataset, baseline: Diagnosis) -> None:
    """The comparison would see a leak: a slight change of one training sample shows everywhere."""
    run = dataset.runs[0]
    tau = run.tau.copy()
    tau[len(tau) // 2, 0] += 0.1
    other = found_in(replace(dataset, runs=(replace(run, tau=tau), *dataset.runs[1:])))
    changed = {"phi", "base_values", "information", "rounds", "processing"}
    assert changed <= differences(baseline, other)


def test_held_out_blocks_of_a_single_run_are_used_for_the_errors_only(dataset: Dataset) -> None:
    run = twice_as_long(dataset.runs[0])
    whole = replace(dataset, runs=(run,))
    held_out = np.zeros(len(run.t), bool)
    for block in split(whole).held_out:
        held_out |= (run.t >= block.t[0] - 1e-9) & (run.t <= block.t[-1] + 1e-9)
    assert 0.2 < held_out.mean() < 0.4
    one, other = (
        found_in(data) for data in (whole, replace(whole, runs=(disturbed(run, held_out),)))
    )
    assert one.effects
    assert one.noise_floor, "two periods, seen past the held-out blocks"
    assert differences(one, other) == FREE
    assert other.after.mean_relative > 1.5 * one.after.mean_relative


def twice_as_long(run: Run) -> Run:
    """The motion is periodic."""

    def twice(x: Array) -> Array:
        return np.concatenate([x, x])

    t = np.concatenate([run.t, run.t + len(run.t) / RATE])
    noise = np.random.default_rng(1).normal(size=(len(t), ROBOT.n))
    tau = twice(run.tau) + 0.01 * run.tau.std(axis=0) * noise
    return Run("only", t, twice(run.q), tau, None if run.dq is None else twice(run.dq))


def test_what_is_assumed_of_the_held_out_run_is_told_and_wrong(baseline: Diagnosis) -> None:
    """The payload is found in the second run; nobody said that the held-out one has it, too."""
    (payload,) = [each for each in baseline.effects if each.effect.kind == "payload"]
    assert payload.effect.runs == ("r2",)
    assert payload.verdict is HeldOutVerdict.HARMFUL
    assert not baseline.good
    assumed = Assumption("payload", ("r2",), ("r3",), False, payload.effect.joints)
    assert baseline.assumed == (assumed,)
    words = [each.text for each in baseline.findings if each.kind == "assumed"]
    assert words == [assumption_in_words(assumed)]
    assert "payload of slide in r2: taken to be absent in the held-out r3." in words[0]
    assert "runs: {r2: {payload: a}, r3: {payload: a}}" in words[0]
    friction = replace(assumed, kind="coulomb_friction", joints=("elbow",))
    assert "coulomb_friction of elbow in r2:" in assumption_in_words(friction)


@pytest.mark.parametrize("still_there", [True, False])
def test_what_the_held_out_run_has_is_confirmed_and_what_it_lacks_is_harmful(
    still_there: bool,
) -> None:
    """The joint may have been greased before the last recording."""
    first = played([FRICTION], (1, 2))
    last = played([FRICTION] if still_there else [], (3,))
    found = told(replace(first, runs=(*first.runs, *last.runs)), "coulomb_friction")
    (named,) = found.effects
    assert (named.effect.kind, named.effect.joints) == ("coulomb_friction", ("elbow",))
    verdict = HeldOutVerdict.CONFIRMED if still_there else HeldOutVerdict.HARMFUL
    assert (named.verdict, found.good) == (verdict, still_there)
    assert found.harmful == (() if still_there else (named,))
    before, after = found.before, found.after
    assert found.untouched is not None
    if still_there:
        assert named.removes["elbow"].rms > 0.1
        assert found.untouched.mean_relative > after.mean_relative
    else:
        assert named.removes["elbow"].rms < -0.5
    # Before is the same model without it, fitted to the same data in the same way.
    for joint, removed in named.removes.items():
        for name in ("relative", "rms", "relative_moving"):
            expected = getattr(before, name)[joint] - getattr(after, name)[joint]
            assert getattr(removed, name) == expected


def confirmed(found: Diagnosis) -> set[str]:
    return {e.effect.kind for e in found.effects if e.verdict is HeldOutVerdict.CONFIRMED}


def test_what_is_confirmed_waits_for_the_setup() -> None:
    """Not where the config resolves the doubt, nor for speeds that nothing needs."""
    by_load = planted("load_dependent_friction", PITCH, 0.15)
    data = played([planted("coulomb_friction", ELBOW, 1.5), by_load])

    def doubted(change: dict[str, Any], *keys: str) -> Diagnosis:
        doubt = Finding("clock", "warning", "a second lasts 0.7 s", "", (), change)
        kinds = "viscous_friction,coulomb_friction,load_dependent_friction"
        return told(replace(data, findings=(doubt,)), kinds, *keys)

    clock = {"measurement.clock": 0.7}
    still_open = doubted(clock)
    assert confirmed(still_open) <= {*EVERYDAY_FRICTION, *EVERYDAY}
    assert any(each.kind == "open_setup" for each in still_open.findings)
    for trust in ("[clock]", "true"):
        resolved = doubted(clock, f"measurement.trust={trust}")
        assert "load_dependent_friction" in confirmed(resolved), trust
    speeds = doubted({"measurement.channels": {"dq": None}})
    assert "load_dependent_friction" in confirmed(speeds)
