import pytest

from excite_cli.config.constraints_spec import DiscSpec
from excite_cli.config.load_spec import parse_spec
from excite_cli.config.spec import Spec
from excite_cli.config.trajectory_spec import BSplineSpec
from excite_cli.errors import ConfigError

TEXT = """
robot: {urdf: arm.urdf, posture: {elbow: 0.5}}
constraints:
  joint_limits: {acceleration: 10.0}
  self_collision: {margin: 0.02}
optimizer: {max_iterations: 120}
seed: 7
"""


def overridden(*overrides: str) -> Spec:
    return parse_spec(TEXT, "arm.yaml", list(overrides))


def refused(*overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        overridden(*overrides)
    return str(caught.value)


def test_values_are_replaced_their_neighbours_stay_and_sections_are_made() -> None:
    spec = overridden(
        "optimizer.max_iterations=3",
        "robot.posture.wrist=-1",
        "sequence.motions=4",
        "constraints.torque.scale=0.5",
        "robot.urdf=a=b.urdf",  # an equals sign may be in the value
    )
    assert spec.optimizer.max_iterations == 3
    assert spec.robot.posture == {"elbow": 0.5, "wrist": -1.0}
    assert (spec.seed, spec.sequence.motions) == (7, 4)
    assert spec.constraints.torque is not None
    assert spec.constraints.torque.scale == 0.5
    assert spec.robot.urdf == "a=b.urdf"


def test_values_are_yaml() -> None:
    spec = overridden(
        "constraints.self_collision=null",
        "constraints.balance={kind: disc, radius: 0.1}",
        "trajectory={family: bspline, duration: 3}",
        "robot.joints=[elbow, wrist]",
    )
    assert spec.constraints.self_collision is None
    assert spec.constraints.balance == DiscSpec(radius=0.1)
    assert spec.trajectory == BSplineSpec(family="bspline", duration=3.0)
    assert spec.robot.joints == ("elbow", "wrist")


def test_null_and_then_a_key_begins_the_section_anew() -> None:
    spec = overridden("constraints.self_collision=null", "constraints.self_collision.margin=0.5")
    assert spec.constraints.self_collision is not None
    assert spec.constraints.self_collision.margin == 0.5


def test_the_last_one_counts_and_spaces_do_not() -> None:
    assert overridden("seed=1", " seed = 2 ").seed == 2


@pytest.mark.parametrize("override", ["seed", "=3", "=", " =3", "", ".seed=3", "optimizer..x=3"])
def test_the_form_is_explained(override: str) -> None:
    message = refused(override)
    assert message.startswith(f"--set {override}: ")
    assert "key.path=value" in message


@pytest.mark.parametrize("override", ["robot.urdf.x=3", "seed.x=3"])
def test_a_key_below_a_value(override: str) -> None:
    message = refused(override)
    assert message.startswith(f"--set {override}: '{override.split('.')[-2]}' holds a value")


@pytest.mark.parametrize(
    "value", ["[", "&a [*a]", "{a: 1, a: 2}", "!!python/name:os.system", "{[1]: 2}", "{{a: 1}: 2}"]
)
def test_a_value_that_is_not_plain_yaml(value: str) -> None:
    assert refused(f"seed={value}").startswith("--set seed")


def test_unknown_key_and_wrong_value_are_told_as_in_a_file() -> None:
    message = refused("optimizer.max_iteration=3")
    assert "optimizer.max_iteration: unknown key. Did you mean 'max_iterations'?" in message
    assert "optimizer.max_iterations: " in refused("optimizer.max_iterations=few")
