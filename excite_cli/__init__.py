"""excite: motions that make a robot's inertial parameters visible, and what its model lacks.

What the commands do is one import away: `from excite_cli import load_problem, plan, diagnose`. The
names below are imported at their first use, so that `import excite_cli` stays light.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from excite_cli.api.campaigning import run_campaign as run_campaign
    from excite_cli.api.changes import compare as compare
    from excite_cli.api.checking import check as check
    from excite_cli.api.comparing import compare_random as compare_random
    from excite_cli.api.diagnosing import diagnose as diagnose
    from excite_cli.api.diagnosing import save_config as save_config
    from excite_cli.api.exporting import Exported as Exported
    from excite_cli.api.exporting import export_file as export_file
    from excite_cli.api.files import read_diagnosis as read_diagnosis
    from excite_cli.api.files import read_fit as read_fit
    from excite_cli.api.files import read_result as read_result
    from excite_cli.api.files import write_dataset as write_dataset
    from excite_cli.api.files import write_diagnosis as write_diagnosis
    from excite_cli.api.files import write_result as write_result
    from excite_cli.api.forecasting import forecast as forecast
    from excite_cli.api.identifying import identify as identify
    from excite_cli.api.identifying import identify_load as identify_load
    from excite_cli.api.identifying import save_fit as save_fit
    from excite_cli.api.inspecting import LogInspection as LogInspection
    from excite_cli.api.inspecting import inspect as inspect
    from excite_cli.api.load_planning import LoadProblem as LoadProblem
    from excite_cli.api.load_planning import plan_load as plan_load
    from excite_cli.api.loading import Case as Case
    from excite_cli.api.loading import load_case as load_case
    from excite_cli.api.loading import load_data as load_data
    from excite_cli.api.loading import load_problem as load_problem
    from excite_cli.api.model import Model as Model
    from excite_cli.api.motions import load_motions as load_motions
    from excite_cli.api.motions import motions_of as motions_of
    from excite_cli.api.planning import plan as plan
    from excite_cli.api.planning import plan_after as plan_after
    from excite_cli.api.proposing import describe_robot as describe_robot
    from excite_cli.api.proposing import propose as propose
    from excite_cli.api.proposing import save_proposal as save_proposal
    from excite_cli.api.replaying import replay as replay
    from excite_cli.api.reporting import Report as Report
    from excite_cli.api.reporting import write_report as write_report
    from excite_cli.api.scoring import score as score
    from excite_cli.api.scoring import thresholds as thresholds
    from excite_cli.api.selftesting import selftest as selftest
    from excite_cli.api.simulating import simulate as simulate
    from excite_cli.api.studying import run_study as run_study
    from excite_cli.api.verifying import verify_gradient as verify_gradient
    from excite_cli.api.viewing import Drawing as Drawing
    from excite_cli.api.viewing import Serving as Serving
    from excite_cli.api.viewing import View as View
    from excite_cli.api.viewing import draw_motion as draw_motion
    from excite_cli.api.viewing import view_motions as view_motions
    from excite_cli.campaign.measure import Measure as Measure
    from excite_cli.campaign.measure import NotMeasuredError as NotMeasuredError
    from excite_cli.campaign.measure import Take as Take
    from excite_cli.campaign.records import Campaign as Campaign
    from excite_cli.config.spec import Spec as Spec
    from excite_cli.diagnosis.next_motion import NextMotion as NextMotion
    from excite_cli.diagnosis.records import Diagnosis as Diagnosis
    from excite_cli.diagnosis.records import NamedEffect as NamedEffect
    from excite_cli.effects.base import Effect as Effect
    from excite_cli.errors import ConfigError as ConfigError
    from excite_cli.errors import ExciteError as ExciteError
    from excite_cli.errors import FileError as FileError
    from excite_cli.errors import MissingExtraError as MissingExtraError
    from excite_cli.errors import NoAdmissibleMotionError as NoAdmissibleMotionError
    from excite_cli.errors import RobotError as RobotError
    from excite_cli.excitation.gradient_check import GradientCheck as GradientCheck
    from excite_cli.excitation.inspection import Inspection as Inspection
    from excite_cli.excitation.inspection import Inspections as Inspections
    from excite_cli.excitation.motion import Motion as Motion
    from excite_cli.excitation.problem import Problem as Problem
    from excite_cli.excitation.result import Comparison as Comparison
    from excite_cli.excitation.result import Result as Result
    from excite_cli.identification.carried_load import LoadIdentification as LoadIdentification
    from excite_cli.identification.fit import Fit as Fit
    from excite_cli.identification.identify import Identification as Identification
    from excite_cli.identification.stored_model import StoredFit as StoredFit
    from excite_cli.measurement.dataset import Dataset as Dataset
    from excite_cli.measurement.dataset import Run as Run
    from excite_cli.proposal.propose import Proposal as Proposal
    from excite_cli.robot.overview import DescribedRobot as DescribedRobot
    from excite_cli.scoring.changes import Change as Change
    from excite_cli.scoring.changes import Changes as Changes
    from excite_cli.scoring.forecast import Forecast as Forecast
    from excite_cli.scoring.records import Replay as Replay
    from excite_cli.scoring.records import Score as Score
    from excite_cli.scoring.records import ScoredRun as ScoredRun
    from excite_cli.scoring.records import SetPointReplay as SetPointReplay
    from excite_cli.scoring.thresholds import Thresholds as Thresholds
    from excite_cli.shown.answer import Answer as Answer
    from excite_cli.shown.note import Level as Level
    from excite_cli.shown.note import Note as Note
    from excite_cli.simulation.settings import SimulationSettings as SimulationSettings
    from excite_cli.simulation.simulate import Simulation as Simulation
    from excite_cli.study.records import CaseRecord as CaseRecord
    from excite_cli.study.selftest import Selftest as Selftest
    from excite_cli.study.selftest import SelftestCase as SelftestCase
    from excite_cli.trajectory.fade import Segment as Segment
    from excite_cli.workers.base import Workers as Workers
    from excite_cli.workers.context import open_workers as open_workers

__version__ = "0.2.0"

_HOMES = {
    "api.campaigning": ("run_campaign",),
    "api.changes": ("compare",),
    "api.checking": ("check",),
    "api.comparing": ("compare_random",),
    "api.diagnosing": ("diagnose", "save_config"),
    "api.exporting": ("Exported", "export_file"),
    "api.files": (
        "read_diagnosis",
        "read_fit",
        "read_result",
        "write_dataset",
        "write_diagnosis",
        "write_result",
    ),
    "api.forecasting": ("forecast",),
    "api.identifying": ("identify", "identify_load", "save_fit"),
    "api.inspecting": ("LogInspection", "inspect"),
    "api.load_planning": ("LoadProblem", "plan_load"),
    "api.loading": ("Case", "load_case", "load_data", "load_problem"),
    "api.model": ("Model",),
    "api.motions": ("load_motions", "motions_of"),
    "api.planning": ("plan", "plan_after"),
    "api.proposing": ("describe_robot", "propose", "save_proposal"),
    "api.replaying": ("replay",),
    "api.reporting": ("Report", "write_report"),
    "api.scoring": ("score", "thresholds"),
    "api.selftesting": ("selftest",),
    "api.simulating": ("simulate",),
    "api.studying": ("run_study",),
    "api.verifying": ("verify_gradient",),
    "api.viewing": ("Drawing", "Serving", "View", "draw_motion", "view_motions"),
    "campaign.measure": ("Measure", "NotMeasuredError", "Take"),
    "campaign.records": ("Campaign",),
    "config.spec": ("Spec",),
    "diagnosis.next_motion": ("NextMotion",),
    "diagnosis.records": ("Diagnosis", "NamedEffect"),
    "effects.base": ("Effect",),
    "excitation.gradient_check": ("GradientCheck",),
    "identification.stored_model": ("StoredFit",),
    "robot.overview": ("DescribedRobot",),
    "shown.answer": ("Answer",),
    "study.records": ("CaseRecord",),
    "study.selftest": ("Selftest", "SelftestCase"),
    "errors": (
        "ConfigError",
        "ExciteError",
        "FileError",
        "MissingExtraError",
        "NoAdmissibleMotionError",
        "RobotError",
    ),
    "excitation.inspection": ("Inspection", "Inspections"),
    "excitation.motion": ("Motion",),
    "excitation.problem": ("Problem",),
    "excitation.result": ("Comparison", "Result"),
    "identification.fit": ("Fit",),
    "identification.identify": ("Identification",),
    "identification.carried_load": ("LoadIdentification",),
    "measurement.dataset": ("Dataset", "Run"),
    "proposal.propose": ("Proposal",),
    "scoring.changes": ("Change", "Changes"),
    "scoring.forecast": ("Forecast",),
    "scoring.records": ("Replay", "Score", "ScoredRun", "SetPointReplay"),
    "scoring.thresholds": ("Thresholds",),
    "shown.note": ("Level", "Note"),
    "simulation.settings": ("SimulationSettings",),
    "simulation.simulate": ("Simulation",),
    "trajectory.fade": ("Segment",),
    "workers.base": ("Workers",),
    "workers.context": ("open_workers",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = ["__version__", *_HOME]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    """The public object `name`, imported from its package (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'excite_cli' has no attribute '{name}'")
    return getattr(import_module(f"excite_cli.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """Public names, also those that are not imported yet."""
    return sorted(__all__)
