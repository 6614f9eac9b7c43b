"""Tables as other programs write them, MATLAB's files, and recorders that are known by name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.measurement.dataset import Array, Run
from tests.measurement import recordings
from tests.measurement.recordings import refused

JOINTS = ("base", "elbow")
T = np.arange(400) * 0.01
Q = np.column_stack([0.8 * np.sin(2 * T), 0.5 * np.cos(3 * T)])
TAU = np.column_stack([9.0 * np.cos(2 * T) + 1.0, 3.0 * np.sin(3 * T)])


def read(path: Path, **declared: Any) -> Run:
    (run,) = recordings.read(path, *JOINTS, **declared).runs
    return run


def assert_same(run: Run) -> None:
    for one, other in zip((run.t - run.t[0], run.q, run.tau), (T, Q, TAU), strict=True):
        np.testing.assert_allclose(one, other, atol=2e-6)


def table(header: list[str], *columns: Array, separator: str = ",", comma: bool = False) -> str:
    rows = [
        separator.join(f"{x:.15g}".replace(".", ",") if comma else f"{x:.15g}" for x in row)
        for row in np.column_stack(columns)
    ]
    return "\n".join([separator.join(header), *rows]) + "\n"


PLAIN = ["t", *(f"q_{j}" for j in JOINTS), *(f"tau_{j}" for j in JOINTS)]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "log.csv"


@pytest.mark.parametrize("encoding", ["utf-16", "cp1252", "utf-8-sig"])
def test_spreadsheets(log: Path, encoding: str) -> None:
    """`sep=;`, decimal commas, the encodings of spreadsheets, a unit with a degree sign."""
    header = ["t", "q_base [°]", "q_elbow [°]", "tau_base [mNm]", "tau_elbow [mNm]"]
    text = table(header, T, np.degrees(Q), 1e3 * TAU, separator=";", comma=True)
    log.write_text("sep=;\n" + text, encoding=encoding)
    assert_same(read(log))


def test_dates(log: Path) -> None:
    stamps = np.datetime64("2026-11-28T08:00:00.000000") + (T * 1e6).astype("timedelta64[us]")
    head, *rows = table(PLAIN, T, Q, TAU).splitlines()
    dated = [f"{at},{row.partition(',')[2]}" for at, row in zip(stamps, rows, strict=True)]
    log.write_text("\n".join([head, *dated]), encoding="utf-8")
    assert_same(read(log))


def test_rostopic_echo(log: Path) -> None:
    fields = [f"field.{w}{i}" for w in ("position", "velocity", "effort") for i in (0, 1)]
    header = ["%time", "field.header.seq", "field.header.stamp", "field.name0", "field.name1"]
    lines = [",".join([*header, *fields])]
    for k, (q, tau) in enumerate(zip(Q, TAU, strict=True)):
        stamp = 1_750_000_000_000_000_000 + round(T[k] * 1e9)
        values = ",".join(f"{x:.9g}" for x in (*q[::-1], 0.0, 0.0, *tau[::-1]))
        lines.append(f"{stamp + 9},{k},{stamp},elbow,base,{values}")
    log.write_text("\n".join(lines), encoding="utf-8")
    assert_same(read(log, channels={"dq": None}))


def test_plotjuggler(log: Path) -> None:
    names = [f"/joint_states/{j}/{w}" for w in ("position", "effort") for j in JOINTS]
    log.write_text(table(["__time", *names], T + 1.7e9, Q, TAU))
    assert_same(read(log))


def of_libfranka(space: str) -> str:
    """As `franka::logToCSV` writes it: whole ms, six digits, and what it commanded beside."""
    states = ("q", "q_d", "dq", "dq_d", "tau_J", "tau_ext_hat_filtered")
    commands = {"q_d": 2, "dq_d": 2, "O_T_EE_d": 16, "O_dP_EE_d": 6, "tau_J_d": 2}
    sizes = {f"state.{name}": 2 for name in states} | {f"cmd.{k}": n for k, n in commands.items()}
    groups = [f",{space}".join(f"{k}[{i}]" for i in range(n)) for k, n in sizes.items()]
    lines = [f"time,{space}success_rate,{space}{','.join(groups)}"]
    other, speed, sent = np.full_like(Q, 7.0), np.gradient(Q, T, axis=0), np.full((len(T), 28), 9.0)
    for t, row in zip(T, np.hstack([Q, other, speed, other, TAU, other, sent]), strict=True):
        lines.append(f"{50_000 + round(1e3 * t)},1,{','.join(f'{x:.6g}' for x in row)}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("space", [" ", ""])  # its older heads, and its newer ones
@pytest.mark.parametrize("declared", [{}, {"preset": "franka"}])
def test_libfranka(log: Path, declared: dict[str, str], space: str) -> None:
    log.write_text(of_libfranka(space), encoding="utf-8")
    run = read(log, **declared)
    for one, other in zip((run.t - run.t[0], run.q, run.tau), (T, Q, TAU), strict=True):
        np.testing.assert_allclose(one, other, rtol=5e-6, atol=1e-12)
    np.testing.assert_allclose(read(log, channels={"tau": "cmd.tau_J_d"}).tau, 9.0)


def save_7_3(path: Path, held: dict[str, Any]) -> None:
    """As MATLAB's `save(…, '-v7.3')`: after a header of 512 bytes, HDF5 of transposed arrays."""

    def put(group: Any, name: str, kind: str, values: Any) -> Any:
        group[name] = values
        group[name].attrs["MATLAB_class"] = np.bytes_(kind)
        return group[name]

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in held.items():
            where = file
            for part in name.split(".")[:-1]:
                where = where.require_group(part)
                where.attrs["MATLAB_class"] = np.bytes_("struct")
            name = name.split(".")[-1]
            if isinstance(values, np.ndarray):
                put(where, name, "double", np.atleast_2d(values).T)
            elif isinstance(values, str):
                put(where, name, "char", np.array([[ord(c)] for c in values], "u2"))
            else:
                cells = [np.array([[ord(c)] for c in text], "u2") for text in values]
                refs = [put(file, f"#refs#/{k}", "char", text).ref for k, text in enumerate(cells)]
                put(where, name, "cell", np.array([refs], h5py.ref_dtype))
        put(file, "nothing", "double", np.zeros(2, "u8")).attrs["MATLAB_empty"] = np.uint8(1)
    header = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\0\x02IM"
    path.write_bytes(header.ljust(512, b"\0") + path.read_bytes()[512:])


VERSIONS = pytest.mark.parametrize("save", [savemat, save_7_3])
HELD = {"t": T, "q": Q, "tau": TAU}


@VERSIONS
@pytest.mark.parametrize("rows", [True, False])
def test_matlab(tmp_path: Path, save: Callable[..., None], rows: bool) -> None:
    turned = (lambda x: x) if rows else np.transpose
    names: Any = JOINTS[::-1] if save is save_7_3 else np.array(JOINTS[::-1], dtype=object)
    held = {"t": T, "q": turned(Q[:, ::-1]), "tau": turned(TAU[:, ::-1]), "note": "warm"}
    save(tmp_path / "log.mat", {**held, "joint_names": names})
    assert_same(read(tmp_path / "log.mat"))


@VERSIONS
def test_a_struct_of_matlab(tmp_path: Path, save: Callable[..., None]) -> None:
    path = tmp_path / "log.mat"
    inside = {f"log.{name}": values for name, values in HELD.items()}
    save(path, inside if save is save_7_3 else {"log": HELD})
    refused(path, "no variable 'q'; its variables: log.", *inside)
    assert_same(read(path, channels={name: f"log.{name}" for name in HELD}))


def test_a_wrong_file_of_matlab_7_3_gets_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    save_7_3(path, HELD)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    refused(path, "not a readable MATLAB file of version 7.3")
    save_7_3(path, {"t": T, "pos": Q})
    with h5py.File(path, "a") as file:  # a timeseries
        file["q"] = np.array([[0xDD000000, 2, 1, 1, 1, 1]], "u4")
        file["q"].attrs["MATLAB_object_decode"] = np.int32(3)
    refused(path, "no variable 'q'; ", ": pos, t.", " Time and Data")
    save_7_3(path, {**HELD, "joint_names": list(JOINTS)})
    with h5py.File(path, "a") as file:  # a cell leads nowhere outside
        del file["#refs#/0"]
        where = [("/etc/passwd", 0, 8)]
        file.create_dataset("#refs#/0", (4, 1), "u2", external=where)
        refs = [file["#refs#/0"].ref, file["#refs#/1"].ref]
        file["joint_names"][...] = np.array([refs], h5py.ref_dtype)
    refused(path, "only data in the file itself")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("log.mat", b"no such thing", "is no readable MATLAB file"),
        ("log.csv", b"t,q_base\n\0\x81\xfe\n", "log.csv"),
    ],
)
def test_a_wrong_file_gets_one_sentence(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    (tmp_path / name).write_bytes(content)
    refused(tmp_path / name, words)
    savemat(tmp_path / "other.mat", {"t": T, "pos": Q})
    refused(tmp_path / "other.mat", "has no variable 'q'; its variables: t, pos")


RECORDERS: dict[str, tuple[dict[str, Any], list[str], float, float, float]] = {
    # further keys; header; units of time, position and torque in the file
    "ur_rtde": (
        {"torque_constant": 2.0},
        ["timestamp", "actual_q_0", "actual_q_1", "actual_current_0", "actual_current_1"],
        1.0, 1.0, 0.5,
    ),
    "ur_ros2": ({"torque_constant": 2.0}, PLAIN, 1.0, 1.0, 0.5),
    "franka": ({}, ["t", "q[0]", "q[1]", "tau_J[0]", "tau_J[1]"], 1.0, 1.0, 1.0),
    "kuka_rsi": (
        {"torque_constant": 4.0},
        ["IPOC", "AIPos_1", "AIPos_2", "MACur_1", "MACur_2"],
        1e3, 180 / np.pi, 0.25,
    ),
    "unitree": ({}, ["t", "q_base", "q_elbow", "tau_est_base", "tau_est_elbow"], 1.0, 1.0, 1.0),
    "dynamixel": (
        {"torque_constant": 1.5},
        ["t", *(f"present_position_{j}" for j in JOINTS),
         *(f"present_current_{j}" for j in JOINTS)],
        1.0, 4096 / (2 * np.pi), 1 / (1.5 * 2.69e-3),
    ),
}  # fmt: skip


@pytest.mark.parametrize("preset", RECORDERS)
def test_presets(log: Path, preset: str) -> None:
    more, header, time, angle, torque = RECORDERS[preset]
    log.write_text(table(header, time * T, angle * Q, torque * TAU))
    assert_same(read(log, preset=preset, **more))


def test_what_the_config_says_itself_goes_before_a_preset() -> None:
    spec = MeasurementSpec(preset="franka", torque="motor", channels={"q": "pos"})
    assert (spec.torque, spec.channels) == ("motor", {"tau": "tau_J", "q": "pos"})
