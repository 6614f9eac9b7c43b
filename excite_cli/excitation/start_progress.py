"""What is reported while the starts of a motion run, by one or several workers."""

from dataclasses import replace

from excite_cli.excitation.one_start import FoundMotion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.progress import Progress, ProgressCallback, Stage, Starts
from excite_cli.workers.base import News, Watch


def followed(report: ProgressCallback, problem: Problem, starts: int) -> Watch:
    """Pass on what starts tell; where there are several, with how many of them are done."""
    most = problem.spec.optimizer.max_iterations
    iterations = [0] * starts

    def watch(news: News) -> None:
        told: Progress | None = news.word
        if isinstance(news.result, FoundMotion):  # its last point keeps all limits
            count = news.result.outcome.iterations
            told = Progress(count, news.result.figure, 0.0, news.result.seconds, Stage())
            iterations[news.index] = most
        elif told is not None:
            iterations[news.index] = min(told.iteration, most)
        if told is None or (starts == 1 and news.result is not None):
            return
        if starts > 1:
            total = sum(iterations)
            told = replace(told, starts=Starts(news.done, news.running, starts, total))
        report(told)

    return watch
