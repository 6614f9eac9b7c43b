from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excite_cli.config.constraints_spec import ConstraintsSpec, JointLimitsSpec
from excite_cli.config.load_spec import load_spec, parse_spec, spec_as_yaml
from excite_cli.config.robot_spec import JointLimits, RobotSpec
from excite_cli.config.spec import OptimizerSpec, Spec
from excite_cli.config.trajectory_spec import FourierSpec

CONFIGS = sorted((Path(__file__).resolve().parents[2] / "configs").glob("*.yaml"))


def assert_same(first: Spec, second: Spec) -> None:
    """Equal, and of equal types: 1.0 and True are equal in Python, but not as a limit."""
    assert first == second
    assert first.model_dump_json() == second.model_dump_json()


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_every_shipped_config_round_trips_and_its_text_names_every_default(path: Path) -> None:
    spec = load_spec(path)
    text = spec_as_yaml(spec)
    assert_same(parse_spec(text), spec)
    assert all(f"\n{section}:" in f"\n{text}" for section in Spec.model_fields)
    assert all(f"  {key}: " in text for key in OptimizerSpec.model_fields)


@pytest.mark.parametrize("velocity", [True, False, 1.0, 2.5])
def test_a_velocity_bound_of_one_is_not_the_word_yes(velocity: bool | float) -> None:
    limits = ConstraintsSpec(joint_limits=JointLimitsSpec(velocity=velocity))
    spec = Spec(robot=RobotSpec(urdf="a.urdf"), constraints=limits)
    again = parse_spec(spec_as_yaml(spec)).constraints.joint_limits
    assert again is not None
    assert type(again.velocity) is type(velocity)


numbers = st.floats(1e-12, 1e12)
# Whatever a URDF may call a joint, with words that YAML reads as something else.
words = st.one_of(
    st.sampled_from(["yes", "null", "1", "1e3", "0x10", "2020-01-01", "~", "a: b", "- a", "*a"]),
    st.text(st.characters(categories=("L", "N", "P")), min_size=1, max_size=12),
)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.lists(words, min_size=1, max_size=4, unique=True),
    numbers,
    numbers,
    st.integers(0, 2**32 - 1),
)
def test_any_problem_round_trips(names: list[str], x: float, y: float, seed: int) -> None:
    x, y = min(x, 1e9), min(y, 1e9)
    spec = Spec(
        robot=RobotSpec(
            urdf=names[0],
            joints=tuple(names),
            posture=dict.fromkeys(names, -x),
            limits={names[-1]: JointLimits(position=(-x, y), velocity=y)},
        ),
        trajectory=FourierSpec(base_frequency=min(x, 600.0)),
        seed=seed,
    )
    assert_same(parse_spec(spec_as_yaml(spec)), spec)
