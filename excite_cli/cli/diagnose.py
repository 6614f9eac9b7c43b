"""`excite diagnose`: what the declared model lacks, and the error before and after."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from excite_cli.api.outputs import check_outputs
from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT

if TYPE_CHECKING:
    from excite_cli.config.spec import Spec
    from excite_cli.diagnosis.records import Diagnosis


def diagnose(
    config: options.Config,
    data: options.Data,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="File for the diagnosis (HDF5).", rich_help_panel=OUTPUT
        ),
    ] = None,
    sealed: options.Sealed = None,
    apply: Annotated[
        Path | None,
        typer.Option(
            "--apply",
            metavar="NEW.yaml",
            help="Write the config with what was found.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Find what the declared model lacks: friction, springs, payloads, delays and more.

    The declared model is fitted to all runs but the sealed one; its residual is traced to named
    effects, with their size, certainty, and what these data cannot tell them from. The sealed run
    is used once, for the error before and after. A single run is cut into blocks, every third
    sealed.

    Examples:
      excite diagnose ur10.yaml measured.h5 -o diagnosis.h5 --apply better.yaml
    """
    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    check_outputs({"output": output, "apply": apply}, overwrite)

    from dataclasses import replace

    from excite_cli.api.loading import load_case, load_data
    from excite_cli.cli.diagnose_tables import answer_of, tables_of
    from excite_cli.cli.setup import single_threaded
    from excite_cli.config.load import load_spec, spec_as_yaml
    from excite_cli.diagnosis.diagnose import diagnose as run_diagnosis
    from excite_cli.diagnosis.next_motion import next_experiment
    from excite_cli.dynamics.base_parameters import find_base_parameters
    from excite_cli.robot.model import build_robot
    from excite_cli.store.diagnosis_file import write_diagnosis
    from excite_cli.store.versions import versions

    with single_threaded():
        spec = load_spec(config, overrides)
        folder = config.resolve().parent
        robot = build_robot(spec.robot, folder)
        base = find_base_parameters(robot)
        dataset = load_data(load_case(config, overrides or ()), data, terminal.tell)
        with terminal.live("diagnose", 10) as show:
            found = run_diagnosis(robot, base, dataset, spec, sealed, show)
        found = replace(
            found, config=spec_as_yaml(spec), config_folder=str(folder), versions=versions()
        )
        if output is not None:
            write_diagnosis(output, found)
        if apply is not None:
            _apply(spec, folder, found, apply)
    experiment = next_experiment(found, str(config), str(output or "DIAGNOSIS.h5"))
    written = {key: str(path) for key, path in (("diagnosis", output), ("config", apply)) if path}
    terminal.answer(
        tables_of(found, robot, experiment, verbose),
        {**answer_of(found, experiment), "output": written},
    )


def _apply(spec: "Spec", folder: Path, found: "Diagnosis", path: Path) -> None:
    """Write the config with declared and found effects, atomically."""
    from excite_cli.atomic import write_atomically
    from excite_cli.export.found_config import found_config

    text = found_config(spec, folder, found, path)

    def write(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8")

    write_atomically(path, write)
