"""Configs that are put together in Python: what a file would say, with messages as good."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from excite_cli import ConfigError, load_case, load_problem, plan, read_result
from excite_cli.config.load_spec import plain_values
from tests.api.conftest import ROOT, SMOKE

URDF = ROOT / "data" / "smoke_arm.urdf"


def smoke(**changes: Any) -> dict[str, Any]:
    """The smoke arm's config, brief and without self-collision."""
    tree: dict[str, Any] = yaml.safe_load(SMOKE.read_text(encoding="utf-8"))
    tree["robot"]["urdf"] = URDF
    tree["constraints"] = {"joint_limits": {"acceleration": 10.0}}
    tree["optimizer"] = {"max_iterations": 4}
    tree["sequence"] = {"motions": 1}
    return {**tree, **changes}


def test_a_dict_is_the_same_problem_as_its_file_and_is_planned(tmp_path: Path) -> None:
    tree = smoke()
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump({**tree, "robot": {**tree["robot"], "urdf": str(URDF)}}))
    from_dict, from_file = load_problem(tree), load_problem(path)
    assert from_dict.spec == from_file.spec
    assert from_dict.file is None
    assert from_file.file == path
    assert tree["robot"]["urdf"] is URDF  # what was given is left alone
    assert load_case(tree).robot.joint_names == from_file.robot.joint_names
    result = plan(from_dict, output=tmp_path / "arm.h5")
    stored = read_result(tmp_path / "arm.h5")
    np.testing.assert_array_equal(stored.motions[0].coefficients, result.motions[0].coefficients)


def test_arrays_tuples_and_paths_are_taken() -> None:
    robot = {"urdf": URDF, "joints": np.array(["elbow", "slide"])}
    robot["posture"] = {"elbow": np.float64(0.8)}  # type: ignore[assignment]
    spec = load_case({"robot": robot, "seed": np.int64(7), "effects": ()}).spec
    assert spec.robot.joints == ("elbow", "slide")
    assert spec.robot.posture == {"elbow": 0.8}
    assert spec.seed == 7


def test_overrides_and_relative_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(URDF.parent)
    case = load_case({"robot": {"urdf": URDF.name}, "seed": 1}, ["seed=5"])
    assert (case.spec.seed, case.folder) == (5, URDF.parent)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trajectory": {"harmoncs": 3}}, r"config: trajectory.harmoncs: unknown key. Did you mea"),
        ({"robot": {}}, r"config: robot.urdf: this key is required"),
        ({"seed": "x"}, r"config: seed: "),
        ({3: 1}, r"config: the key 3 is no text. Give names of settings."),
        ({"robot": {"urdf": "a", 1.5: 2}}, r"config: robot: the key 1.5 is no text."),
        ({"optimizer": {"max_iterations": {1, 2}}}, r"optimizer.max_iterations is of type set. Al"),
        ({"sequence": object()}, r"config: sequence is of type object. Allowed are what a YAML"),
    ],
)
def test_what_a_dict_may_not_say(changes: dict[Any, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load_problem({**smoke(), **changes})


def test_what_is_neither_file_nor_dict() -> None:
    loop: dict[str, Any] = {}
    loop["robot"] = loop
    with pytest.raises(ConfigError, match="nested too deeply, or holds itself"):
        plain_values(loop, "config")
    with pytest.raises(ConfigError, match=r"load_problem: config is \['a'\].*text, Path or a dict"):
        load_problem(["a"])  # type: ignore[arg-type]
