"""Tasks on a dask cluster: same answers as in processes, lost workers, what cannot work."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from excite_cli import identify, load_problem, plan, simulate
from excite_cli.errors import ConfigError, MissingExtraError, NoAdmissibleMotionError
from excite_cli.kernels import compiled as kernels
from excite_cli.workers.base import News
from excite_cli.workers.cluster import Cluster, ClusterError, environment
from tests.api.conftest import SMOKE
from tests.api.test_same_answers import same
from tests.workers import work

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def scheduler() -> Iterator[object]:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, dashboard_address=":0"
    ) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def cluster(scheduler: object) -> Iterator[Cluster]:
    warnings: list[str] = []
    with Cluster(scheduler.scheduler_address, warn=warnings.append) as found:  # type: ignore[attr-defined]
        assert warnings == [], "a process of this machine rounds as this one does"
        yield found


def test_results_and_failures_are_those_of_processes(cluster: Cluster) -> None:
    heard: list[News] = []
    assert cluster.count == 2
    assert cluster.map(work.square, 10, [0, 1, 2], heard.append) == [10, 11, 14]
    assert [news.done for news in heard] == [1, 2, 3]
    with pytest.raises(ConfigError, match="task 1 is wrong"):
        cluster.map(work.fails, 1, [0, 1, 2])
    with pytest.raises(NoAdmissibleMotionError, match="no way"):
        cluster.map(work.long_winded, 0, [1])
    kept = cluster.map(work.fails, 1, [0, 1, 2], keep_failures=True)
    assert [type(each) for each in kept] == [int, ConfigError, ConfigError]


def test_a_lost_worker_costs_its_task_a_second_try(cluster: Cluster, tmp_path: Path) -> None:
    assert set(cluster.map(work.threads, 0, [1])[0]) == {1}
    assert cluster.map(work.dies_once, str(tmp_path), [2]) == [4]


def test_a_worker_with_other_versions_is_refused_and_one_that_rounds_otherwise_is_named(
    scheduler: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = scheduler.scheduler_address  # type: ignore[attr-defined]
    warnings: list[str] = []
    monkeypatch.setattr("excite_cli.workers.cluster.rounding", lambda: "something else")
    Cluster(address, warn=warnings.append).close()
    assert "rounds in another way" in warnings[0]
    monkeypatch.setattr(kernels, "KERNELS", None)
    others = {**environment.__wrapped__(), "Python": "2.7"}
    monkeypatch.setattr("excite_cli.workers.cluster.environment", lambda: others)
    with pytest.raises(ClusterError, match=r"other versions.*Python 2\.7 here, 3.*kernels numpy"):
        Cluster(address)


def test_no_scheduler_is_said_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("excite_cli.workers.cluster._ANSWER", 0.3)
    with pytest.raises(ClusterError, match=r"no dask scheduler answers.*dask scheduler"):
        Cluster("tcp://127.0.0.1:9")
    with pytest.raises(ClusterError, match=r"looks like tcp://host:8786"):
        Cluster("somewhere")


def test_a_missing_library_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"excite-cli\[cluster\]"):
        Cluster("tcp://127.0.0.1:9")


@pytest.mark.long
def test_runs_are_identified_on_a_cluster_as_here(cluster: Cluster, tmp_path: Path) -> None:
    problem = load_problem(SMOKE, ["optimizer.max_iterations=5", "sequence.motions=2"])
    data = tmp_path / "data.h5"
    simulate(problem, plan(problem), output=data)
    assert same(identify(problem, data), identify(problem, data, workers=cluster))
