"""A source of torque: which columns of a log it takes, and what torque of the joints they are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from excite_cli.config.data_spec import MeasurementSpec
    from excite_cli.measurement.dataset import Array, Run, TorqueLaw


class TorqueSource(ABC):
    """One value of `measurement.torque`.

    `channels` must be in the file beside the positions, `further` are used where they are. With
    `at_motor` its torque is that of the motor, which `gear_ratio` and transmissions bring to the
    joint. `scaled_by`: what of `measurement` its scale rests on; empty where it is measured.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    channels: ClassVar[tuple[str, ...]] = ("tau",)
    further: ClassVar[tuple[str, ...]] = ()
    at_motor: ClassVar[bool] = False
    scaled_by: ClassVar[str] = ""

    @abstractmethod
    def torque(self, run: Run, spec: MeasurementSpec, joints: tuple[str, ...]) -> Array:
        """τ (T, n) [N·m] (N) of a run whose positions and speeds are the joints' in rad (m)."""

    def law(self, spec: MeasurementSpec, joints: tuple[str, ...]) -> TorqueLaw | None:
        """What gives the torque anew at other positions; None where it was recorded."""
        return None


def per_joint(
    value: float | Mapping[str, float] | None, joints: tuple[str, ...], other: float = 1.0
) -> Array:
    """One number for all, or one for each of `joints`, (n,); `other` where none is given."""
    if value is None:
        return np.full(len(joints), other)
    if isinstance(value, Mapping):
        return np.array([float(value.get(joint, other)) for joint in joints])
    return np.full(len(joints), float(value))


def speeds_of(run: Run) -> Array:
    """The recorded speeds (T, n), or what the positions change by."""
    if run.dq is not None:
        return run.dq
    return np.asarray(np.gradient(run.q, run.t, axis=0)) if len(run.t) > 1 else np.zeros_like(run.q)
