"""What a config leaves open of the drives' law, found in the data that it is about."""

from dataclasses import replace

from excite_cli.api.loading import Case, robot_base, tell_findings
from excite_cli.excitation.problem import Problem
from excite_cli.identification.drive_law import find_law, is_sought, with_law
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.torque_sources.command import law_of
from excite_cli.shown.note import Tell


def with_drive_law(
    problem: Problem | Case, data: Dataset, held_out: str | None, tell: Tell
) -> tuple[Problem | Case, Dataset]:
    """The config with all of the law, and the data by it; the held-out part has no say in it.

    Raises
    ------
    ConfigError, FileError
        There is no such held-out run; a run is too short.
    """
    spec, robot = problem.spec, problem.robot
    if not is_sought(spec.measurement):
        return problem, data
    joints = robot.joint_names[robot.base_joints :]
    training = split(data, held_out, spec.diagnosis.block, spec.identification.needed_runs).training
    found = find_law(robot, robot_base(problem), training, spec)
    findings = found.findings(joints)
    tell_findings(findings, tell)
    data = with_law(data, law_of(spec.measurement, joints), found.law)
    data = replace(data, findings=(*data.findings, *findings))
    return replace(problem, spec=found.told(spec, joints)), data
