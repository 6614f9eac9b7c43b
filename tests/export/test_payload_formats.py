"""Payloads as controllers read them: the examples of their makers, written from their bodies."""

import json
import re

import numpy as np
import pytest

from excite_cli import load_case
from excite_cli.effects.parameter import Value
from excite_cli.errors import ConfigError
from excite_cli.export.payload_formats import flange_of, payload_text
from excite_cli.identification.carried_load import LoadIdentification
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.link_changes import about_frame
from tests.cli.program import ROOT

# Franka Robotics, external_gripper_example: endeffector-config.json of a Robotiq gripper.
ROBOTIQ = (
    '{"mass":0.9,"centerOfMass":[0,0,0.057],"transformation":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],'
    '"inertia":[0.002768,0,0,0,0.003149,0,0,0,0.000564]}'
)
NO_ERRORS = Errors(0.0, 0.0, {}, {}, {}, {}, (0.0, 0.0))


def load_of(
    mass: float, centre: list[float], inertia: list[float], std: float = 1e-3, possible: bool = True
) -> LoadIdentification:
    """With `inertia` about the centre as Ixx, Ixy, Iyy, Ixz, Iyz, Izz."""
    values = about_frame(np.array([mass, *centre, *inertia]))
    named = {"mass": Value(mass, std, "kg")}
    named |= {name: Value(x, std, "m") for name, x in zip(("cx", "cy", "cz"), centre, strict=True)}
    covariance = std**2 * np.eye(10)
    return LoadIdentification(
        "tool0", "wrist", values, covariance, named, possible, NO_ERRORS, NO_ERRORS, 0.0, 3.0
    )


def test_the_gripper_of_frankas_own_example() -> None:
    load = load_of(0.9, [0, 0, 0.057], [0.002768, 0, 0.003149, 0, 0, 0.000564])
    told = payload_text(load, "franka")
    assert json.loads(told.text) == json.loads(ROBOTIQ)
    assert any("transformation" in note for note in told.notes)


def test_the_signature_of_the_script_manual_with_its_order_of_moments() -> None:
    """Ixx, Iyy, Izz, Ixy, Ixz, Iyz there; Ixx, Ixy, Iyy, Ixz, Iyz, Izz here."""
    load = load_of(1.5, [0.01, -0.02, 0.05], [0.003, 1e-5, 0.004, -2e-5, 3e-5, 0.005])
    first, _, older = payload_text(load, "ur").text.splitlines()
    inertia = "[0.003, 0.004, 0.005, 0.00001, -0.00002, 0.00003]"
    assert first == f"set_target_payload(1.5, [0.01, -0.02, 0.05], {inertia})"
    assert older == "# set_payload(1.5, [0.01, -0.02, 0.05])"
    rows = np.array(json.loads(payload_text(load, "franka").text)["inertia"]).reshape(3, 3)
    assert rows[0, 1] == rows[1, 0] == 1e-5
    assert np.diag(rows).tolist() == [0.003, 0.004, 0.005]


def test_the_nearest_body_is_written_only_where_it_is_the_one_that_was_found() -> None:
    flat = [0.003, 0, 0.004, 0, 0, 0.0075]  # Izz > Ixx + Iyy: no body
    told = payload_text(load_of(1.5, [0, 0, 0.05], flat), "ur")
    six = [float(x) for x in re.findall(r"[-\d.]+", told.text.splitlines()[0].split("],")[1])]
    assert six[2] <= six[0] + six[1]
    assert "nearest possible body" in told.notes[0]
    with pytest.raises(
        ConfigError, match=r"not written, since it is not a possible body; [^.]*\.$"
    ):
        payload_text(load_of(1.5, [0, 0, 0.05], [-0.1, 0, -0.1, 0, 0, 0.002], 1e-4), "ur")
    with pytest.raises(ConfigError, match="not a possible body"):
        payload_text(load_of(1.5, [0, 0, 0.05], flat, possible=False), "franka")
    with pytest.raises(ConfigError, match=r"its mass, 0\.01 ± 0\.02 kg, may be zero"):
        payload_text(load_of(0.01, [0, 0, 0.05], [0.0] * 6, 0.02), "ur")


def test_the_frame_is_the_flange_by_the_names_of_the_makers() -> None:
    robots = {name: load_case(ROOT / f"configs/{name}.yaml").robot for name in ("ur10", "panda")}
    assert flange_of(robots["ur10"], "ur") == "tool0"
    assert flange_of(robots["panda"], "franka") == "panda_link8"
    with pytest.raises(ConfigError, match=r"--ur: the robot has 0 links named …tool0"):
        flange_of(robots["panda"], "ur")
