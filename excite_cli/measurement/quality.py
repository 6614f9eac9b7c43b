"""All checks of measured data, in the order in which they can be made.

Missing values first, then what needs the samples as recorded (wrapped positions, dead, stuck,
saturated channels), then the time stamps, then what needs equidistant samples (units, order, sign).
Nothing is dropped without a finding; findings of severity `error` mean that any diagnosis would be
wrong.
"""

from collections.abc import Sequence

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.errors import FileError
from excite_cli.measurement.channel_order import check_order
from excite_cli.measurement.covariates import without_missing_covariates
from excite_cli.measurement.dataset import Dataset, Finding, Run
from excite_cli.measurement.dead_channels import dead_channels
from excite_cli.measurement.limits import Limits
from excite_cli.measurement.merged_findings import merged
from excite_cli.measurement.missing_values import without_missing
from excite_cli.measurement.resolution import with_torque_steps
from excite_cli.measurement.saturation import mask_saturated
from excite_cli.measurement.stamps import equidistant
from excite_cli.measurement.stuck import mask_stuck
from excite_cli.measurement.torque import in_step
from excite_cli.measurement.units import check_units
from excite_cli.measurement.wrapped import unwrapped


def checked(
    runs: Sequence[Run], spec: MeasurementSpec, joints: tuple[str, ...], limits: Limits
) -> tuple[list[Run], list[Finding]]:
    """Runs of one file, equidistant and masked, with everything that was seen and done."""
    findings: list[Finding] = []
    whole = []
    for run in runs:
        kept, more = without_missing(run, joints)
        findings += more
        kept, more = without_missing_covariates(kept)
        findings += more
        whole.append(kept)
    whole, more = unwrapped(whole, joints, limits)
    findings += more
    whole, more = dead_channels(whole, joints)
    findings += more
    whole, more = with_torque_steps(whole, joints)
    findings += more
    parts: list[Run] = []
    for run in whole:
        run, more = mask_saturated(run, joints, limits.revolute)
        findings += more
        run, more = mask_stuck(run, joints)
        findings += more
        even, more = equidistant(run)
        parts += [in_step(each, spec.torque_lag) for each in even]
        findings += more
    order = check_order(parts, joints, spec.filter.velocity == "measured")
    units = check_units(parts, spec, joints, limits)
    if any(found.kind == "lag" for found in order):  # which is why a gain is odd
        units = [found for found in units if found.kind not in ("gain", "clock")]
    findings += units + order
    return parts, list(dict.fromkeys(findings))


def raise_for_errors(dataset: Dataset) -> None:
    """Raise one FileError that lists every finding of severity `error`; else do nothing."""
    errors = [found for found in dataset.findings if found.severity == "error"]
    if errors:
        lines = "".join(f"\n- {sentence(found)}" for found in merged(errors))
        raise FileError(f"{', '.join(dataset.sources)}: these data cannot be used:{lines}")


def sentence(finding: Finding) -> str:
    """`run: text.`, as it is reported to a person."""
    return f"{finding.run}: {finding.text}." if finding.run else f"{finding.text}."
