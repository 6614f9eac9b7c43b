"""What is fitted and what is held out have no sample in common."""

from dataclasses import replace

import numpy as np
import pytest

from excite_cli.config.data_spec import FilterSpec
from excite_cli.errors import ConfigError
from excite_cli.identification.processing import choose_processing
from excite_cli.identification.split import split, with_ends_held_out
from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.measurement.run_identity import Part


def run(name: str, seconds: float, rate: float = 100.0, start: float = 0.0) -> Run:
    """Torque that counts the samples."""
    t = start + np.arange(0, seconds, 1 / rate)
    count = np.arange(len(t), dtype=float)[:, None]
    return Run(name, t, np.sin(count), count, dq=count, valid=count > 3, extra={"i": count})


def data(*runs: Run) -> Dataset:
    return Dataset(("a",), runs)


def numbers(runs: tuple[Run, ...]) -> list[int]:
    return [int(i) for each in runs for i in each.tau[:, 0]]


def test_the_last_run_is_held_out_or_the_one_that_is_named() -> None:
    runs = [run(name, 2.0) for name in ("one", "two", "three")]
    found = split(data(*runs))
    assert found.held_out_name == "three"
    assert [each.name for each in found.held_out] == ["three"]
    assert [each.name for each in found.training] == ["one", "two"]
    assert found.folds == (0, 1)
    named = split(data(*runs), "one")
    assert [each.name for each in named.held_out] == ["one"]
    assert [each.name for each in named.training] == ["two", "three"]


def test_names_are_never_taken_apart() -> None:
    """Names that look like those of parts are names like others."""
    names = ("take 6-12 s", "take (first half)", "take/2", "take")
    found = split(data(*(run(name, 5.0) for name in names)))
    assert found.units == names
    assert [found.unit(each.id) for each in found.training] == list(names[:3])
    (only,) = split(data(run("take 6-12 s", 20.0))).units
    assert only == "take 6-12 s"
    # An unknown run is named with the nearest.
    with pytest.raises(ConfigError) as error:
        split(data(run("slow", 2.0), run("payload", 2.0)), "paylod")
    text = str(error.value)
    assert "--held-out: there is no run 'paylod'. Did you mean 'payload'?" in text
    assert "Runs: slow, payload." in text
    with pytest.raises(ConfigError, match="no run 'b'"):
        split(data(run("motion_1", 20.0)), "b")


@pytest.mark.parametrize("seconds", [3.0, 5.0, 12.0, 17.3, 60.0, 200.0])
@pytest.mark.parametrize("block", [None, 0.9])
def test_blocks_of_a_single_run_share_nothing_and_lose_nothing(
    seconds: float, block: float | None
) -> None:
    whole = run("only", seconds)
    found = split(data(whole), block=block)
    training, held_out = numbers(found.training), numbers(found.held_out)
    assert not set(training) & set(held_out)
    assert sorted(training + held_out) == list(range(len(whole.t)))
    assert 0.2 <= len(held_out) / len(whole.t) < 0.45
    assert len(found.folds) == len(found.training)
    assert set(found.folds) == set(range(max(found.folds) + 1))
    for each in (*found.training, *found.held_out):  # stretches without a hole
        assert np.all(np.diff(each.tau[:, 0]) == 1)
        same = np.array_equal(each.extra["i"], each.tau)
        assert same
        assert each.valid is not None
        assert np.array_equal(each.valid, each.tau > 3)
        assert np.array_equal(each.t, whole.t[each.tau[:, 0].astype(int)])
    assert "only" in found.held_out_name
    assert str(len(found.held_out)) in found.held_out_name


@pytest.mark.parametrize(("seconds", "rate"), [(10.0, 10.0), (15.0, 10.0), (9.0, 25.0)])
def test_parts_of_a_slow_recording_are_long_enough_for_its_filters(
    seconds: float, rate: float
) -> None:
    parts = split(data(run("a", seconds, rate)))
    for part in (*parts.training, *parts.held_out):
        assert len(part.t) >= 32


def test_a_run_too_short_for_blocks_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"run 'only' lasts 1\.99 s: too short to hold out"):
        split(data(run("only", 2.0)))
    with pytest.raises(ConfigError, match="too short"):
        split(data(run("only", 10.0)), block=8.0)


def with_gap(name: str, *stretches: tuple[float, float]) -> list[Run]:
    """Stretches from … to [s] of a recording that began at 100 s."""
    whole = run(name, max(end for _, end in stretches), start=100.0)
    found = []
    for number, (start, end) in enumerate(stretches, 1):
        first, last = (round(100 * edge) for edge in (start, end))
        found.append(whole.cut(first, last, Part(number, 0, start, end)))
    return found


def test_a_recording_with_a_gap_is_held_out_and_left_out_as_one() -> None:
    b = with_gap("b", (0.0, 4.0), (4.3, 8.0))
    runs = data(run("a", 5.0), *b, run("c", 5.0))
    found = split(runs)
    assert [each.label for each in found.training] == ["a", "b/1", "b/2"]
    assert (found.folds, found.held_out_name, found.units) == ((0, 1, 1), "c", ("a", "b", "c"))
    assert [each.label for each in split(runs, "b").held_out] == ["b/1", "b/2"]
    stretch = split(runs, "b/2")
    assert [each.label for each in stretch.held_out] == ["b/2"]
    assert [each.label for each in stretch.training] == ["a", "b/1", "c"]
    # On the clock of the recording, so that a time within it means the same in all stretches.
    assert found.training[2].t[0] == pytest.approx(4.3)
    # Stretches of the only recording count as recordings.
    runs = data(*with_gap("only", (0.0, 4.0), (4.3, 8.0), (9.0, 12.0)))
    for held_out in (None, "only", "only/3"):
        found = split(runs, held_out)
        assert [each.label for each in found.held_out] == ["only/3"]
        assert (found.held_out_name, found.folds) == ("only/3", (0, 1))
        assert found.units == ("only/1", "only/2", "only/3")


def test_ends_of_some_runs_are_held_out_a_border_away_from_the_rest() -> None:
    runs = [run(name, 12.0) for name in ("one", "two", "three")]
    whole = split(data(*runs))
    how = choose_processing(whole.training, FilterSpec(border=0.25))
    found = with_ends_held_out(whole, {"two", "three"}, how)
    assert [each.name for each in found.training] == ["one", "two"]
    assert numbers(found.training[:1]) == list(range(1200))
    assert numbers(found.training[1:]) == list(range(775))
    assert [each.name for each in found.ends] == ["two"]
    assert numbers(found.ends) == list(range(800, 1200))
    assert found.ends[0].label == "two 8-11.99 s"
    assert (found.held_out, found.folds, found.units) == (whole.held_out, whole.folds, whole.units)


@pytest.mark.parametrize(("seconds", "held_out"), [(1.6, 0), (2.5, 100), (6.0, 200)])
def test_an_end_lasts_a_second_at_least_and_leaves_as_much(seconds: float, held_out: int) -> None:
    runs = [run("one", 9.0), run("two", seconds), run("three", 9.0)]
    whole = split(data(*runs))
    how = replace(choose_processing(whole.training, FilterSpec()), border=0.1, rate=50.0)
    found = with_ends_held_out(whole, {"two"}, how)
    assert len(numbers(found.ends)) == pytest.approx(held_out, abs=1)
    assert len(found.ends) == (held_out > 0)


def test_clocks_of_parts() -> None:
    """Of two runs the one that trains is halved; each keeps its instants, from its own start."""
    first = replace(run("one", 5.0, start=1e5), epoch=1.7e9)
    found = split(data(first, run("two", 4.0, start=2e5)))
    assert (found.folds, found.held_out_name) == ((0, 1), "two")
    assert numbers(found.training) == list(range(500))
    assert [each.t[0] for each in found.training] == pytest.approx([0.0, 2.5])
    assert found.held_out[0].t[0] == 0.0
    assert [each.epoch for each in found.training] == [1.7e9 + 1e5] * 2
    campaign = split(data(run("one", 3.0, start=7.0), run("two", 3.0), run("three", 3.0)))
    starts = [each.start for each in (*campaign.training, *campaign.held_out)]
    assert starts == pytest.approx([0.0, 2.99, 5.98])


def test_held_out_blocks_are_all_over_a_long_run_and_say_where_they_are() -> None:
    found = split(data(run("only", 60.0)))
    middles = [float(each.t.mean()) for each in found.held_out]
    assert len(middles) == 10
    assert np.diff(middles) == pytest.approx(6.0, abs=0.1)
    assert max(found.folds) == 3
    first = found.held_out[0]
    assert (first.part.start, first.part.end) == pytest.approx((first.t[0], first.t[-1]))
    assert first.label == f"only {first.t[0]:.4g}-{first.t[-1]:.4g} s"
    blocks = sorted(each.part.block for each in (*found.training, *found.held_out))
    assert blocks == sorted(set(blocks))
