"""The rows of `excite inspect`: everything that is looked at, in order, and what came of it."""

from collections.abc import Sequence

from excite_cli.checks import foreign_runs, sentences, standing_legs
from excite_cli.checks.base import Log
from excite_cli.checks.catalogue import description_checks, log_checks, setup_checks
from excite_cli.checks.check_result import CheckResult, Status
from excite_cli.checks.trust import but_trusted, is_trusted
from excite_cli.config.spec import Spec
from excite_cli.measurement.dataset import Finding
from excite_cli.robot.model import Robot

# What is seen while files are read, by the kind of finding.
_OF_FILES: dict[str, tuple[str, ...]] = {
    "time stamps and gaps": (
        "stamps", "gap", "jitter", "order", "truncated", "ragged", "uneven_periods", "interpolated",
        "slow_rate",
    ),
    "missing or frozen values": (
        "nan", "nan_torque", "nan_speed", "nan_position", "stuck", "stale", "held", "dead",
        "dead_torque", "mostly_constant", "saturated", "no_speed", "torque_steps",
    ),
    "names of columns": ("numbered", "words", "other_joints", "swapped", "sign"),
    "wrapped angles": ("wrapped",),
    "units of positions and time": ("units", "gain", "lag"),
    "limits of the joints": ("outside_limits", "torque_units"),
}  # fmt: skip
_OTHER = "what else was noticed"
_TRUSTED = "not judged: measurement.trust names it"
_SPEEDS = "measurement.channels"  # leaves recorded speeds out, which no fit needs
_STATUS: dict[str, Status] = {"error": "fault", "warning": "doubt", "note": "ok"}


def of_description(robot: Robot, spec: Spec) -> list[CheckResult]:
    """Doubts and faults of the description alone."""
    log = Log(robot, (), (), spec)
    return [each for check in description_checks() for each in check.look(log)]


def of_files(findings: Sequence[Finding], spec: Spec) -> list[CheckResult]:
    """Results of what was seen while files were read; doubts of trusted checks are none.

    A doubt that asks for another config is open. A fault has a key of its own.
    """
    row = {kind: name for name, kinds in _OF_FILES.items() for kind in kinds}
    row |= {check.kind: check.name for check in setup_checks()}
    found = [
        CheckResult(
            row.get(each.kind, _OTHER), each.kind, _STATUS[each.severity], each.text, each.joints,
            each.run, each.settings,
            is_open=each.severity == "warning" and bool({*each.settings} - {_SPEEDS}),
        )
        for each in findings
    ]  # fmt: skip
    faults = [each for each in found if each.status == "fault"]
    return [*faults, *but_trusted((each for each in found if each.status != "fault"), spec)]


def names() -> tuple[str, ...]:
    """Of all checks, those of packages among them."""
    groups = (description_checks(), setup_checks(), log_checks())
    first, sought, others = ([check.name for check in group] for group in groups)
    stages = (*_OF_FILES, foreign_runs.NAME, standing_legs.NAME)
    return tuple(dict.fromkeys((*first, *stages, *sought, sentences.BELONG, *others)))


def in_order(found: Sequence[CheckResult], judged: bool, spec: Spec) -> tuple[CheckResult, ...]:
    """Results by the order of rows; a row without any is fine, if it was `judged` or trusted."""
    rows: list[CheckResult] = []
    described = {check.name for check in description_checks()}
    seen = {*described, *_OF_FILES}  # trusted or not
    for name in (*names(), _OTHER):
        own = [each for each in found if each.name == name]
        if not own and (judged or name in described) and name != _OTHER:
            is_judged = name in seen or not is_trusted(name, spec)
            own = [CheckResult(name, "", "ok", "" if is_judged else _TRUSTED)]
        rows += own
    return tuple(rows)
