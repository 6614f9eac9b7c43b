"""Motions played on a robot that differs from its model: `excite simulate`."""

from collections.abc import Sequence

from excite_cli.api.loading import Case
from excite_cli.api.motions import Motions, load_motions
from excite_cli.effects.catalogue import declared_effects
from excite_cli.excitation.problem import Problem
from excite_cli.simulation.planned_motion import PlannedMotion
from excite_cli.simulation.planted import parse_planted
from excite_cli.simulation.settings import SimulationSettings
from excite_cli.simulation.simulate import Simulation, run_names
from excite_cli.simulation.simulate import simulate as simulate_motions


def simulate(
    problem: Problem | Case,
    motions: Motions,
    effects: Sequence[str] = (),
    settings: SimulationSettings = SimulationSettings(),
    *,
    declared: bool = True,
) -> Simulation:
    """Play motions on a MuJoCo robot that differs from its model: `excite simulate`.

    `effects` are put into the robot, as `kind@joint=value[,name:value…]`; with `declared` those of
    the config too, in sizes of their own. The `dataset` of what is returned is as if measured,
    `truth` what was in the robot, `tracking` the RMS error of each run (n,) in rad.

    Raises
    ------
    ConfigError, RobotError, MissingExtraError
        An effect cannot be read; the robot cannot be simulated; MuJoCo is missing.
    """
    segments = load_motions(problem, motions)
    planned = [PlannedMotion(each.name, each.trajectory, each.coefficients) for each in segments]
    names = [name for takes in run_names(planned, settings.repeat) for name in takes]
    planted = [p for text in effects for p in parse_planted(text, problem.robot, names)]
    own = declared_effects(problem.spec.effects, problem.robot) if declared else ()
    return simulate_motions(problem.robot, planned, settings, planted, own)
