"""Where results go: refused before the work begins, not after it; and held while it lasts.

Claims are counted: a command whose problem takes long to build holds its outputs before that, and
the function that it calls once more.
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


@contextmanager
def held(outputs: Outputs, overwrite: bool, inputs: Inputs = ()) -> Iterator[None]:
    """See that every output (by the name of its option) can be written, and none twice.

    Within it they are claimed by this process: another run on the same output is refused.

    Raises
    ------
    FileError
        An output is one of `inputs`, no regular file, or exists and may not be replaced; two have
        the same name; one is being written by another run, or its folder cannot be written to.
    """
    with ExitStack() as claims:
        _claim_each(outputs, overwrite, inputs, claims)
        yield


def _claim_each(outputs: Outputs, overwrite: bool, inputs: Inputs, claims: ExitStack) -> None:
    given = {option: Path(path) for option, path in outputs.items() if path is not None}
    refuse_inputs_as_outputs({f"--{option}": path for option, path in given.items()}, inputs)
    for path in given.values():
        _claim_file(path)
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


def result_path(output: Path | None, config: Path) -> Path:
    """Where the result of `config` goes."""
    path = output or Path(f"{config.stem}.h5")
    if path.is_file() and config.is_file() and path.samefile(config):
        from excite_cli.config.load_spec import load_spec  # `excite --help` needs none

        load_spec(config)  # tells that this is no config
    return path


@contextmanager
def held_result(path: Path | None, overwrite: bool, resume: bool, inputs: Inputs) -> Iterator[None]:
    """Hold the file of a result, which may be gone on with; nothing where there is no path.

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
    if path is None:
        yield
        return
    refuse_inputs_as_outputs({"--output": path}, inputs)
    _claim_file(path)
    try:
        if path.exists() and not overwrite and not resume:
            raise FileError(
                f"{path} exists already. Give another name with -o, go on with --resume, or "
                "replace it with --overwrite."
            )
        yield
    finally:
        leave(path)


def _claim_file(path: Path) -> None:
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
