"""excite: motions that make a robot's inertial parameters visible, and what its model lacks.

What the commands do is one import away: `from excite_cli import load_problem, plan, diagnose`. The
names below are imported when they are first asked for, so that `import excite_cli` stays light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from excite_cli.api import Case as Case
    from excite_cli.api import check as check
    from excite_cli.api import diagnose as diagnose
    from excite_cli.api import identify as identify
    from excite_cli.api import load_case as load_case
    from excite_cli.api import load_data as load_data
    from excite_cli.api import load_problem as load_problem
    from excite_cli.api import motions_of as motions_of
    from excite_cli.api import plan as plan
    from excite_cli.api import plan_after as plan_after
    from excite_cli.api import propose as propose
    from excite_cli.api import save_config as save_config
    from excite_cli.api import save_fit as save_fit
    from excite_cli.api import simulate as simulate
    from excite_cli.config.spec import Spec as Spec
    from excite_cli.diagnosis.next_motion import NextMotion as NextMotion
    from excite_cli.diagnosis.records import Diagnosis as Diagnosis
    from excite_cli.errors import ConfigError as ConfigError
    from excite_cli.errors import ExciteError as ExciteError
    from excite_cli.errors import FileError as FileError
    from excite_cli.errors import NoAdmissibleMotionError as NoAdmissibleMotionError
    from excite_cli.errors import RobotError as RobotError
    from excite_cli.excitation.inspection import Inspection as Inspection
    from excite_cli.excitation.problem import Problem as Problem
    from excite_cli.excitation.result import Result as Result
    from excite_cli.identification.identify import Identification as Identification
    from excite_cli.measurement.dataset import Dataset as Dataset
    from excite_cli.measurement.hdf5_writer import write_dataset as write_dataset
    from excite_cli.proposal.propose import Proposal as Proposal
    from excite_cli.simulation.settings import SimulationSettings as SimulationSettings
    from excite_cli.simulation.simulate import Simulation as Simulation
    from excite_cli.store.diagnosis_file import read_diagnosis as read_diagnosis
    from excite_cli.store.diagnosis_file import write_diagnosis as write_diagnosis
    from excite_cli.store.fit_file import read_fit as read_fit
    from excite_cli.store.result_file import read_result as read_result
    from excite_cli.store.result_file import write_result as write_result
    from excite_cli.trajectory.chain import Segment as Segment
    from excite_cli.workers.base import Workers as Workers
    from excite_cli.workers.catalogue import open_workers as open_workers

__version__ = "0.1.0"

_HOMES = {
    "config.spec": ("Spec",),
    "diagnosis.next_motion": ("NextMotion",),
    "diagnosis.records": ("Diagnosis",),
    "errors": (
        "ConfigError",
        "ExciteError",
        "FileError",
        "NoAdmissibleMotionError",
        "RobotError",
    ),
    "excitation.inspection": ("Inspection",),
    "excitation.problem": ("Problem",),
    "excitation.result": ("Result",),
    "identification.identify": ("Identification",),
    "api": (
        "Case",
        "check",
        "diagnose",
        "identify",
        "load_case",
        "load_data",
        "load_problem",
        "motions_of",
        "plan",
        "plan_after",
        "propose",
        "save_config",
        "save_fit",
        "simulate",
    ),
    "measurement.dataset": ("Dataset",),
    "measurement.hdf5_writer": ("write_dataset",),
    "proposal.propose": ("Proposal",),
    "simulation.settings": ("SimulationSettings",),
    "simulation.simulate": ("Simulation",),
    "store.diagnosis_file": ("read_diagnosis", "write_diagnosis"),
    "store.fit_file": ("read_fit",),
    "store.result_file": ("read_result", "write_result"),
    "trajectory.chain": ("Segment",),
    "workers.base": ("Workers",),
    "workers.catalogue": ("open_workers",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = ["__version__", *_HOME]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    """The public object `name`, imported from its room (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'excite_cli' has no attribute '{name}'")
    return getattr(import_module(f"excite_cli.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """Public names, also those that are not imported yet."""
    return sorted(__all__)
