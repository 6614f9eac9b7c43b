"""`excite identify`: parameters of the declared model from measured data."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.api.outputs import check_outputs
from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT


def identify(
    config: options.Config,
    data: options.Data,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File for the fit (HDF5).", rich_help_panel=OUTPUT),
    ] = None,
    urdf: Annotated[
        Path | None,
        typer.Option(
            "--urdf", help="Write the URDF with what was identified.", rich_help_panel=OUTPUT
        ),
    ] = None,
    mjcf: Annotated[
        Path | None,
        typer.Option("--mjcf", help="Write a MuJoCo model of it (MJCF).", rich_help_panel=OUTPUT),
    ] = None,
    parameters: Annotated[
        Path | None,
        typer.Option("--parameters", help="Write all parameters (YAML).", rich_help_panel=OUTPUT),
    ] = None,
    sealed: options.Sealed = None,
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Find the parameters of the declared model, with what they are worth.

    Base parameters and those of the declared effects are fitted to all runs but the sealed one, on
    which the errors are measured. A single run is cut into blocks, of which every third is sealed.

    Examples:
      excite identify ur10.yaml measured.h5 -o fit.h5
      excite identify ur10.yaml measured.h5 --sealed motion_1 --urdf identified.urdf
    """
    from excite_cli.api.loading import load_case, load_data, tell_findings
    from excite_cli.cli.identify_tables import answer_of, tables_of
    from excite_cli.cli.models import write_models
    from excite_cli.cli.setup import single_threaded
    from excite_cli.config.load import load_spec, spec_as_yaml
    from excite_cli.diagnosis.plausibility import check_dataset
    from excite_cli.dynamics.base_parameters import find_base_parameters
    from excite_cli.identification.identify import identify as run_identification
    from excite_cli.robot.model import build_robot
    from excite_cli.store.fit_file import write_fit

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    exports = {"urdf": urdf, "mjcf": mjcf, "parameters": parameters}
    check_outputs({"output": output, **exports}, overwrite)
    with single_threaded():
        spec = load_spec(config, overrides)
        folder = config.resolve().parent
        robot = build_robot(spec.robot, folder)
        base = find_base_parameters(robot)
        dataset = load_data(load_case(config, overrides or ()), data, terminal.tell)
        check_dataset(robot, dataset, spec)
        with terminal.live("identify") as show:
            found = run_identification(
                robot, base, dataset, spec, sealed, lambda text: show(text, 0)
            )
        for reason in found.processing.reasons:
            terminal.detail(reason)
        notes: list[str] = []
        if output is not None:
            sources = tuple(map(str, data))
            fingerprint = robot.fingerprint()
            write_fit(output, found, spec_as_yaml(spec), str(folder), fingerprint, sources)
        notes += write_models(robot, found.fit, urdf, mjcf, parameters)
    tell_findings(found.findings[len(dataset.findings) :], terminal.tell)
    for note in notes:
        terminal.say(f"note: {note}")
    files = {"fit": output, **exports}
    written = {key: str(path) for key, path in files.items() if path is not None}
    terminal.answer(tables_of(found, robot), {**answer_of(found), "output": written})
