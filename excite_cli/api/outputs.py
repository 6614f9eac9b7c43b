"""Where a command writes: refused before the work begins, not after it; and claimed.

A command claims its outputs until it ends (`check_outputs`, `claim_result`); a function of the
library holds them while it works (`held`, `held_result`).
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from excite_cli.claim import claim, leave
from excite_cli.claim import leave_claims as leave_claims
from excite_cli.errors import ConfigError, FileError
from excite_cli.given_files import refuse_inputs_as_outputs

Outputs = Mapping[str, str | Path | None]
Inputs = Iterable[str | Path]


def check_outputs(outputs: Outputs, overwrite: bool, inputs: Inputs = ()) -> None:
    """See that every output (by the name of its option) can be written, and none twice.

    They are then claimed by this process: another run on the same output is refused until it ends.

    Raises
    ------
    FileError
        An output is one of `inputs`, no regular file, or exists and may not be replaced; two have
        the same name; one is being written by another run, or its folder cannot be written to.
    """
    with ExitStack() as claims:
        _claim_each(outputs, overwrite, inputs, claims)
        claims.pop_all()  # good, so that none is left


@contextmanager
def held(outputs: Outputs, overwrite: bool, inputs: Inputs = ()) -> Iterator[None]:
    """As `check_outputs`, for as long as the work takes."""
    with ExitStack() as claims:
        _claim_each(outputs, overwrite, inputs, claims)
        yield


def _claim_each(outputs: Outputs, overwrite: bool, inputs: Inputs, claims: ExitStack) -> None:
    given = {option: Path(path) for option, path in outputs.items() if path is not None}
    refuse_inputs_as_outputs({f"--{option}": path for option, path in given.items()}, inputs)
    for path in given.values():
        claim_file(path)
        claims.callback(leave, path)
        if path.exists() and not overwrite:
            raise FileError(
                f"{path} exists already. Give another name, or replace it with --overwrite."
            )
    taken: dict[Path, str] = {}
    for option, path in given.items():
        other = taken.setdefault(path.resolve(), option)
        if other != option:
            raise FileError(f"--{other} and --{option} both name {path}. Give two names.")


def result_path(
    output: Path | None,
    config: Path,
    overwrite: bool,
    resume: bool = False,
    inputs: Inputs = (),
) -> Path:
    """Where the result of `config` goes; see `claim_result`."""
    path = output or Path(f"{config.stem}.h5")
    if path.is_file() and config.is_file() and path.samefile(config):
        from excite_cli.config.load import load_spec  # `excite --help` needs none

        load_spec(config)  # tells that this is no config
    claim_result(path, overwrite, resume, (config, *inputs))
    return path


@contextmanager
def held_result(path: Path | None, overwrite: bool, resume: bool, inputs: Inputs) -> Iterator[None]:
    """As `claim_result`, for as long as the work takes; nothing where there is no path."""
    if path is None:
        yield
        return
    claim_result(path, overwrite, resume, inputs)
    try:
        yield
    finally:
        leave(path)


def claim_result(path: Path, overwrite: bool, resume: bool = False, inputs: Inputs = ()) -> None:
    """Claim the file of a result, which may be gone on with.

    Raises
    ------
    ConfigError
        Both are requested.
    FileError
        It is one of `inputs`, exists already and nothing says to replace or resume it, another run
        is writing it, or it cannot be written.
    """
    if resume and overwrite:
        raise ConfigError("--resume goes on with the file, --overwrite replaces it: give one.")
    refuse_inputs_as_outputs({"--output": path}, inputs)
    claim_file(path)
    if path.exists() and not overwrite and not resume:
        leave(path)
        raise FileError(
            f"{path} exists already. Give another name with -o, go on with --resume, or replace "
            "it with --overwrite."
        )


def claim_file(path: Path) -> None:
    """Claim `path` for this process.

    Raises
    ------
    FileError
        It is no regular file, another run is writing it, or its folder cannot be written to.
    """
    if path.is_dir():
        raise FileError(f"{path} is a folder. Give a file name.")
    if path.exists() and not path.is_file():
        raise FileError(f"{path} is not a regular file. Give a file name.")
    claim(path)
