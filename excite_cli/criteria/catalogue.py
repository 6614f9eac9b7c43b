"""All criteria by their name in the YAML file."""

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.base import Criterion
from excite_cli.registry import Registry

CRITERIA: Registry[Criterion] = Registry(
    "criterion",
    "excite.criteria",
    Criterion,
    {
        "condition_number": "condition_number:ConditionNumber",
        "smooth_condition_number": "smooth_condition_number:SmoothConditionNumber",
        "log_det": "log_det:LogDet",
        "sigma_min": "sigma_min:SigmaMin",
        "trace_inverse": "trace_inverse:TraceInverse",
        "torque_deviation": "torque_deviation:TorqueDeviation",
        "predicted_torque": "predicted_torque:PredictedTorque",
        "condition_and_sigma_min": "condition_and_sigma_min:ConditionAndSigmaMin",
    },
)


def build_criterion(spec: CriterionSpec) -> Criterion:
    """The criterion that `spec` asks for; ConfigError if there is none of this name."""
    return CRITERIA.named(spec.kind, "criterion.kind").build(spec)
