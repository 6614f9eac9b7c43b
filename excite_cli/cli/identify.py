"""`excite identify`: parameters of the declared model from measured data."""

from enum import StrEnum
from pathlib import Path

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import after_identify, next_step


class Load(StrEnum):
    """What --only finds."""

    PAYLOAD = "payload"


@options.command
def identify(
    terminal: Terminal,
    config: options.Config,
    data: options.Data,
    output: Path | None = options.written("--output", "-o", help="File for the fit (HDF5)."),
    urdf: Path | None = options.written("--urdf", help="Write the URDF with what was identified."),
    mjcf: Path | None = options.written("--mjcf", help="Write a MuJoCo model of it (MJCF)."),
    parameters: Path | None = options.written("--parameters", help="Write all parameters (YAML)."),
    held_out: options.HeldOut = None,
    only: Load | None = typer.Option(
        None, "--only", help="Find what the robot carries, on top of --fit."
    ),
    fit: Path | None = typer.Option(
        None, "--fit", help="Fit of the robot alone, for --only payload."
    ),
    link: options.Link = None,
    ur: Path | None = options.written(
        "--ur", metavar="FILE.script", help="Write the payload as URScript (Universal Robots)."
    ),
    franka: Path | None = options.written(
        "--franka", metavar="FILE.json", help="Write the payload for Franka's Desk (JSON)."
    ),
    workers: options.Workers = 1,
    scheduler: options.Scheduler = None,
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
) -> None:
    """Find the parameters of the declared model, with their standard deviations.

    Base parameters and those of the declared effects are fitted to all runs but the held-out
    one, on which the errors are measured. A single run is cut into blocks, of which every third is
    held out. --workers split the runs; the results are identical.

    With --only payload, mass, centre and inertia of what the robot carries are found from all runs,
    on top of the fit of the bare robot and its uncertainty. --ur or --franka writes them for the
    robot's controller, in the frame of the tool flange (link tool0, link8; another with --link).
    Exit status 1: they are physically infeasible.

    Examples:
      excite identify ur10.yaml measured.h5 -o fit.h5
      excite identify ur10.yaml measured.h5 --held-out motion_1 --urdf new.urdf
      excite identify ur10.yaml loaded.h5 --only payload --fit fit.h5
    """
    from excite_cli.api.identifying import identification_answer, identify_load, load_answer
    from excite_cli.api.identifying import identify as identify_data
    from excite_cli.api.loading import load_case
    from excite_cli.api.working import working
    from excite_cli.errors import ConfigError

    formats = {"ur": ur, "franka": franka}
    models = {"urdf": urdf, "mjcf": mjcf, "parameters": parameters}
    if only is not None:
        given = {"-o": output, "--held-out": held_out}
        given |= {f"--{k}": each for k, each in models.items()}
        others = [name for name, each in given.items() if each is not None]
        if others:
            raise ConfigError(f"--only payload takes no {', '.join(others)}: leave it out.")
        if fit is None:
            raise ConfigError("--only payload needs --fit: a fit of the robot without it.")
        with terminal.live("identify"):
            case = load_case(config, overrides or ())
            load = identify_load(
                case, data, fit, link, **formats, overwrite=overwrite, tell=terminal.tell
            )
        rest = ("--only", "payload", "--fit", fit, "--ur", "payload.script")
        words = "write it for a controller of UR (of Franka: --franka)"
        kept = any(formats.values()) or not load.possible
        following = () if kept else next_step(words, "identify", config, *data, *rest)
        terminal.show(load_answer(load, formats), following)
        return
    given = {"--fit": fit, "--link": link, "--ur": ur, "--franka": franka}
    if any(each is not None for each in given.values()):
        raise ConfigError("--fit, --link, --ur and --franka belong to --only payload.")
    with (
        working(workers, scheduler, 1, terminal.tell) as place,
        terminal.live("identify") as line,
    ):
        found = identify_data(
            load_case(config, overrides or ()),
            data,
            held_out,
            output=output,
            urdf=urdf,
            mjcf=mjcf,
            parameters=parameters,
            overwrite=overwrite,
            workers=place,
            progress=line,
            tell=terminal.tell,
        )
    lacking = any(each.kind == "much_left" for each in found.findings)
    following = after_identify(lacking, config, data, output)
    terminal.show(identification_answer(found, {"fit": output, **models}), following)
