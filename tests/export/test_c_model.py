"""The C file says what the program says: every effect, many robots, both compilers, all bounds."""

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.effects.viscous_friction import ViscousFriction
from excite_cli.export.c_model import c_model
from excite_cli.export.c_text import filled
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.regression import Series
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.scoring.thresholds import Residual, Thresholds
from tests.docs.test_predict import PLANTED as ON_JOINTS
from tests.robot.coupled_robots import CLAW, HAND, coupled_robot
from tests.robot.random_robots import random_robot

PLANTED = (*ON_JOINTS, ("wrench_gain", tuple(range(6)), {}, [0.02]))
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)] or ["cc"]
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wcomment", "-Werror"]
UR10 = RobotSpec(urdf=str(Path(__file__).parents[2] / "data" / "ur10_cb" / "ur10.urdf"))


def compiled(
    text: str, folder: Path, compiler: str, *flags: str, level: str = "-O2"
) -> ctypes.CDLL:
    source, library = folder / "model.c", folder / f"model_{compiler}{len(flags)}.so"
    source.write_text(text, encoding="utf-8")
    part = library.with_suffix(".o")
    command = [compiler, *STRICT, level, *flags, "-fPIC", "-c", str(source), "-o", str(part)]
    subprocess.run(command, check=True)
    # Linked without -ffast-math: that would change how this whole process rounds small numbers.
    subprocess.run([compiler, "-shared", str(part), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def series_of(robot: Robot, count: int = 120, columns: Sequence[str] = ()) -> Series:
    rng = np.random.default_rng(5)
    t = 0.02 * np.arange(count)
    rates = rng.uniform(1.0, 4.0, robot.n)
    angle = np.outer(t, rates) + rng.uniform(0.0, 6.0, robot.n)
    q, v, a = np.sin(angle), rates * np.cos(angle), -(rates**2) * np.sin(angle)
    logged = {name: 25.0 + rng.uniform(0.0, 20.0, count) for name in columns}
    return Series(t, q, v, a, RunId("r"), 40.0, logged)


def by_c(library: ctypes.CDLL, series: Series, real: type = ctypes.c_double) -> Array:
    library.excite_work.restype = ctypes.c_size_t
    library.excite_work.argtypes = [ctypes.c_size_t]
    count, work = len(series.t), library.excite_work(len(series.t))
    dtype = np.dtype(real)

    def given(x: Array) -> tuple[np.ndarray, ctypes.c_void_p]:
        kept = np.ascontiguousarray(x, dtype=dtype)
        return kept, kept.ctypes.data_as(ctypes.c_void_p)

    columns = np.stack([*series.covariates.values()], axis=1) if series.covariates else np.zeros(1)
    held = [given(x) for x in (series.q, series.v, series.a, columns)]
    tau, room = given(np.zeros_like(series.q)), given(np.zeros(work))
    step, start = real(series.t[1] - series.t[0]), real(series.start)
    library.excite_series.restype = None
    library.excite_series.argtypes = [ctypes.c_size_t, real, real, *[ctypes.c_void_p] * 6]
    library.excite_series(count, step, start, *(p for _, p in held), tau[1], room[1])
    return np.array(tau[0], dtype=float)


def relative(x: Array, y: Array) -> float:
    return float(np.abs(x - y).max() / np.abs(y).max())


def planted(kinds: Sequence[str] | None = None) -> tuple[tuple[Effect, ...], Array]:
    rows = [row for row in PLANTED if kinds is None or row[0] in kinds]
    effects = []
    for name, joints, shape, _ in rows:
        kind = kind_named(name)
        effects.append(kind(joints, dict(shape), (), "temp" if kind.follows_covariate else ""))
    return tuple(effects), np.concatenate([np.asarray(row[3], dtype=float) for row in rows])


def of_ur10(kinds: Sequence[str] | None = None) -> tuple[Robot, IdentifiedModel]:
    robot = build_robot(UR10)
    return robot, IdentifiedModel(standard_parameters(robot), *planted(kinds))


def test_all_kinds_have_code() -> None:
    assert {row[0] for row in PLANTED} == set(catalogue())
    silent = {
        effect.kind
        for effect in planted()[0]
        if not (effect.carried or effect.in_c(np.ones(len(effect.parameters)), ("temp",)))
        and not effect.in_c_series(np.ones(len(effect.parameters)))
    }
    assert not silent


@pytest.mark.parametrize("compiler", COMPILERS)
def test_all_effects_at_once(compiler: str, tmp_path: Path) -> None:
    robot, model = of_ur10()
    series = series_of(robot, columns=("temp",))
    text = c_model(robot, model).text
    library = compiled(text, tmp_path, compiler)
    assert relative(by_c(library, series), model.predicted(robot, series).torque) < 1e-9
    library.excite_self_test.restype = ctypes.c_double
    assert library.excite_self_test() < 1e-9
    assert "excite_detector_begin" not in text, "without thresholds there is none"
    assert "@" not in text.replace("(at)", "")


@pytest.mark.parametrize("kind", sorted(catalogue()))
def test_every_effect_alone(kind: str, tmp_path: Path) -> None:
    robot, model = of_ur10([kind])
    series = series_of(robot, columns=("temp",) if model.effects[0].follows_covariate else ())
    rigid = IdentifiedModel(model.phi).predicted(robot, series).torque
    expected = model.predicted(robot, series).torque
    library = compiled(c_model(robot, model).text, tmp_path, COMPILERS[0], level="-O0")
    effect = np.abs(expected - rigid).max()
    assert effect > 0.0
    off = np.abs(by_c(library, series) - expected).max()
    assert off < 1e-9 * max(effect, np.abs(expected).max() * 1e-2)


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_with_sliding_joints(seed: int, tmp_path: Path) -> None:
    robot = random_robot(seed, joints=5)
    _assert_by_c(robot, next((j for j in range(robot.n) if robot.sliding[j]), 0), tmp_path)


@pytest.mark.parametrize("parts", [HAND, CLAW], ids=["hand", "claw"])
def test_joints_that_others_follow(parts: tuple, tmp_path: Path) -> None:
    _assert_by_c(coupled_robot(parts), 2, tmp_path)


def _assert_by_c(robot: Robot, j: int, tmp_path: Path) -> None:
    """Rigid bodies and their derivatives by a joint."""
    effects = (kind_named("encoder_offset")((j,)), kind_named("elasticity")((j,)))
    model = IdentifiedModel(standard_parameters(robot), effects, np.array([0.1, 1e-3]))
    series = series_of(robot)
    library = compiled(c_model(robot, model).text, tmp_path, COMPILERS[0])
    assert relative(by_c(library, series), model.predicted(robot, series).torque) < 1e-9


def test_single_precision(tmp_path: Path) -> None:
    robot, model = of_ur10(["viscous_friction", "spring", "dahl_friction", "payload"])
    series = series_of(robot)
    library = compiled(c_model(robot, model).text, tmp_path, COMPILERS[0], "-DEXCITE_FLOAT")
    found = by_c(library, series, ctypes.c_float)
    assert relative(found, model.predicted(robot, series).torque) < 1e-3


@pytest.mark.parametrize("compiler", COMPILERS)
def test_no_bound_is_broken(compiler: str, tmp_path: Path) -> None:
    robot, model = of_ur10()
    source, program = tmp_path / "model.c", tmp_path / "model"
    source.write_text(c_model(robot, model).text, encoding="utf-8")
    command = [compiler, *STRICT, "-g", "-O1", "-DEXCITE_MAIN", "-DEXCITE_CALLS=500"]
    command += [str(source), "-o", str(program), "-lm"]
    flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    built = subprocess.run([*command, *flags], capture_output=True, text=True)
    if "cannot find" in built.stderr:  # the compiler came without its sanitizers
        built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    ran = subprocess.run([str(program)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "us per call" in ran.stdout


def test_step_by_step_is_the_series_where_nothing_looks_ahead(tmp_path: Path) -> None:
    kinds = ["coulomb_friction", "dahl_friction", "friction_drift", "torque_gain"]
    robot, model = of_ur10(kinds)
    series = series_of(robot)
    library = compiled(c_model(robot, model).text, tmp_path, COMPILERS[0])
    memory = ctypes.create_string_buffer(8 * 20 * robot.n + 256)
    library.excite_begin.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
    library.excite_begin(memory, 0.02, series.start)
    found = np.zeros_like(series.q)
    for k in range(len(found)):
        states = [np.ascontiguousarray(x[k]) for x in (series.q, series.v, series.a)]
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in states]
        library.excite_torque(memory, *pointers, None, found[k].ctypes.data_as(ctypes.c_void_p))
    assert relative(found, model.predicted(robot, series).torque) < 1e-9


class Unknown(ViscousFriction):
    """A kind of somebody who wrote no C."""

    kind: ClassVar = "unknown"

    def in_c(self, values: Array, columns: Sequence[str]) -> str:
        return ""


def test_effects_of_single_recordings_are_left_out_and_told() -> None:
    robot = build_robot(UR10)
    payload, unknown = kind_named("payload")((5,), {}, ("run_3",)), Unknown((2,))
    values = np.append(np.ones(10), 1.0)
    found = c_model(robot, IdentifiedModel(standard_parameters(robot), (payload, unknown), values))
    assert "only some recordings had them: payload at wrist_3_joint" in found.notes[0]
    assert "C has no code for: unknown at elbow_joint" in found.notes[1]


def thresholds(robot: Robot) -> Thresholds:
    rng = np.random.default_rng(3)
    rows = rng.uniform(0.01, 1.0, (robot.n, 4))
    return Thresholds(robot.joint_names, rows, rng.uniform(3.0, 9.0, robot.n), 2.0, 0.03)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_detector_says_what_the_thresholds_say(compiler: str, tmp_path: Path) -> None:
    """On a series that its own test does not know."""
    robot = build_robot(UR10)
    given, model = thresholds(robot), IdentifiedModel(standard_parameters(robot))
    library = compiled(c_model(robot, model, thresholds=given).text, tmp_path, compiler)
    library.excite_detector_self_test.restype = ctypes.c_double
    assert library.excite_detector_self_test() < 1e-12
    rng, step = np.random.default_rng(8), 0.004
    residual = 0.5 * np.cumsum(rng.normal(0.0, 0.4, (300, robot.n)), axis=0)
    speed, load = rng.normal(0.0, 0.1, (2, 300, robot.n))
    expected = given.beyond(Residual(residual, speed, load, step))
    state = (ctypes.c_double * (2 * robot.n + 2))()
    library.excite_detector_begin(state, ctypes.c_double(step))
    beyond = np.zeros(robot.n)
    for k in range(300):
        rows = [np.ascontiguousarray(x[k]) for x in (residual, speed, load)]
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (*rows, beyond)]
        said = library.excite_detect(state, *pointers)
        assert np.abs(beyond) == pytest.approx(expected[k], rel=1e-12)
        assert said == int((expected[k] > 1.0).any())
    spoken = (expected > 1.0).any(axis=1).mean()
    assert 0.05 < spoken < 0.95


def test_what_is_put_in_is_not_filled_again() -> None:
    gaps = {"ROBOT": "the @N@ of @ROBOT@", "N": "@M@", "M": r"\1 \g<0>"}
    assert filled("@ROBOT@, @N@, @M@ @X@ @", gaps) == r"the @N@ of @ROBOT@, @M@, \1 \g<0> @X@ @"
