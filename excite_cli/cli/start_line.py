"""The progress line of motions that are being optimised, their starts one or many."""

from collections.abc import Callable

from excite_cli.cli.best_so_far import Best
from excite_cli.config.spec import Spec
from excite_cli.excitation.progress import Progress, ProgressCallback


def iterations_of(spec: Spec) -> int:
    """The most that all starts of one motion take."""
    return spec.optimizer.max_iterations * spec.optimizer.restarts


def start_line(show: Callable[[str, int], None], spec: Spec) -> Callable[[int], ProgressCallback]:
    """What `continue_run` reports to, shown with `show(text, iterations done)`."""
    total, most = spec.sequence.motions, spec.optimizer.max_iterations

    def report(index: int) -> ProgressCallback:
        best = Best()

        def tell(progress: Progress) -> None:
            words = f"motion {index} of {total}: {best.words(progress)}, "
            starts = progress.starts
            if starts is None:
                show(f"{words}iteration {progress.iteration} of {most}", progress.iteration)
            else:
                words += f"{starts.done} of {starts.total} starts done, {starts.running} running"
                show(words, starts.iterations)

        return tell

    return report
