"""The C file's standard deviation is the program's: every effect, many robots, unknown joints."""

import ctypes
import re
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from excite_cli.api.model import Model
from excite_cli.config.load_spec import load_spec
from excite_cli.config.spec import Spec
from excite_cli.dynamics.base_parameters import find_base_parameters
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.export.c_model import c_model
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.stored_model import StoredModel
from excite_cli.identification.torque_trace import TorqueTrace
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.scoring.validity import Trust
from tests.cli.program import ROOT
from tests.export.test_c_model import COMPILERS, STRICT, compiled, of_ur10
from tests.robot.coupled_robots import HAND, coupled_robot
from tests.robot.random_robots import random_robot

KINDS = sorted(name for name, kind in catalogue().items() if not kind.follows_covariate)


def stored(robot: Robot, model: IdentifiedModel) -> StoredModel:
    """Residuals of known size on 300 states, and an information that is none in particular."""
    rng, n = np.random.default_rng(4), robot.n
    q, v, a = robot.draw_states(300, seed=2)
    t = 0.01 * np.arange(300)
    load = RigidBody(robot, model.phi, q, v, a).load
    left = (0.1 + 0.2 * np.abs(v)) * rng.normal(size=(300, n))
    every = np.ones((300, n), dtype=bool)
    told = load + 2.0 * np.sign(v) + 0.5 * v
    trace = TorqueTrace("run", False, t, q, v, a, load, told + left, every, told)
    size = find_base_parameters(robot).rank + len(model.values)
    factor = np.triu(rng.normal(size=(size, size))) + 20.0 * np.eye(size)
    return StoredModel(
        Path("fit.h5"), "fit", Spec.model_construct(), Path(), robot, model,
        traces=(trace,), factor=factor,
    )  # fmt: skip


def by_c(library: ctypes.CDLL, name: str, *rows: Sequence[Array], back: int = 0) -> Array:
    """What a function of plain arrays answers to each row of states; `back` is its status."""
    found = np.zeros((len(rows[0]), len(rows[0][0])))
    for k, states in enumerate(zip(*rows, strict=True)):
        given = [np.ascontiguousarray(x, dtype=float) for x in states]
        pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (*given, found[k])]
        assert getattr(library, name)(*pointers) == back
    return found


def assert_std(made: StoredModel, folder: Path) -> None:
    text = c_model(made.robot, made.model, trust=Trust(made)).text
    library = compiled(text, folder, COMPILERS[0])
    states = made.robot.draw_states(40, seed=9)
    states[1][:10] = 0.0  # joints that stand
    states[1][5:10, 0] = 0.021  # or just move
    model = Model(made)
    expected = [model.torque(*(x[None] for x in each), np.zeros(1), std=True) for each in
                zip(*states, strict=True)]  # fmt: skip
    torque, std = np.concatenate(expected, axis=1)
    assert by_c(library, "excite_std", *states) == pytest.approx(std, rel=1e-9, abs=0)
    assert by_c(library, "excite_state", *states) == pytest.approx(torque, rel=1e-9, abs=1e-9)
    library.excite_std_self_test.restype = ctypes.c_double
    assert library.excite_std_self_test() < 1e-9


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """Compiled without regard for what is not finite."""
    made = stored(*of_ur10(["load_dependent_friction", "spring"]))
    text = c_model(made.robot, made.model, trust=Trust(made)).text
    return compiled(text, tmp_path_factory.mktemp("c"), COMPILERS[0], "-ffast-math", level="-O3")


def test_all_effects_at_once(tmp_path: Path) -> None:
    assert_std(stored(*of_ur10(KINDS)), tmp_path)


@pytest.mark.parametrize("seed", range(4))
def test_random_trees_with_sliding_joints(seed: int, tmp_path: Path) -> None:
    robot = random_robot(seed, joints=5)
    effects = (kind_named("encoder_offset")((1,)), kind_named("viscous_friction")((3,)))
    model = IdentifiedModel(standard_parameters(robot), effects, np.array([0.1, 2.0]))
    assert_std(stored(robot, model), tmp_path)


def test_joints_that_others_follow(tmp_path: Path) -> None:
    robot = coupled_robot(HAND)
    assert_std(stored(robot, IdentifiedModel(standard_parameters(robot))), tmp_path)


def test_a_base_that_stands_still_adds_nothing(tmp_path: Path) -> None:
    robot = build_robot(load_spec(ROOT / "configs" / "talos_base.yaml").robot)
    payload = kind_named("payload")((robot.n - 1,))
    model = IdentifiedModel(standard_parameters(robot), (payload,), np.ones(10))
    assert_std(stored(robot, model), tmp_path)


def test_angles_that_are_right_but_for_their_decimals(tmp_path: Path) -> None:
    robot, model = of_ur10(["spring", "payload"])
    tilted = robot.model.copy()
    place = tilted.jointPlacements[1]
    turned = place.rotation @ pin.utils.rotate("x", 1e-3)
    tilted.jointPlacements[1] = pin.SE3(turned, place.translation)
    robot = replace(robot, model=tilted)
    assert find_base_parameters(robot).tilted
    assert_std(stored(robot, model), tmp_path)


def test_of_a_model_that_follows_a_column(tmp_path: Path) -> None:
    made = stored(*of_ur10(["viscous_friction"]))
    warm = kind_named("covariate_offset")((1,), {"reference": 25.0}, covariate="temp")
    made = replace(made, model=IdentifiedModel(made.model.phi, (warm,), np.array([0.3])))
    library = compiled(
        c_model(made.robot, made.model, trust=Trust(made)).text, tmp_path, COMPILERS[0]
    )
    states, temp = made.robot.draw_states(20, seed=9), np.linspace(20.0, 60.0, 20)[:, None]
    model = Model(made)
    expected = [
        model.torque(*(x[None] for x in each[:3]), np.zeros(1), {"temp": each[3]}, std=True)[1][0]
        for each in zip(*states, temp, strict=True)
    ]
    assert by_c(library, "excite_std", *states, temp) == pytest.approx(np.array(expected), rel=1e-9)


def test_a_payload_of_single_recordings_adds_nothing(tmp_path: Path) -> None:
    robot, model = of_ur10(["payload", "spring"])
    effects = (replace(model.effects[0], runs=("run_7",)), *model.effects[1:])
    assert_std(stored(robot, replace(model, effects=effects)), tmp_path)


def test_of_an_unknown_joint_it_is_nan_and_says_so(tmp_path: Path) -> None:
    made = stored(*of_ur10(["spring"]))
    trace = made.traces[0]
    measured = np.where(np.arange(6) == 2, np.nan, trace.measured)
    made = replace(made, traces=(replace(trace, measured=measured),))
    text = c_model(made.robot, made.model, trust=Trust(made)).text
    library = compiled(text, tmp_path, COMPILERS[0], "-ffast-math", level="-O3")
    states = made.robot.draw_states(5, seed=9)
    found = by_c(library, "excite_std", *states, back=1)
    assert np.isnan(found).tolist() == [[j == 2 for j in range(6)]] * 5
    library.excite_std_self_test.restype = ctypes.c_double
    assert library.excite_std_self_test() < 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e308])
def test_what_is_not_finite_has_none(bad: float, fast: ctypes.CDLL) -> None:
    for name, k in product(("excite_std", "excite_state", "excite_friction"), range(18)):
        x = np.ones((3, 1, 6))
        x.reshape(-1)[k] = bad
        assert np.isnan(by_c(fast, name, *x, back=1)).all()
        assert np.isfinite(by_c(fast, name, *np.ones((3, 1, 6)))).all()


def test_without_a_covariance_it_is_of_the_residual_alone(tmp_path: Path) -> None:
    made = replace(stored(*of_ur10(["spring"])), factor=None)
    assert_std(made, tmp_path)
    text = c_model(made.robot, made.model, trust=Trust(made)).text
    assert "here 0: their covariance is not known" in text


class Unknown(Effect):
    """A kind of somebody who wrote no C."""

    kind, title, signature, parameters = "unknown", "", "", kind_named("armature").parameters

    def columns(self, signals: object) -> Array:
        return np.ones((300, 1, 1))


def test_a_model_that_does_not_know_it_has_none(tmp_path: Path) -> None:
    robot, model = of_ur10(["spring"])
    found = c_model(robot, model).text
    assert "not in this file, as the model does not say what it left of its own data" in found
    assert not re.search(r"^int excite_std", found, re.MULTILINE)
    other = replace(model, effects=(Unknown((0,)),), values=np.ones(1))
    made = replace(stored(robot, model), model=other, factor=None)
    found = c_model(robot, other, trust=Trust(made)).text
    assert "not in this file, as C has no code for some effect" in found
    assert "int excite_std" not in found


@pytest.mark.parametrize("flags", [["-DEXCITE_FLOAT"], ["-g", "-fsanitize=address,undefined"]])
def test_the_file_tests_itself_and_tells_the_time(flags: list[str], tmp_path: Path) -> None:
    made = stored(*of_ur10(["viscous_friction", "coulomb_friction", "payload"]))
    text = c_model(made.robot, made.model, trust=Trust(made)).text
    source, program = tmp_path / "model.c", tmp_path / "model"

    def run(text: str) -> subprocess.CompletedProcess[str]:
        source.write_text(text, encoding="utf-8")
        command = [COMPILERS[0], *STRICT, "-DEXCITE_MAIN", "-DEXCITE_CALLS=500", str(source)]
        built = subprocess.run([*command, "-o", str(program), "-lm", *flags], capture_output=True)
        if b"cannot find" in built.stderr:  # the compiler came without its sanitizers
            subprocess.run([*command, "-o", str(program), "-lm"], check=True)
        return subprocess.run([str(program)], capture_output=True, text=True)

    ran = run(text)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert re.search(r"standard deviation: \d+\.\d+ us per call", ran.stdout)
    assert run(re.sub(r"(ROOT\[[^{]*{\s*R\()", r"\g<1>100*", text)).returncode == 1
