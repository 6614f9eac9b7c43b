"""All criteria by their name in the YAML file."""

from collections.abc import Callable

from excite_cli.config.spec import CriterionSpec
from excite_cli.criteria.base import Criterion
from excite_cli.criteria.condition_and_sigma_min import ConditionAndSigmaMin
from excite_cli.criteria.condition_number import ConditionNumber
from excite_cli.criteria.log_det import LogDet
from excite_cli.criteria.predicted_torque import PredictedTorque
from excite_cli.criteria.sigma_min import SigmaMin
from excite_cli.criteria.smooth_condition_number import SmoothConditionNumber
from excite_cli.criteria.torque_deviation import TorqueDeviation
from excite_cli.criteria.trace_inverse import TraceInverse
from excite_cli.errors import ConfigError, nearest

CRITERIA: dict[str, Callable[[CriterionSpec], Criterion]] = {
    "condition_number": lambda spec: ConditionNumber(),
    "smooth_condition_number": lambda spec: SmoothConditionNumber(spec.smoothing),
    "log_det": lambda spec: LogDet(),
    "sigma_min": lambda spec: SigmaMin(),
    "trace_inverse": lambda spec: TraceInverse(),
    "torque_deviation": lambda spec: TorqueDeviation(),
    "predicted_torque": lambda spec: PredictedTorque(),
    "condition_and_sigma_min": lambda spec: ConditionAndSigmaMin(),
}


def build_criterion(spec: CriterionSpec) -> Criterion:
    """The criterion that `spec` asks for.

    Raises
    ------
    ConfigError
        There is none of this name.
    """
    if spec.kind not in CRITERIA:
        raise ConfigError(
            f"criterion.kind: there is no criterion '{spec.kind}'.{nearest(spec.kind, CRITERIA)} "
            f"Criteria: {', '.join(CRITERIA)}."
        )
    return CRITERIA[spec.kind](spec)
