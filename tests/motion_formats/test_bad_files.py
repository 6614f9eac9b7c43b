"""Motion files of others: what is taken, and one message for each way in which they may be bad."""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from excite_cli.errors import FileError
from excite_cli.motion_formats import joint_trajectory
from excite_cli.motion_formats.catalogue import motion_format_of, read_motion
from excite_cli.motion_formats.timed_motion import TimedMotion

POINT = "{positions: [1, 2.5], time_from_start: {sec: 0, nanosec: 0}}"
LATER = "{positions: [2, 1e-05], time_from_start: {sec: 1, nanosec: 500000000}}"
GOOD = f"joint_names: [a, b]\npoints: [{POINT}, {LATER}]\n"


def _file(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def _read(folder: Path, name: str, text: str, *joints: str) -> tuple[TimedMotion, str]:
    return read_motion(_file(folder, name, text), joints or ("a",))


def test_a_hand_made_table_is_a_motion_and_one_with_torques_is_not(tmp_path: Path) -> None:
    table = "t,q_b,q_a,note\n0,1,2,x\n0.5,3,4,y\n"
    motion, note = _read(tmp_path, "m.csv", table, "a", "b")
    assert motion.q.tolist() == [[2, 1], [4, 3]]
    assert (motion.v, motion.a, note) == (None, None, "")
    measured = _file(tmp_path, "d.csv", "t,q_a,tau_a\n0,1,2\n1,2,2\n")
    assert motion_format_of(measured) is None
    current = _file(tmp_path, "c.csv", "t,q_a,current_a\n0,1,2\n1,2,2\n")
    assert motion_format_of(current) is not None
    assert motion_format_of(current, ("current",)) is None


def test_joints_beyond_the_robots_are_named_and_numbers_go_by_order(tmp_path: Path) -> None:
    motion, note = _read(tmp_path, "m.csv", "t;q_a;q_grip\n0;1;9\n0.5;3;9\n")
    assert motion.q.ravel().tolist() == [1, 3]
    assert note == "joints that the robot does not move are left out: grip"
    table = "t,q10,q2,dq10,dq2\n0,1,2,0,0\n1,3,4,0,0\n"
    motion, note = _read(tmp_path, "n.csv", table, "a", "b")
    assert motion.q.tolist() == [[2, 1], [4, 3]]
    assert note.endswith("taken in the robot's order: 2 is a, 10 is b")


def test_yaml_and_json_of_a_message(tmp_path: Path) -> None:
    motion, _ = _read(tmp_path, "m.yaml", GOOD + "---\n", "b", "a")
    assert motion.q.tolist() == [[2.5, 1], [1e-5, 2]]
    assert (motion.t.tolist(), motion.v) == ([0, 1.5], None)
    points = [
        {"positions": [k], "velocities": [0], "time_from_start": {"secs": k, "nsecs": 1}}
        for k in range(3)
    ]
    text = json.dumps({"joint_trajectory": {"joint_names": ["a"], "points": points}})
    motion, _ = _read(tmp_path, "m.json", text)
    assert motion.t.tolist() == [1e-9, 1.000000001, 2.000000001]
    assert motion.v is not None


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("m.csv", "t,q_a\n0,1\n1,2\n0.5,3\n", "time does not increase: 0.5 s comes after 1 s"),
        ("m.csv", "t,q_a\n0,1\n0,2\n", "time does not increase"),
        ("m.csv", "t,q_a\n0,1\n1,\n2,3\n", "the position of 'a' at 1 s (instant 2) is missing"),
        ("m.csv", "t,q_a\n0,1\nnan,2\n2,3\n", "instant 2 of 3 is not a number"),
        ("m.csv", "t,q_a\n0,1\n", "1 instants of 1 joints; a motion needs at least two"),
        ("m.csv", "time,q_a\n0,1\n1,1\n", "has no column 't'; its columns: time, q_a"),
        ("m.csv", "t,x\n0,1\n1,1\n", "has no column 'q_<joint>'"),
        ("m.csv", "t,q_elbo\n0,1\n1,1\n", "does not move joint 'a'"),
        ("m.csv", "t,q_a,q_b,dq_a\n0,1,1,1\n1,1,1,1\n", "dq of a, but not of b"),
        ("m.yaml", "a: [1\n", "not valid YAML"),
        ("m.yaml", "robot: {urdf: x}\n", "holds no JointTrajectory"),
        ("m.yaml", "a: &x [1]\nb: *x\n", "aliases (*) are not allowed"),
        ("m.yaml", "a: !!python/object/apply:os.system [ls]\n", "line 1: tags"),
        ("m.yaml", "a: !!python/name:os.system x\n", "line 1: tags"),
        ("m.yaml", "[" * 40 + "]" * 40, "nested deeper than 30 levels"),
        ("m.yaml", "a: 1\na: 2\n", "line 2: key 'a' is given twice"),
        ("m.yaml", "[a]: 1\n", "a key must be a plain word"),
        ("m.yaml", "", "holds no JointTrajectory"),
        ("m.yaml", GOOD.replace("2.5", "x"), "positions are not all numbers"),
        ("m.yaml", GOOD.replace("[1, 2.5]", "[1]"), "point 1 does not have 2 positions"),
        ("m.yaml", GOOD.replace("sec: 1,", "sec: 1.5,"), "point 2 has no time_from_start"),
        ("m.yaml", GOOD.replace("2.5", ".nan"), "the position of 'b' at 0 s"),
        ("m.yaml", GOOD.replace("[a, b]", "[a, a]"), "joint 'a' twice"),
        ("m.yaml", GOOD.replace("[a, b]", "a"), "joint_names must be a list of names"),
        ("m.yaml", "joint_names: [a]\npoints: 3\n", "points must be a list"),
        ("m.yaml", "joint_names: [a]\npoints: []\n", "its points have no positions"),
        ("m.json", "{", "is not valid JSON"),
        ("m.json", "[" * 100_000, "is not valid JSON"),
        ("m.json", '{"joint_trajectory": 3}', "holds no JointTrajectory"),
        ("m.npz", "no archive", "is not a readable .npz file"),
        ("m.pkl", "x", "is of no format that holds motions"),
        ("m.mcap", "x", "is of no format that holds motions"),
    ],
)
def test_bad_files(tmp_path: Path, name: str, text: str, words: str) -> None:
    with pytest.raises(FileError) as caught:
        _read(tmp_path, name, text, *("a", "b") if "q_b" in text or "[a, b]" in text else ("a",))
    assert words in str(caught.value)
    assert str(tmp_path / name) in str(caught.value)


def test_files_that_are_not_there_or_too_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FileError, match="There is no file"):
        read_motion(tmp_path / "m.csv", ("a",))
    monkeypatch.setattr(joint_trajectory, "MAX_TEXT", 20)
    with pytest.raises(FileError, match="Take CSV or"):
        _read(tmp_path, "m.yaml", GOOD, "a", "b")


def _npz(path: Path, **arrays: object) -> Path:
    with path.open("wb") as file:
        np.savez(file, **{name: np.asarray(array) for name, array in arrays.items()})
    return path


def test_npz_archives(tmp_path: Path) -> None:
    good = {"t": [0, 1], "q": [[1.0], [2.0]], "joint_names": ["a"]}
    path = _npz(tmp_path / "m.npz", **good)
    assert read_motion(path, ("a",))[0].q.tolist() == [[1], [2]]
    bad: list[tuple[dict[str, object], str]] = [
        ({**good, "joint_names": np.array(["a"], dtype=object)}, "Pickles are never opened"),
        ({**good, "q": np.array([[None], [None]])}, "Pickles are never opened"),
        ({**good, "q": [1.0, 2.0]}, "'q' has shape"),
        ({**good, "v": [[1.0]]}, "'v' has shape"),
        ({"t": [0, 1], "q": [[1.0], [2.0]]}, "has no array 'joint_names'"),
    ]
    for arrays, words in bad:
        with pytest.raises(FileError, match=words):
            read_motion(_npz(tmp_path / "bad.npz", **arrays), ("a",))
    header = io.BytesIO()
    claim = {"descr": "<f8", "fortran_order": False, "shape": (10**13, 1)}
    np.lib.format.write_array_header_1_0(header, claim)
    big = tmp_path / "big.npz"  # it claims more than it holds
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(big, "w") as new:
        for name in old.namelist():
            new.writestr(name, header.getvalue() if name == "q.npy" else old.read(name))
    with pytest.raises(FileError, match="claims 10,000,000,000,000 values"):
        read_motion(big, ("a",))


def test_way_points_with_stops_are_no_contradiction(tmp_path: Path) -> None:
    """Speeds of zero at every way point: a program that stops there."""

    def with_speeds(most: int) -> TimedMotion:
        rows = "\n".join(f"{k},{k % 2},{most * (k % 2)}" for k in range(80))
        return _read(tmp_path, "m.csv", f"t,q_a,dq_a\n{rows}\n")[0]

    assert with_speeds(0).v is not None
    with pytest.raises(FileError, match="the speeds of 'a' are not those of its positions"):
        with_speeds(3)
