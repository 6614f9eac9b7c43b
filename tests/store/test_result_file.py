"""What is in a result file, and that it comes back as it was."""

import json
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excite_cli import __version__, atomic
from excite_cli.config.load_spec import load_spec, parse_spec
from excite_cli.criteria.base import condition_number, singular_values
from excite_cli.errors import FileError
from excite_cli.excitation.problem import build_problem
from excite_cli.excitation.result import matches
from excite_cli.robot.model import build_robot
from excite_cli.store import result_file
from excite_cli.store.result_file import read_result, write_result
from tests.excitation.smoke import planned, smoke
from tests.store.conftest import CONFIG, Stored


def assert_identical(first: Any, second: Any, where: str = "result") -> None:
    """Equal to the last bit, field by field."""
    assert type(first) is type(second), where
    if is_dataclass(first):
        for field in fields(first):
            name = f"{where}.{field.name}"
            assert_identical(getattr(first, field.name), getattr(second, field.name), name)
    elif isinstance(first, tuple):
        assert len(first) == len(second), where
        for index, (one, other) in enumerate(zip(first, second, strict=True)):
            assert_identical(one, other, f"{where}[{index}]")
    elif isinstance(first, dict):
        assert list(first) == list(second), where
        assert_identical(tuple(first.values()), tuple(second.values()), where)
    elif isinstance(first, np.ndarray):
        np.testing.assert_array_equal(first, second, err_msg=where, strict=True)
    else:
        assert first == second, where


def test_what_is_written_is_read_again(stored: Stored) -> None:
    assert len(stored.result.motions) == 2
    assert stored.result.motions[0].margins
    assert stored.result.random
    assert stored.result.checked_pairs
    assert_identical(read_result(stored.path), stored.result)


def test_a_result_without_motions_is_read_again(stored: Stored, tmp_path: Path) -> None:
    none = replace(stored.result, motions=(), random=(), priors=(), random_candidates=(0, 0))
    bare = replace(none, checked_pairs=(), dropped_pairs=())
    write_result(tmp_path / "bare.h5", bare, stored.problem)
    assert_identical(read_result(tmp_path / "bare.h5"), bare)


def test_more_than_nine_motions_keep_their_order(stored: Stored, tmp_path: Path) -> None:
    first = stored.result.motions[0]
    many = replace(
        stored.result,
        motions=tuple(replace(first, index=i, condition_number=float(i)) for i in range(1, 12)),
    )
    write_result(tmp_path / "many.h5", many, stored.problem)
    assert [m.index for m in read_result(tmp_path / "many.h5").motions] == list(range(1, 12))


def test_words_of_every_alphabet_survive(stored: Stored, tmp_path: Path) -> None:
    odd = replace(stored.result, priors=("früher.h5", "前.h5"), dropped_pairs=("a – b: größer",))
    write_result(tmp_path / "odd.h5", odd, stored.problem)
    assert_identical(read_result(tmp_path / "odd.h5"), odd)


def test_the_stored_config_is_the_problem(stored: Stored) -> None:
    result = read_result(stored.path)
    assert parse_spec(result.config) == stored.problem.spec
    assert matches(stored.problem, result) is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("robot.joints=[shoulder_pitch, elbow, wrist_roll, slide]", "another robot"),
        ("robot.gravity=[0, 0, -1.62]", "another robot"),
        ("robot.base_orientation=[1.57, 0, 0]", "another robot"),
        ("criterion.row_weights=effort", "row weights"),
        ("criterion.column_scaling=unit_norm", "column scaling"),
    ],
)
def test_a_result_belongs_to_its_own_problem_only(stored: Stored, change: str, words: str) -> None:
    spec = load_spec(CONFIG, [change, "constraints={}"])
    reason = matches(build_problem(spec, CONFIG.parent), read_result(stored.path))
    assert reason is not None
    assert words in reason


def test_a_robot_that_stands_differently_is_another_robot() -> None:
    """Gravity in the frame of the base decides the regressor, whichever way it is given."""
    prints = set()
    for tilt in (0.2, 0.4):
        for base in ("fixed", "floating"):
            change = [f"robot.base_orientation=[{tilt}, 0, 0]", f"robot.base={base}"]
            prints.add(build_robot(load_spec(CONFIG, change).robot, CONFIG.parent).fingerprint())
    assert len(prints) == 4


def test_root_attributes(stored: Stored) -> None:
    with h5py.File(stored.path, "r") as file:
        assert file.attrs["program"] == "excite"
        assert file.attrs["schema"] == result_file.SCHEMA
        assert file.attrs["seed"] == stored.problem.spec.seed
        assert file.attrs["robot_hash"] == stored.problem.robot.fingerprint()
        assert tuple(file.attrs["joint_names"]) == stored.problem.robot.joint_names
        assert parse_spec(file.attrs["config"]) == stored.problem.spec
        found = json.loads(file.attrs["versions"])
    assert found["excite-cli"] == __version__
    assert found["numpy"] == np.__version__
    assert found["h5py"] == h5py.__version__
    assert {"pin", "coal", "scipy"} <= set(found)
    assert "missing" not in found.values()


def test_motion_datasets_and_attributes(stored: Stored) -> None:
    problem = stored.problem
    times = len(problem.constraint_basis.times) + 1  # and the very end
    with h5py.File(stored.path, "r") as file:
        assert sorted(file["motions"]) == ["1", "2"]
        for motion in stored.result.motions:
            group = file[f"motions/{motion.index}"]
            assert set(group) == {"t", "q", "v", "a", "coefficients"}
            assert group["t"].shape == (times,)
            assert group["t"][-1] == problem.trajectory.duration
            for name in ("q", "v", "a"):
                assert group[name].shape == (times, problem.robot.n)
            assert group["coefficients"].shape == motion.coefficients.shape
            for name in ("condition_number", "stacked_condition_number", "status", "seconds"):
                assert group.attrs[name] == getattr(motion, name)
            margins = json.loads(group.attrs["margins"])
            assert set(margins) == {constraint.name for constraint in problem.constraints}
            for name, worst in motion.margins.items():
                assert margins[name]["margin"] == worst.margin


def test_states_in_the_file_follow_from_the_coefficients(stored: Stored) -> None:
    """q by Eq. 50 written out; v and a by differentiating the stored q and v as periodic."""
    spec = stored.problem.spec
    harmonics = spec.trajectory.harmonics  # type: ignore[union-attr]
    rate = spec.trajectory.base_frequency  # type: ignore[union-attr]
    with h5py.File(stored.path, "r") as file:
        for group in [*file["motions"].values(), *file["random"].values()]:
            t, q, v, a, c = (group[name][()] for name in ("t", "q", "v", "a", "coefficients"))
            expected = np.tile(c[-1], (len(t), 1))
            for k in range(1, harmonics + 1):
                expected += np.outer(np.sin(k * rate * t), c[k - 1])
                expected += np.outer(np.cos(k * rate * t), c[harmonics + k - 1])
            np.testing.assert_allclose(q, expected, atol=1e-12)
            np.testing.assert_allclose(v[:-1], periodic_derivative(q[:-1], t[:-1]), atol=1e-9)
            np.testing.assert_allclose(a[:-1], periodic_derivative(v[:-1], t[:-1]), atol=1e-9)
            for x in (q, v, a):
                np.testing.assert_allclose(x[-1], x[0], atol=1e-9)
            assert np.abs(v).max() > 0.1  # it moves


def periodic_derivative(x: Any, t: Any) -> Any:
    """Exact for a band-limited signal sampled evenly over one period."""
    step = t[1] - t[0]
    rates = 2j * np.pi * np.fft.rfftfreq(len(t), step)
    return np.fft.irfft(rates[:, None] * np.fft.rfft(x, axis=0), len(t), axis=0)


def test_tables_hold_the_numbers_of_the_motions(stored: Stored) -> None:
    with h5py.File(stored.path, "r") as file:
        for name, motions in (
            ("condition_number", stored.result.motions),
            ("random", stored.result.random),
        ):
            table = file[f"tables/{name}"]
            assert table.dtype.names == ("motion", "own", "stacked")
            assert [tuple(row) for row in table] == [
                (m.index, m.condition_number, m.stacked_condition_number) for m in motions
            ]


def test_the_stored_factor_is_that_of_all_motions(stored: Stored) -> None:
    objective = stored.problem.objective()
    with h5py.File(stored.path, "r") as file:
        factor = file["stack/R"][()]
        blocks = [
            objective.block(file[f"motions/{index}/coefficients"][()])
            for index in sorted(file["motions"], key=int)
        ]
        assert file["stack"].attrs["rows"] == sum(len(block) for block in blocks)
        stacked = file["tables/condition_number"]["stacked"][-1]
    rows = np.vstack(blocks)
    assert factor.shape == (stored.problem.base.rank, stored.problem.base.rank)
    np.testing.assert_allclose(
        factor.T @ factor, rows.T @ rows, atol=1e-12 * np.linalg.norm(rows) ** 2
    )
    assert condition_number(singular_values(factor)) == pytest.approx(stacked, rel=1e-9)


class Broken(Exception):
    pass


@pytest.mark.parametrize("failure", [OSError(28, "No space left"), Broken(), KeyboardInterrupt()])
@pytest.mark.parametrize("existing", [True, False])
def test_a_failing_write_leaves_nothing_half_done(
    stored: Stored,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    failure: BaseException,
    existing: bool,
) -> None:
    path = tmp_path / "result.h5"
    if existing:
        path.write_bytes(b"what was there before")

    def fail(motions: Any) -> Any:
        raise failure

    monkeypatch.setattr(result_file, "_table", fail)
    expected = FileError if isinstance(failure, OSError) else type(failure)
    with pytest.raises(expected) as caught:
        write_result(path, stored.result, stored.problem)
    if expected is FileError:
        assert str(path) in str(caught.value)
        assert "no space is left" in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == (["result.h5"] if existing else [])
    if existing:
        assert path.read_bytes() == b"what was there before"


def test_the_file_is_put_in_place_only_when_it_is_whole(
    stored: Stored, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    def look(temporary: Path, path: Path) -> None:
        assert not path.exists()
        assert temporary.parent == path.parent  # another disk could not be renamed to
        seen.append(read_result(temporary))
        raise OSError("the disk is gone")

    monkeypatch.setattr(atomic.os, "replace", look)
    with pytest.raises(FileError, match="the disk is gone"):
        write_result(tmp_path / "result.h5", stored.result, stored.problem)
    assert_identical(seen[0], stored.result)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_made_and_a_file_in_its_place_is_told(
    stored: Stored, tmp_path: Path
) -> None:
    write_result(tmp_path / "a" / "b" / "result.h5", stored.result, stored.problem)
    assert read_result(tmp_path / "a" / "b" / "result.h5").motions
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(FileError, match="cannot be written"):
        write_result(tmp_path / "file" / "result.h5", stored.result, stored.problem)


def test_others_may_read_the_file_as_any_other(stored: Stored, tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("", encoding="utf-8")
    write_result(tmp_path / "result.h5", stored.result, stored.problem)
    assert (tmp_path / "result.h5").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_what_belongs_to_motions_for_the_work_is_read_again(tmp_path: Path) -> None:
    problem = smoke("criterion.kind=predicted_torque", "optimizer.max_iterations=3")
    result = planned(problem)
    write_result(tmp_path / "work.h5", result, problem)
    again = read_result(tmp_path / "work.h5")
    assert result.stack.plain is not None
    assert np.array_equal(again.stack.plain, result.stack.plain)
    for one, other in zip(result.motions, again.motions, strict=True):
        assert one.predicted_deviation == other.predicted_deviation
        assert not other.doubt
    last = problem.objective().own_condition_number(result.motions[-1].coefficients)
    assert result.motions[-1].condition_number == pytest.approx(last)
