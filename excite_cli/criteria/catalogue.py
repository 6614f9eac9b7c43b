"""All criteria by their name in the YAML file."""

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.base import Criterion
from excite_cli.criteria.condition_and_sigma_min import ConditionAndSigmaMin
from excite_cli.criteria.condition_number import ConditionNumber
from excite_cli.criteria.log_det import LogDet
from excite_cli.criteria.sigma_min import SigmaMin
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.criteria.torque_deviation import TorqueDeviation
from excite_cli.criteria.trace_inverse import TraceInverse
from excite_cli.registry import Registry

CRITERIA: Registry[Criterion] = Registry(
    "criterion",
    "excite.criteria",
    Criterion,
    (
        ConditionNumber,
        SmoothConditionNumber,
        LogDet,
        SigmaMin,
        TraceInverse,
        TorqueDeviation,
        ConditionAndSigmaMin,
    ),
)


def build_criterion(spec: CriterionSpec) -> Criterion:
    """The criterion that `spec` asks for; ConfigError if there is none of this name."""
    return CRITERIA.named(spec.kind, "criterion.kind").build(spec)
