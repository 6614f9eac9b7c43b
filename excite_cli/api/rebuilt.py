"""The problem of a result, from the config that the result holds."""

from dataclasses import replace
from pathlib import Path

from excite_cli.config.load import load_spec, parse_spec
from excite_cli.errors import FileError
from excite_cli.excitation.admissible import worst_margins
from excite_cli.excitation.problem import Problem, build_problem
from excite_cli.excitation.result import Result, matches
from excite_cli.robot.description import is_named
from excite_cli.store.fit_knowledge import fit_knowledge


def with_own_margins(result: Result, problem: Problem) -> Result:
    """The result, with margins taken anew of motions that its own may not be of."""
    doubted = {motion.index: motion for motion in result.doubted()}
    motions = (
        replace(doubted[m.index], margins=worst_margins(problem, m.coefficients))
        if m.index in doubted
        else m
        for m in result.motions
    )
    return replace(result, motions=tuple(motions))


def rebuilt_problem(
    result: Result, config: str | Path | None = None, name: str = "the result"
) -> Problem:
    """The problem that `result` was made for; `config` says where relative paths start.

    Messages call the result `name`.

    Raises
    ------
    FileError
        The file holds no motion, its URDF is not found, or the robot is not the one it had.
    """
    if not result.motions:
        raise FileError(f"{name} holds no motion yet. Go on with `excite optimize --resume`.")
    spec = parse_spec(result.config, f"the config stored in {name}")
    folder = Path(result.config_folder)
    if config is not None:
        folder, given = Path(config).resolve().parent, load_spec(Path(config)).robot
        found = {name: getattr(given, name) for name in ("urdf", "package_dirs", "xacro_args")}
        spec = spec.model_copy(update={"robot": spec.robot.model_copy(update=found)})
    urdf = spec.robot.urdf
    if not is_named(urdf) and not (folder / urdf).is_file():
        raise FileError(
            f"{name} was made with the URDF {urdf}, and there is none at "
            f"{(folder / urdf).resolve()}. Relative paths start from the config: give the YAML "
            "file it was made with, --config CONFIG.yaml."
        )
    problem = build_problem(spec, folder, fit_knowledge(spec, folder))
    reason = matches(problem, result)
    if reason:
        raise FileError(
            f"{name} does not fit the robot that was found ({urdf}): {reason}. Give the YAML file "
            "it was made with, --config CONFIG.yaml, and the URDF as it was."
        )
    return problem
