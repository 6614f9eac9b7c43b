"""What a config that is wrong is told: where, what, the nearest word, and what is allowed."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args, get_origin

import pytest
import yaml

from excite_cli.config import (
    constraints_spec,
    data_spec,
    robot_spec,
    spec,
    trajectory_spec,
)
from excite_cli.config.load_spec import MAX_BYTES, load_spec, parse_spec
from excite_cli.config.plain_yaml import MAX_DEPTH
from excite_cli.config.section import Section
from excite_cli.errors import ConfigError

ROBOT = "robot: {urdf: arm.urdf}"
CAPSULE = "start: [0, 0, 0], end: [0, 0, 1], radius: 0.1"
# What sections must have.
NEEDED: dict[type[Section], str] = {
    spec.Spec: ROBOT,
    robot_spec.RobotSpec: "urdf: arm.urdf",
    robot_spec.TransmissionSpec: "joints: [a], motors: [m], matrix: [[1]]",
    robot_spec.PayloadSpec: f"link: hand, {CAPSULE}",
    trajectory_spec.GridSpec: "samples: 9, step: 0.1",
    constraints_spec.SurroundingsSpec: "floor: 0",
    constraints_spec.BoxSpec: "size: [1, 1, 1], position: [0, 0, 0]",
    constraints_spec.WallSpec: "point: [0, 1, 0], normal: [0, -1, 0]",
    constraints_spec.DiscSpec: "kind: disc, radius: 0.1",
    constraints_spec.CapsuleSpec: CAPSULE,
    spec.IdentifiedSpec: "inertias: {}",
    spec.IdentifiedEffectSpec: "kind: spring, joints: [elbow], values: [1, 0]",
    data_spec.EffectSpec: "kind: spring",
    data_spec.KnownPayloadSpec: "runs: [a], mass: 1, center: [0, 0, 0]",
    data_spec.TotalMassSpec: "mass: 1",
}
# Other kinds of a trajectory and of a support, which are tested by themselves.
OTHERS = (trajectory_spec.BSplineSpec, constraints_spec.PolygonSpec)
# The name that a section has within something, and how it is put there.
WITHIN: dict[Any, tuple[str, Callable[[Any], Any]]] = {
    dict: (".hand", lambda keys: {"hand": keys}),
    tuple: (".0", lambda keys: [keys]),
    None: ("", lambda keys: keys),
}
Level = tuple[type[Section], Callable[[dict[str, Any]], dict[str, Any]]]


def inside(annotation: Any, within: Any = None) -> list[tuple[type[Section], Any]]:
    """Sections that a field may hold, with the mapping or tuple that they are within."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [(annotation, within)]
    origin = get_origin(annotation)
    within = origin if origin in WITHIN and origin else within
    return [found for inner in get_args(annotation) for found in inside(inner, within)]


def levels(kind: type[Section], path: str, around: Callable[..., Any]) -> dict[str, Level]:
    """Every section below by its path, with what makes a whole config of some keys of it."""

    def whole(keys: dict[str, Any]) -> Any:
        return around({**yaml.safe_load(f"{{{NEEDED.get(kind, '')}}}"), **keys})

    found = {path: (kind, whole)}
    for key, field in kind.model_fields.items():
        for inner, within in inside(field.annotation):
            if inner not in OTHERS:
                name, wrap = WITHIN[within]
                below = lambda keys, key=key, wrap=wrap: whole({key: wrap(keys)})  # noqa: E731
                found |= levels(inner, f"{path}.{key}{name}".lstrip("."), below)
    return found


LEVELS = levels(spec.Spec, "", lambda keys: keys)


def told(text: str, *overrides: str) -> str:
    """The message that `text` leads to, which must not speak of our classes."""
    with pytest.raises(ConfigError) as caught:
        parse_spec(text, "arm.yaml", list(overrides))
    message = re.sub(
        r"^arm.yaml, line \d+: (?!not valid)", "arm.yaml: ", str(caught.value), flags=re.M
    )
    for inner in ("literal[", "dict[", "tuple[", "constrained", "instance of", ".bool:", "Spec"):
        assert inner not in message, f"'{inner}' means nothing to a user: {message}"
    return message


@pytest.mark.parametrize("path", LEVELS)
def test_unknown_key_names_path_nearest_word_and_allowed_keys(path: str) -> None:
    section, whole = LEVELS[path]
    keys = sorted(section.model_fields)
    longest = max(keys, key=len)
    wrong = longest[:-2] + longest[-1]  # a letter forgotten
    message = told(yaml.safe_dump(whole({wrong: 1})))
    where = f"{path}.{wrong}" if path else wrong
    assert message.startswith(f"arm.yaml: {where}: unknown key.")
    assert f"Did you mean '{longest}'?" in message
    assert message.endswith(f"Allowed here: {', '.join(keys)}.")
    assert len(message.splitlines()) == 1


def test_every_section_is_covered() -> None:
    known = {section for section, _ in LEVELS.values()}
    assert {*Section.__subclasses__()} - known == {*OTHERS}


@pytest.mark.parametrize(
    ("text", "path", "foreign", "section"),
    [
        ("trajectory: {family: bspline, duration: 3, harmonics: 3}",
         "trajectory.harmonics", "base_frequency", trajectory_spec.BSplineSpec),
        ("trajectory: {duration: 3}", "trajectory.duration", "control_points",
         trajectory_spec.FourierSpec),
        ("constraints: {balance: {kind: polygon, vertices: [[0, 0], [0, 1], [1, 0]], radius: 1}}",
         "constraints.balance.radius", "center", constraints_spec.PolygonSpec),
    ],
)  # fmt: skip
def test_keys_of_another_kind_are_not_offered(
    text: str, path: str, foreign: str, section: type[Section]
) -> None:
    message = told(f"{ROBOT}\n{text}")
    assert message.startswith(f"arm.yaml: {path}: unknown key.")
    assert f"Did you mean '{path.split('.')[-1]}'" not in message
    allowed = message.split("Allowed here: ")[1].rstrip(".").split(", ")
    assert allowed == sorted(section.model_fields)
    assert foreign not in allowed


@pytest.mark.parametrize(
    ("text", "path", "words"),
    [
        ("optimizer: {restarts: many}", "optimizer.restarts", "integer (given: 'many')"),
        ("measurement: {wrench: [{channel: foot}, {channel: foot}]}", "measurement",
         "'foot' is declared for two sensors of the base"),
        ("measurement: {base: {imu: {gyroscope: wrench}}}", "measurement", "'wrench' is declared"),
        ("sequence: {motions: 1.5}", "sequence.motions", "(given: 1.5)"),
        ("sequence: {motions: 0}", "sequence.motions", "greater than or equal to 1"),
        ("seed: -1", "seed", "greater than or equal to 0 (given: -1)"),
        ("seed: 4294967296", "seed", "less than or equal to"),
        ("seed: true", "seed", "(given: True)"),
        ("trajectory: {base_frequency: -0.7}", "trajectory.base_frequency", "greater than 0"),
        ("trajectory: {base_frequency: 1.0e+6}", "trajectory.base_frequency", "equal to 630"),
        ("trajectory: {harmonics: true}", "trajectory.harmonics", "(given: True)"),
        ("trajectory: {harmonics: 2, at_rest: true}", "trajectory", "at least 3 harmonics"),
        ("trajectory: [1]", "trajectory", ""),
        ("trajectory: fourier", "trajectory", "(given: 'fourier')"),
        ("trajectory: {family: furier}", "trajectory", "Did you mean 'fourier'?"),
        ("sampling: {cost: {samples: 1, step: 0.1}}", "sampling.cost.samples", "equal to 2"),
        ("optimizer: {max_seconds: .inf}", "optimizer.max_seconds", "finite"),
        ("optimizer: {tolerance: .nan}", "optimizer.tolerance", "finite"),
        ("constraints: {torque: {scale: 1.5}}", "constraints.torque.scale", "or equal to 1"),
        ("constraints: {joint_limits: {velocity: 0}}", "constraints.joint_limits.velocity",
         "greater than 0"),
        ("constraints: {joint_limits: {acceleration: true}}",
         "constraints.joint_limits.acceleration", "(given: True)"),
        ("constraints: {balance: {kind: disc}}", "constraints.balance.radius", "required"),
        ("constraints: {balance: {kind: dics, radius: 1}}", "constraints.balance",
         "Did you mean 'disc'?"),
        ("constraints: {balance: {kind: polygon, vertices: [[0, 0], [1, 1]]}}",
         "constraints.balance.vertices", "at least 3"),
        ("constraints: {self_collision: {margin: -0.01}}", "constraints.self_collision.margin",
         "greater than or equal to 0"),
        ("constraints: {self_collision: {capsules: {hand: {start: [0, 0, 0], radius: 1}}}}",
         "constraints.self_collision.capsules.hand.end", "required"),
        ("constraints: {self_collision: {capsules: atuo}}",
         "constraints.self_collision.capsules", "Did you mean 'auto'?"),
        ("criterion: {row_weights: {elbow: -1}}", "criterion.row_weights.elbow",
         "greater than 0 (given: -1)"),
        ("criterion: {row_weights: efort}", "criterion.row_weights", "Did you mean 'effort'?"),
        ("sequence: null", "sequence", "(given: None)"),
        ("1: 2", "1", "strings"),
        ("@joints: []", "robot.joints", "at least one joint"),
        ("@joints: [elbow, elbow]", "robot.joints", "named twice: elbow"),
        ("@joints: 3", "robot.joints", "'all'"),
        ("@joints: al", "robot.joints", "Did you mean 'all'?"),
        ("@rows: [base]", "robot", "needs base: floating"),
        ("@rows: [joint]", "robot.rows.0", "Did you mean 'joints'?"),
        ("@base: flaoting", "robot.base", "Did you mean 'floating'?"),
        ("@posture: {elbow: up}", "robot.posture.elbow", "number (given: 'up')"),
        ("@posture: {elbow: true}", "robot.posture.elbow", "(given: True)"),
        ("@gravity: [0, -9.81]", "robot.gravity", "3 values needed"),
        ("@limits: {elbow: {position: [1, 0]}}", "robot.limits.elbow.position", "not below"),
        ("@limits: {elbow: {velocity: 0}}", "robot.limits.elbow.velocity", "greater than 0"),
        ("@limits: {elbow: {jerk: 0}}", "robot.limits.elbow.jerk", "greater than 0"),
        ("@limits: {elbow: {effort_by_speed: [[0, 9]]}}", "robot.limits.elbow.effort_by_speed",
         "at least two points"),
        ("@limits: {elbow: {effort_by_speed: [[1, 9], [2, 8]]}}",
         "robot.limits.elbow.effort_by_speed", "the first point must have speed 0"),
        ("@limits: {elbow: {effort_by_speed: [[0, 9], [0, 8]]}}",
         "robot.limits.elbow.effort_by_speed", "[0, 8] after [0, 9]: speeds must increase"),
        ("@limits: {elbow: {effort_by_speed: [[0, 9], [1, 10]]}}",
         "robot.limits.elbow.effort_by_speed", "torques must not"),
        ("@limits: {elbow: {effort: 9, effort_by_speed: [[0, 9], [1, 8]]}}",
         "robot.limits.elbow", "not both"),
        ("@transmissions: [{joints: [a], motors: [m], matrix: [[1]], limits: "
         "{m: {effort_by_speed: [[0, 9], [1, 8]]}}}]", "robot.transmissions.0",
         "limits.m.effort_by_speed: only for a motor that drives one joint alone"),
        ("@limits_preset: ur5", "robot.limits_preset",
         "there is no 'ur5'. Did you mean 'ur5e'? There are franka_emika_panda, "),
    ],
)  # fmt: skip
def test_a_value_that_is_not_allowed_names_the_path(text: str, path: str, words: str) -> None:
    """Where it begins with @, of the robot."""
    whole = f"robot: {{urdf: arm.urdf, {text[1:]}}}" if text[0] == "@" else f"{ROBOT}\n{text}"
    message = told(whole)
    assert message.startswith(f"arm.yaml: {path}: ")
    assert words in message


@pytest.mark.parametrize(("text", "key"), [("robot: {}", "robot.urdf"), ("seed: 1", "robot")])
def test_a_missing_key(text: str, key: str) -> None:
    assert told(text) == f"arm.yaml: {key}: this key is required."


def test_all_mistakes_are_told_at_once() -> None:
    message = told("robot: {urdf: a.urdf, bas: fixed}\nsead: 1\nsequence: {motions: 0}")
    assert len(message.splitlines()) == 3


@pytest.mark.parametrize("text", ["", "3", "- robot: {urdf: a.urdf}"])
def test_not_a_mapping(text: str) -> None:
    assert "mapping" in told(text)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (f"{ROBOT}\nseed: [", 2, ""),
        (f"{ROBOT}\n\tseed: 1", 2, ""),
        (f"{ROBOT}: 3", 1, ""),
        (f"{ROBOT}\n---\nseed: 2", 2, ""),
        (f"{ROBOT}\nseed: 1\nseed: 2", 3, "key 'seed' is given twice"),
        ("robot:\n  urdf: a.urdf\n  urdf: b.urdf", 3, "key 'urdf' is given twice"),
        (f"{ROBOT}\nseed: &one 1\nsequence: {{motions: *one}}", 3, "aliases"),
        (f"{ROBOT}\nseed: !!python/object:collections.OrderedDict {{}}", 2, ""),
        (f"{ROBOT}\nseed: !!python/name:os.system", 2, ""),
        (f"{ROBOT}\n? [1]\n: 2", 2, ""),
        (f"{ROBOT}\n? {{a: 1}}\n: 2", 2, ""),
    ],
)
def test_what_is_not_plain_yaml_is_refused_with_its_line(text: str, line: int, words: str) -> None:
    message = told(text)
    assert message.startswith(f"arm.yaml, line {line}: ")
    assert words in message


@pytest.mark.parametrize("value", ["2020-13-45", "9" * 5000, "\x00"], ids=["date", "long", "nul"])
def test_values_that_yaml_cannot_make_are_refused(value: str) -> None:
    assert told(f"{ROBOT}\nseed: {value}").startswith(("arm.yaml: ", "arm.yaml, line 2: "))


def test_a_python_tag_runs_nothing(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    told(f"{ROBOT}\nseed: !!python/object/apply:os.mkdir ['{trace}']")
    assert not trace.exists()


@pytest.mark.parametrize("opening", ["[", "{a: "])
def test_too_deep(opening: str) -> None:
    assert f"deeper than {MAX_DEPTH}" in told(opening * 2000)
    assert "deeper" not in told(f"{ROBOT}\nseed: " + "[" * (MAX_DEPTH - 1) + "]" * (MAX_DEPTH - 1))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "There is no config file"),
        (b"robot: {urdf: \xff\xfe}", "cannot be read as text"),
        (ROBOT.encode() + b"\n#" + b"x" * MAX_BYTES, "larger than"),
    ],
)
def test_file_messages(tmp_path: Path, content: bytes | None, words: str) -> None:
    path = tmp_path / "arm.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError, match=words):
        load_spec(path)
    with pytest.raises(ConfigError, match="is a folder, not a config"):
        load_spec(tmp_path)
    path.write_text(f"{ROBOT}\n#" + "x" * (MAX_BYTES // 2), encoding="utf-8")
    assert load_spec(path).robot.urdf == "arm.urdf"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("optimizer: {method: sqp}", "optimizer: method: there is one method now, the interior"),
        ("optimizer: {method: slsqp}", "leave this key out (given: 'slsqp')"),
        ("optimizer: {qp_solver: osqp}", "optimizer: qp_solver: no quadratic program is solved"),
        ("measurement: {encoder_step: 1.0e-4}", "measurement: encoder_step: nothing ever used"),
    ],
)
def test_keys_that_are_gone_say_what_to_do(text: str, words: str) -> None:
    message = told(f"{ROBOT}\n{text}")
    assert words in message
    assert "leave" in message


def test_what_old_results_say_by_default_is_still_read() -> None:
    old = "optimizer: {method: interior_point, qp_solver: daqp, max_seconds: 7}"
    spec = parse_spec(f"{ROBOT}\n{old}\nmeasurement: {{encoder_step: null, angle: deg}}")
    assert spec == parse_spec(
        f"{ROBOT}\noptimizer: {{max_seconds: 7}}\nmeasurement: {{angle: deg}}"
    )
