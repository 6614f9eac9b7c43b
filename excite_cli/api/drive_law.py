"""Torque by the law of drives that follow set points, found in the data where it is left open."""

from dataclasses import replace

from excite_cli.api.loading import Case, robot_base, tell_findings
from excite_cli.excitation.problem import Problem
from excite_cli.identification.drive_law import find_law, is_sought, with_law
from excite_cli.identification.split import split
from excite_cli.measurement.dataset import Dataset
from excite_cli.measurement.torque_sources.command import Command, law_of
from excite_cli.shown.note import Tell


def with_drive_law(
    problem: Problem | Case, data: Dataset, held_out: str | None, tell: Tell
) -> tuple[Problem | Case, Dataset, list[Dataset]]:
    """What the config leaves open of the drives' law found in the data, but for the held-out part.

    And the data by laws one standard deviation off: if set points acted later, and if drives
    answered at once.

    Raises
    ------
    ConfigError, FileError
        There is no such held-out run; a run is too short.
    """
    spec, robot = problem.spec, problem.robot
    if spec.measurement.torque != Command.name:
        return problem, data, []
    joints = robot.joint_names[robot.base_joints :]
    law = law_of(spec.measurement, joints)
    at_once = replace(law, lag=0.0)
    if not is_sought(spec.measurement):
        return problem, data, [with_law(data, law, at_once)]
    training = split(data, held_out, spec.diagnosis.block, spec.identification.needed_runs).training
    found = find_law(robot, robot_base(problem), training, spec)
    findings = found.findings(joints)
    tell_findings(findings, tell)
    data = with_law(data, law, found.law)
    data = replace(data, findings=(*data.findings, *findings))
    later = replace(found.law, delay=found.law.delay + (found.delay_std or 0.0))
    one_off = [with_law(data, found.law, each) for each in (later, replace(found.law, lag=0.0))]
    return replace(problem, spec=found.told(spec, joints)), data, one_off
