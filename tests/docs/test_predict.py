"""The script of docs/how-to/predict.md says what the program says, for every effect there is.

A log of a UR10 with all effects of the catalogue at once, all of them declared. The script knows
the JSON, the URDF and the log; the program's own figures are the errors that it must come to.
"""

import contextlib
import io
import json
import re
import runpy
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml

from excite_cli.config.load_spec import load_spec
from excite_cli.dynamics.regressor import standard_parameters
from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect
from excite_cli.effects.catalogue import catalogue, kind_named
from excite_cli.effects.signals import Signals
from excite_cli.identification.regression import effect_columns, with_effects
from excite_cli.measurement.run_identity import RunId
from excite_cli.robot.model import Array, Robot, build_robot
from excite_cli.trajectory.fourier import FourierTrajectory
from tests.cli.program import ROOT, Program

URDF = ROOT / "data" / "ur10_cb" / "ur10.urdf"
PAGE = ROOT / "docs" / "how-to" / "predict.md"
PAN, LIFT, ELBOW, WRIST_1, WRIST_2, WRIST_3 = range(6)
DECLARED = URDF.parent / "ur10_cb.yaml"
SECONDS, RATE, RUNS, PAUSE = 6.0, 200.0, 3, 100.0
HELD_OUT = f"run_{RUNS}"
LOADED = "run_1", HELD_OUT
OF_ALL = tuple(range(6))

# Joints, shape, and values of every kind.
PLANTED: Sequence[tuple[str, tuple[int, ...], Mapping[str, float], Sequence[float]]] = (
    ("viscous_friction", (ELBOW,), {}, [6.0]),
    ("nonlinear_viscous_friction", (PAN,), {"power": 2.0}, [6.0]),
    ("coulomb_friction", (ELBOW,), {}, [5.0]),
    ("asymmetric_friction", (WRIST_3,), {}, [1.0, 2.5]),
    ("stribeck_friction", (PAN,), {"stribeck_speed": 0.4}, [8.0]),
    ("stribeck_friction", (ELBOW,), {"stribeck_speed": 0.3, "load_power": 1.0}, [0.1]),
    ("load_dependent_friction", (LIFT,), {}, [0.2]),
    ("gear_loss", (WRIST_1,), {}, [0.2, 0.1]),
    ("position_friction", (WRIST_1,), {"periods": 2.0, "power": 1.0}, [1.5, 1.0]),
    ("dahl_friction", (WRIST_2,), {"distance": 0.05}, [2.0]),
    ("dahl_friction", (LIFT,), {"distance": 0.04, "damping": 0.8}, [4.0]),
    ("friction_drift", (PAN,), {}, [-0.8, 0.6]),
    ("friction_change", (ELBOW,), {"time_constant": 150.0, "span": 300.0}, [-6.0, 3.0]),
    ("covariate_friction", (LIFT,), {"reference": 30.0, "curvature": 0.02}, [2.0, -1.0]),
    ("coupled_friction", (WRIST_2, WRIST_3), {"direction": -1.0}, [1.5, 1.5]),
    ("armature", (ELBOW,), {}, [2.0]),
    ("coupled_armature", (WRIST_1, WRIST_2), {}, [-0.4]),
    ("spring", (WRIST_1,), {}, [5.0, 3.0]),
    ("ripple", (WRIST_2,), {"periods": 8.0}, [1.0, -0.5]),
    ("cable_force", (WRIST_1, WRIST_2), {}, [2.0, 1.0, 1.5]),
    ("elasticity", (LIFT,), {}, [4e-4]),
    ("backlash", (WRIST_1,), {"gap": 0.03}, [1.0]),
    ("base_tilt", OF_ALL, {}, [0.05, -0.07]),
    ("payload", (WRIST_3,), {}, [3.0, 0.1, -0.1, 0.3, 0.05, 0.0, 0.05, 0.0, 0.01, 0.04]),
    ("encoder_offset", (ELBOW,), {}, [0.1]),
    ("contact", OF_ALL, {"start": 2.0, "end": 3.5}, [15.0, -20.0, 10.0]),
    ("torque_offset", (PAN,), {}, [6.0]),
    ("covariate_offset", (WRIST_1,), {"reference": 30.0}, [0.15]),
    ("torque_gain", (WRIST_2,), {}, [0.2]),
    ("torque_crosstalk", (PAN, ELBOW), {}, [0.05]),
    ("torque_delay", OF_ALL, {}, [0.01]),
    ("torque_saturation", (LIFT,), {"level": 80.0}, [1.0]),
)  # fmt: skip


def effects() -> list[Effect]:
    """As planted, and as declared."""
    return [
        kind_named(name)(
            joints,
            shape,
            LOADED if name in ("payload", "contact") else (),
            "temp" if catalogue()[name].follows_covariate else "",
        )
        for name, joints, shape, _ in PLANTED
    ]


def the_robot() -> Robot:
    return build_robot(load_spec(DECLARED).robot, DECLARED.parent)


def write_log(robot: Robot, path: Path) -> None:
    """Runs with the torque of all effects, and a little noise."""
    rng = np.random.default_rng(3)
    values = np.concatenate([values for *_, values in PLANTED])
    t = np.arange(int(SECONDS * RATE)) / RATE
    with h5py.File(path, "w") as file:
        file.attrs["joint_names"] = list(robot.joint_names)
        for k in range(RUNS):
            motion = FourierTrajectory(4, 2 * np.pi / SECONDS)
            coefficients = rng.normal(size=(motion.n_coefficients, robot.n)) * 0.25
            q, v, a = motion.basis(t).states(coefficients)
            body = RigidBody(robot, standard_parameters(robot), q, v, a)
            temp = 25.0 + 10.0 * k + t
            seen = Signals(
                t, q, v, a, body.load, body.load, body, RunId(f"run_{k + 1}"), k * PAUSE,
                {"temp": temp},
            )  # fmt: skip
            columns = effect_columns(effects(), with_effects(seen, effects(), values))
            tau: Array = body.load + columns @ values
            tau += 0.01 * tau.std(axis=0) * rng.normal(size=tau.shape)
            run = file.create_group(f"runs/run_{k + 1}")
            run.attrs["epoch"] = 1e9 + k * PAUSE
            for name, series in (("t", t), ("q", q), ("tau", tau), ("temp", temp)):
                run[name] = series


def write_config(path: Path) -> None:
    """With all effects declared, and none looked for."""
    joint_names = the_robot().joint_names
    declared = [
        {
            "kind": each.kind,
            "joints": "all" if each.joints == OF_ALL else [joint_names[j] for j in each.joints],
            **({"shape": dict(each.shape)} if each.shape else {}),
            **({"runs": list(each.runs)} if each.runs else {}),
            **({"covariate": each.covariate} if each.covariate else {}),
        }
        for each in effects()
    ]
    config = {
        "robot": {"urdf": str(URDF)},
        "effects": declared,
        "measurement": {"covariates": ["temp"]},
        "diagnosis": {"rounds": 0},
    }
    path.write_text(yaml.safe_dump(config))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("predict")


@pytest.fixture(scope="module")
def answer(folder: Path) -> Any:
    write_log(the_robot(), folder / "log.h5")
    write_config(folder / "all.yaml")
    script, formulas = scripts()
    (folder / "predict.py").write_text(script)
    (folder / "formulas.py").write_text(formulas)
    return Program(folder, folder / "cache").answer("diagnose", "all.yaml", "log.h5")


def scripts() -> tuple[str, str]:
    """`predict.py` and `formulas.py`."""
    script, formulas = re.findall(
        r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL
    )
    return str(script), str(formulas)


def predicted(folder: Path, answer: Any) -> dict[str, float]:
    """What the script prints."""
    given, told = folder / "answer.json", io.StringIO()
    given.write_text(json.dumps(answer))
    arguments = ["predict.py", str(given), str(URDF), str(folder / "log.h5")]
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(told):
        patch.setattr(sys, "argv", arguments)
        patch.syspath_prepend(str(folder))
        patch.delitem(sys.modules, "formulas", raising=False)
        runpy.run_path(str(folder / "predict.py"))
    return dict(json.loads(told.getvalue()))


def apart(found: Mapping[str, float], table: Mapping[str, float]) -> float:
    """Largest difference of two figures, over what is allowed: two in ten thousand, or 0.3 %."""
    return max(abs(found[joint] - table[joint]) / (2e-4 + 3e-3 * table[joint]) for joint in table)


def test_the_script_has_forty_lines_and_a_formula_for_every_effect(
    folder: Path, answer: Any
) -> None:
    script = (folder / "predict.py").read_text()
    assert len([line for line in script.splitlines() if line]) <= 40
    assert "excite_cli" not in script + (folder / "formulas.py").read_text()
    found = runpy.run_path(str(folder / "formulas.py"))
    assert set(found["FORMULAS"]) == set(catalogue())


def test_every_effect_there_is_on_a_robot_that_is_bolted_down() -> None:
    of_base = {name for name, kind in catalogue().items() if kind.scope == "base"}
    assert {name for name, *_ in PLANTED} == set(catalogue()) - of_base


def test_the_script_comes_to_the_table_of_errors(folder: Path, answer: Any) -> None:
    table = answer["error"]["after"]["relative_moving"]
    assert 0.002 < min(table.values()) < max(table.values()) < 0.3
    assert apart(predicted(folder, answer), table) < 1.0


def test_it_does_not_without_any_of_them(folder: Path, answer: Any) -> None:
    """Each moves the error of a joint by five times what is allowed above."""
    table, model = answer["error"]["after"]["relative_moving"], answer["model"]
    for kind, *_ in PLANTED:
        others = [each for each in model["effects"] if each["kind"] != kind]
        without = predicted(folder, {**answer, "model": {**model, "effects": others}})
        assert apart(without, table) > 5.0, kind
