"""What every constraint of a problem is built for."""

from dataclasses import dataclass, field
from functools import cached_property

from excite_cli.config.constraints_spec import ConstraintsSpec, SelfCollisionSpec
from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.dynamics.forward_kinematics import BatchKinematics, States
from excite_cli.dynamics.uncertain_inertias import InertiaUncertainty
from excite_cli.dynamics.whole_robot import CenterOfMass
from excite_cli.geometry.capsules import fit_capsules
from excite_cli.geometry.obstacle_pairs import ignored_pairs
from excite_cli.robot.capsule import Capsule
from excite_cli.robot.model import Array, Robot


@dataclass(frozen=True)
class Setting:
    """The robot, what the config says, and what is known of inertias and drives."""

    spec: ConstraintsSpec
    robot: Robot
    uncertainty: InertiaUncertainty | None = None
    measurement: MeasurementSpec = field(default_factory=MeasurementSpec)

    @property
    def bounded(self) -> bool:
        """Whether positions are kept: only then what they never bring near may be left out."""
        return self.spec.joint_limits is not None and self.spec.joint_limits.position

    @cached_property
    def capsules(self) -> tuple[Capsule, ...]:
        """Those of self-collision and of surroundings.

        A link that is told from its neighbours in one of the two has one of its own in both.
        """
        around, own = self.spec.surroundings, self.spec.self_collision
        apart = {link for link, _ in ignored_pairs(self.robot, around)} if around else ()
        return fit_capsules(self.robot, own or SelfCollisionSpec(), apart)

    def posture_center_of_mass(self) -> Array:
        """World x, y of the centre of mass at the posture (2,)."""
        robot = self.robot
        states = States.still(BatchKinematics(robot), robot.posture[None])
        return CenterOfMass(robot).position(states)[0, :2]
