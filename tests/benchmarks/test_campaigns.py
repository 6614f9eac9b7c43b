"""The battery of campaigns: cases follow from their numbers, instruments, one case to its score."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.battery import judge as judging
from benchmarks.battery.campaigns import (
    CLEAN,
    FIRST_WITH_COLUMNS,
    GROUPS,
    WITH_COLUMNS,
    group_of,
    make_case,
)
from benchmarks.battery.cases import Case
from benchmarks.battery.decks import DECKS
from benchmarks.battery.instruments import Instruments, recorded
from benchmarks.battery.judge import Judged, Outcome, judge, records_of, rests
from benchmarks.battery.outside import solid
from benchmarks.battery.tables import failures, groups, rates, verdict
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.measurement.dataset import Dataset, Run

SEED = 3


def index_of(group: str, robot: str) -> int:
    """A small case of a group."""
    for index in range(len(GROUPS) * 12):
        if group_of(SEED, index) == group and make_case(SEED, index).robot.name == robot:
            return index
    raise LookupError(group)


def test_a_deck_holds_one_case_of_every_group() -> None:
    for number in range(13):
        start = number * len(GROUPS)
        deck = Counter(group_of(SEED, index) for index in range(start, start + len(GROUPS)))
        assert deck == Counter(GROUPS)


def test_a_case_follows_from_seed_and_index() -> None:
    index = index_of("payload", "smoke")
    one, again, other = make_case(SEED, index), make_case(SEED, index), make_case(SEED + 1, index)
    assert one.plants[0].in_words == again.plants[0].in_words
    assert one.instruments == again.instruments
    assert np.array_equal(one.planted[0].values, again.planted[0].values)
    assert one.instruments != other.instruments


def test_logs_with_columns_are_cases_of_their_own_with_the_temperature_among_them() -> None:
    for index, group in enumerate(WITH_COLUMNS, FIRST_WITH_COLUMNS):
        assert group_of(SEED, index) == group
    index = FIRST_WITH_COLUMNS + WITH_COLUMNS.index("offset_by_column")
    case = make_case(SEED, index)
    names = [each.name for each in case.settings.covariates]
    assert sorted(case.spec.measurement.covariates) == sorted(names)
    assert 2 <= len(names) <= 4
    (plant,) = (each for each in case.plants if each.required)
    assert plant.covariate == names[0]
    warm = case.settings.covariates[0].at(np.linspace(0.0, 2400.0, 200))
    assert np.diff(warm).min() < 0.0 < np.diff(warm).max()


@pytest.mark.parametrize("group", ["payload", "friction_once", "offset_change", "gain_change"])
def test_what_changes_between_runs_is_in_some_training_runs_only(group: str) -> None:
    for index in range(len(GROUPS) * 2):
        if group_of(SEED, index) != group:
            continue
        case = make_case(SEED, index)
        trained = set(case.runs) - {case.held_out}
        changed = case.plants[0].runs & trained
        assert changed
        assert changed < trained


def test_a_payload_is_a_body() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        ten = solid(float(rng.uniform(0.2, 5.0)), rng.uniform(-0.1, 0.1, 3), rng)
        mass, center = ten[0], ten[1:4] / ten[0]
        about = np.array([[ten[4], ten[5], ten[7]], [ten[5], ten[6], ten[8]], [*ten[7:]]])
        inner = about - mass * (center @ center * np.eye(3) - np.outer(center, center))
        moments = np.linalg.eigvalsh(inner)
        assert moments[0] > 0
        assert moments[2] <= moments[0] + moments[1] + 1e-12


def simulated(samples: int = 4000) -> Dataset:
    t = np.arange(samples) / 500.0
    wave = np.stack([np.sin(t), np.cos(3 * t)], axis=1)
    return Dataset(("j1", "j2"), (Run("a", t, wave, 10 * wave, wave),))


def test_instruments_add_the_noise_that_they_tell() -> None:
    found = recorded(simulated(), Instruments(1, 0.02, correlation=0.9))
    noise = found.noise["a"]
    assert np.allclose(found.dataset.runs[0].tau - simulated().runs[0].tau, noise)
    rms = np.sqrt(np.mean(simulated().runs[0].tau ** 2, axis=0))
    assert np.allclose(noise.std(axis=0), 0.02 * rms, rtol=0.2)
    assert np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1] == pytest.approx(0.9, abs=0.05)


def test_stale_packets_repeat_all_channels_and_lost_ones_leave_gaps() -> None:
    stale = recorded(simulated(), Instruments(1, 0.02, stale=0.02)).dataset.runs[0]
    repeated = (np.diff(stale.tau, axis=0) == 0).all(axis=1)
    assert 0.01 < repeated.mean() < 0.03
    assert np.array_equal((np.diff(stale.q, axis=0) == 0).all(axis=1), repeated)
    lost = recorded(simulated(), Instruments(1, 0.02, dropped=0.01)).dataset.runs[0]
    assert len(lost.t) == len(lost.tau) < 4000
    assert np.diff(lost.t).max() > 1.5 / 500.0


@pytest.fixture(scope="module")
def clean() -> tuple[Judged, Case]:
    """A small clean campaign, cut to three runs, and its outcome."""
    index = index_of("clean_white", "smoke")
    case = make_case(SEED, index)
    small = replace(
        case,
        motions=case.motions[:3],
        held_out=case.motions[2].name,
        settings=replace(case.settings, rate=200.0),
        instruments=replace(case.instruments, epochs=()),
    )
    with pytest.MonkeyPatch.context() as patch:
        deck = replace(DECKS["campaigns"], make_case=lambda seed, index: small)
        patch.setattr(judging, "DECKS", {"campaigns": deck})
        return judge(SEED, index, "campaigns"), small


def test_a_case_from_its_making_to_its_score(clean: tuple[Judged, Case]) -> None:
    outcome = clean[0].outcome
    assert not outcome.error
    assert outcome.group in CLEAN
    assert verdict(outcome) == "ok"
    assert outcome.seconds["diagnose"] > 0
    # The floor is that of the noise: nothing is left of a robot that lacks nothing.
    assert set(outcome.rest) == set(clean[1].robot.robot.joint_names)
    assert all(0.7 < ratio < 1.5 for ratio in outcome.rest.values())


def test_a_rest_that_is_large_is_seen_by_the_truth(clean: tuple[Judged, Case]) -> None:
    judged, case = clean
    data = records_of(case)
    quiet = replace(data, noise={name: noise / 4 for name, noise in data.noise.items()})
    assert judged.diagnosis is not None
    loud = rests(case, quiet, judged.diagnosis)
    assert all(ratio > judging.LARGE for ratio in loud.values())


def test_the_true_robot_of_moved_centers_has_the_masses_of_the_urdf() -> None:
    case = make_case(SEED, index_of("clean_centers", "smoke"))
    (moved,) = case.hidden
    build = _Body(case, standard_parameters(case.robot.robot))
    moved.effect.build_into(build, moved.values, {})
    before = standard_parameters(case.robot.robot).reshape(-1, 10)
    after = build.phi.reshape(-1, 10)
    assert np.allclose(after[:, 0], before[:, 0])
    shift = after[:, 1:4] / after[:, :1] - before[:, 1:4] / before[:, :1]
    away = np.linalg.norm(shift, axis=1)
    assert away.min() > 0.019
    assert away.max() < 0.036


class _Body:
    """As much of a simulated robot as masses need."""

    def __init__(self, case: Case, phi: np.ndarray) -> None:
        self.robot, self.phi = case.robot.robot, phi.copy()


def outcome(index: int, group: str, **changes: object) -> Outcome:
    found = Outcome(
        index,
        group,
        planted=[{"words": "payload@j1", "ratio": np.nan}],
        right=True,
        before=0.1,
        after=0.01,
    )
    for name, value in changes.items():
        setattr(found, name, value)
    return found


def test_rates_count_what_went_wrong() -> None:
    size = {"kind": "payload", "parameter": "mass", "true": 1.0, "value": 2.0, "std": 0.1,
            "within": False, "first_order": False}  # fmt: skip
    false_name = {"kind": "spring", "joints": ["j1"], "runs": [], "covariate": "",
                  "judged": "wrong"}  # fmt: skip
    outcomes = [
        outcome(0, "payload"),
        outcome(1, "payload", right=False, wrong=True, named=[false_name], sizes=[size]),
        outcome(2, "contact", silent=["j1"], rest={"j1": 3.0}),
        outcome(3, "contact", worse=True),
        outcome(4, "contact", worse=True, admitted=True),
        outcome(5, "clean_white", planted=[], named=[false_name], wrong=True, alarm=True),
        outcome(6, "clean_white", planted=[]),
        outcome(8, "clean_white", planted=[], left=["j1"], alarm=True),
        outcome(7, "short_moves", refused=True, error="FileError: no"),
    ]
    counts = {rate.name: (rate.count, rate.out_of) for rate in rates(outcomes, "campaigns")}
    assert counts == {
        "right name or alias set": (4, 6),
        "wrong names": (3, 9),
        "large rest without a word": (2, 9),
        "false alarms on clean": (2, 3),
        "false refusals": (1, 9),
        "harmful, or error not lowered, and unsaid": (2, 9),
        "sizes within 2 sd": (0, 1),
        "of first-order effects": (0, 0),
    }
    words = [verdict(each) for each in outcomes]
    assert words == ["ok", "missed+WRONG", "ok+SILENT", "ok+WORSE", "ok+worse", "ALARM+WRONG", "ok",
                     "ALARM", "REFUSED"]  # fmt: skip
    told = "\n".join(failures(outcomes))
    assert "z 10.0" in told
    assert "no" in told
    assert len(groups(outcomes)) == 6
