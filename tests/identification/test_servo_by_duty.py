"""Two hobby servos in MuJoCo: voltage on a motor, counts, a battery that sags; no torque.

The simulator here is MuJoCo's alone: an arm by its own XML, motors by k_t (V d − k_e N v)/R.
"""

from pathlib import Path

import numpy as np
import pytest

from excite_cli import identify, load_case
from excite_cli.identification.fit import Fit
from excite_cli.identification.identify import Identification

pytestmark = pytest.mark.long

mujoco = pytest.importorskip("mujoco")

RATIO, K_T, OHM, COUNT = 345.0, 0.0012, 2.1, 2.0 * np.pi / 4096
ROTOR, VISCOUS, COULOMB = (0.012, 0.008), (0.03, 0.02), (0.06, 0.04)  # at the joint
MASSES, STEP, RATE = (0.16, 0.12), 2.5e-4, 100.0

LINK = """<body name="link_{k}" pos="0 0 {up}"><inertial mass="{mass}" pos="0.005 0 0.06"
 diaginertia="2e-4 2e-4 3e-5"/><joint name="joint_{k}" axis="0 1 0" damping="{viscous}"
 frictionloss="{coulomb}" armature="{rotor}"/>{inner}</body>"""
JOINT = """<joint name="joint_{k}" type="revolute"><parent link="{parent}"/><child link="link_{k}"/>
 <origin xyz="0 0 {up}"/><axis xyz="0 1 0"/>
 <limit lower="-1.5" upper="1.5" effort="2" velocity="6"/></joint>
 <link name="link_{k}"><inertial><origin xyz="0.005 0 0.06"/><mass value="{mass}"/>
 <inertia ixx="2e-4" iyy="2e-4" izz="3e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def engine(weight: float) -> "mujoco.MjModel":
    """The arm, its last link heavier by a `weight` [kg] at 0.1 m."""
    inner = ""
    for k in (1, 0):
        load = f'<body pos="0 0 0.1"><geom type="sphere" size="0.01" mass="{weight}"/></body>'
        inner = LINK.format(
            k=k + 1, up=0.12 * k, mass=MASSES[k], viscous=VISCOUS[k], coulomb=COULOMB[k],
            rotor=ROTOR[k], inner=inner + load * (k == 1 and weight > 0.0),
        )  # fmt: skip
    option = f'<option timestep="{STEP}" integrator="implicitfast"/>'
    plain = '<default><geom contype="0" conaffinity="0"/></default>'
    xml = f"<mujoco>{option}{plain}<worldbody>{inner}</worldbody></mujoco>"
    return mujoco.MjModel.from_xml_string(xml)


def recorded(path: Path, seed: int, seconds: float = 20.0, weight: float = 0.0) -> Path:
    """Counts, duty cycles and the battery's voltage while the servos follow slow waves."""
    model, rng = engine(weight), np.random.default_rng(seed)
    data, every = mujoco.MjData(model), round(1.0 / (RATE * STEP))
    frequency = rng.uniform(0.1, 0.9, (5, 2))
    phase, size = rng.uniform(0.0, 2.0 * np.pi, (5, 2)), rng.uniform(0.15, 0.35, (5, 2))
    rows = []
    duty = np.zeros(2)
    for k in range(round(seconds / STEP)):
        t = k * STEP
        supply = 7.6 - 0.02 * t - 0.1 * np.abs(duty).sum()
        if k % 4 == 0:  # the servo's own loop, 1 kHz, by counts
            wanted = np.sum(size * np.sin(2.0 * np.pi * frequency * t + phase), axis=0)
            counted = COUNT * np.round(data.qpos / COUNT)
            duty = np.clip(4.0 * (wanted - counted), -1.0, 1.0)
        if k % every == 0:
            rows.append([t, *(COUNT * np.round(data.qpos / COUNT)), *duty, supply])
        current = (supply * duty - K_T * RATIO * data.qvel) / OHM
        data.qfrc_applied[:] = RATIO * K_T * current
        mujoco.mj_step(model, data)
    head = "t,q_joint_1,q_joint_2,duty_joint_1,duty_joint_2,battery"
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same arm, but for masses 15 % off."""
    links = "".join(
        JOINT.format(k=k + 1, parent=f"link_{k}" if k else "base", up=0.12 * k, mass=1.15 * mass)
        for k, mass in enumerate(MASSES)
    )
    path = tmp_path_factory.mktemp("servo") / "arm.urdf"
    path.write_text(f'<robot name="arm"><link name="base"/>{links}</robot>', encoding="utf-8")
    return path


def problem(urdf: Path, ohm: float = OHM, **identification: object) -> dict[str, object]:
    return {
        "robot": {"urdf": str(urdf)},
        "measurement": {
            "torque": "duty", "gear_ratio": RATIO, "torque_constant": K_T,
            "motor": {"resistance": ohm, "supply": "battery"},
        },
        "effects": [{"kind": k} for k in ("viscous_friction", "coulomb_friction", "armature")],
        "identification": identification,
    }  # fmt: skip


def values_by_name(fit: Fit) -> dict[str, tuple[float, float]]:
    return dict(zip(fit.names, zip(fit.values, fit.std, strict=True), strict=True))


def test_friction_and_rotors_of_servos_are_found_from_duty_cycles(
    urdf: Path, tmp_path: Path
) -> None:
    logs = [recorded(tmp_path / f"run_{k}.csv", k) for k in range(3)]
    fit = identify(load_case(problem(urdf)), logs, tell=lambda note: None).fit
    found = values_by_name(fit)
    for k, joint in enumerate(("joint_1", "joint_2")):
        for name, truth, near in (
            ("viscous_friction.viscous", VISCOUS[k], 0.01),
            ("coulomb_friction.coulomb", COULOMB[k], 0.01),
            ("armature.inertia", ROTOR[k], 0.002),
        ):
            value, deviation = found[f"{name}[{joint}]"]
            assert value == pytest.approx(truth, abs=near), name
            assert abs(value - truth) < 4.0 * deviation + 0.02 * truth, name


def of_weighed(urdf: Path, folder: Path, weight: float) -> Identification:
    """With 1.3 times the true resistance, and 0.15 kg said to be on the third recording."""
    names, weights = ("empty", "other", "loaded", "last"), (0.0, 0.0, weight, 0.0)
    logs = [
        recorded(folder / f"{name}.csv", k, weight=weight)
        for k, (name, weight) in enumerate(zip(names, weights, strict=True))
    ]
    load = {
        "runs": ["loaded"], "mass": 0.15, "std": 0.001, "center": [0, 0, 0.1], "link": "link_2",
    }  # fmt: skip
    config = problem(urdf, 1.3 * OHM, known_payload=load)
    return identify(load_case(config), logs, tell=lambda note: None)


def test_a_weighed_load_tells_the_resistance_that_nobody_knew(urdf: Path, tmp_path: Path) -> None:
    """All torques are 1.3 times too small."""
    found = of_weighed(urdf, tmp_path, 0.15)
    values = values_by_name(found.fit)
    for joint in ("joint_1", "joint_2"):
        gain, deviation = values[f"torque_gain.gain[{joint}]"]
        assert 1.0 + gain == pytest.approx(1.0 / 1.3, abs=0.04)
        assert deviation < 0.05
    assert "unseen_load" not in {each.kind for each in found.findings}


def test_a_load_that_is_not_there_is_said_not_to_show(urdf: Path, tmp_path: Path) -> None:
    found = of_weighed(urdf, tmp_path, 0.0)
    (said,) = [each for each in found.findings if each.kind == "unseen_load"]
    assert "identification.known_payload" in said.text
    assert said.joints == ("joint_1", "joint_2")
