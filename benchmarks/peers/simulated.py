"""Simulated robots with known answers: robot, inertias, friction, a planted effect by a seed.

Every robot has viscous and Coulomb friction on all joints, inertias that are off the URDF, and one
effect of the catalogue that friction and inertias do not absorb, drawn as for `make robots`. Two
planned motions are learned from, the third one is held out. The config that tools see declares none
of it.
"""

import json
import sys
import zlib
from pathlib import Path
from typing import Any

from benchmarks.peers.log_judge import Case
from benchmarks.program import excite, ran
from excite_cli.api.loading import load_case

ROBOTS = ("ur5", "ur10", "panda", "kinova", "talos_left_arm", "z1", "xarm7", "ur3 as MJCF")
_FRICTION = ("viscous_friction", "coulomb_friction")
_SHORT = ("constraints.self_collision=null", "optimizer.max_seconds=5", "optimizer.restarts=1")
_EFFECTS = "\neffects:\n  - {kind: viscous_friction}\n  - {kind: coulomb_friction}\n"


def simulated(seed: int, index: int, folder: Path) -> Case:
    """The case of a seed and an index; what lies in `folder` already is taken as it is."""
    robot = ROBOTS[index % len(ROBOTS)]
    own = folder / f"{seed}_{index:02d}"
    own.mkdir(parents=True, exist_ok=True)
    config, motions = _planned(robot, folder / robot.replace(" ", "_"))
    truth = config.with_name(f"truth_{own.name}.yaml")  # its paths are relative
    data, planted = own / "measured.h5", own / "planted.json"
    truth.write_text(config.read_text(encoding="utf-8") + _EFFECTS, encoding="utf-8")
    number = zlib.crc32(f"{seed} {index}".encode())
    if not data.is_file():
        drawn = _output("-m", "benchmarks.robots.planting", truth, motions, str(number))
        planted.write_text(drawn, encoding="utf-8")
        effects = [word for text in json.loads(drawn)["effects"] for word in ("--effect", text)]
        excite("simulate", truth, motions, "-o", data, "--seed", str(number % 2**31), *effects,
                "--rate", "200", "--overwrite")  # fmt: skip
    record = json.loads(planted.read_text(encoding="utf-8"))
    words = f"{robot}: {record['kind'].replace('_', ' ')} of {', '.join(record['joints'])}"
    return Case(own.name, words, config, data, None, (record, *_friction(config)))


def _planned(robot: str, folder: Path) -> tuple[Path, Path]:
    """The config that `init` proposes, and three motions."""
    config, motions = folder / "robot.yaml", folder / "motions.h5"
    if motions.is_file():
        return config, motions
    folder.mkdir(parents=True, exist_ok=True)
    given: tuple[str | Path, ...] = ("--robot", robot)
    if robot.endswith(" as MJCF"):
        given = ("--urdf", _as_mjcf(robot.removesuffix(" as MJCF"), folder))
    excite("init", *given, "-o", config, "--overwrite")
    # Simulated robots do not collide, and motions need not be the best.
    short = [word for text in _SHORT for word in ("--set", text)]
    begun = folder / "begun.h5"  # what is interrupted holds fewer motions
    excite("optimize", config, "-o", begun, "--overwrite", "--no-progress", *short)
    return config, begun.rename(motions)


def _as_mjcf(robot: str, folder: Path) -> Path:
    import mujoco

    from benchmarks.peers.plain_urdf import plain_urdf

    urdf = plain_urdf(load_case({"robot": {"urdf": f"example-robot-data:{robot}"}}).robot)
    path = folder / f"{robot}.xml"
    path.write_text(mujoco.MjSpec.from_string(urdf).to_xml(), encoding="utf-8")
    return path


def _friction(config: Path) -> list[dict[str, Any]]:
    return [
        {"kind": kind, "joints": [joint], "touched": [joint], "companions": []}
        for joint in load_case(config).robot.joint_names
        for kind in _FRICTION
    ]


def _output(*words: str | Path) -> str:
    run = ran([sys.executable, *words])
    if run.status:
        raise RuntimeError(f"{' '.join(map(str, words))}: {run.last}")
    return run.output
