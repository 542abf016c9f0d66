"""Many machines: a cluster of worker processes, some of which do not live long."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import psutil
import pytest
from distributed import Client, LocalCluster
from filelock import FileLock
from support import on_cluster
from support.media import write_video

from situp_annotate.batch import annotate_batch, scheduling
from situp_annotate.errors import (
    DiskError,
    SitupError,
    VideoStalledError,
    VideoTimeoutError,
    WorkerKilledError,
    WorkerLostError,
)
from situp_annotate.executors import CallLimits, dask_cluster, dask_executor
from situp_annotate.executors.dask_call import ClusterCall, frames_by_call, run_call
from situp_annotate.executors.dask_executor import DaskExecutor
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Keyframe, Track, VideoJob

RECIPE = load_recipe("csv_only")
WARM = ("situp_annotate.batch.warm",)


def start_cluster(workers):
    return LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0"
    )


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Two workers that have forked a process each, and will be quick to fork others."""
    folder = tmp_path_factory.mktemp("first")
    with start_cluster(2) as made:
        with DaskExecutor(made.scheduler_address, folder, preload=WARM) as executor:
            meeting = [
                executor.submit(on_cluster.meet, job_of(folder / name), folder) for name in "ab"
            ]
            assert [future.result().id for future in meeting] == ["a", "b"]
        yield made


@pytest.fixture
def executor(cluster, tmp_path):
    with DaskExecutor(cluster.scheduler_address, tmp_path, preload=WARM) as made:
        yield made
        made.shutdown(cancel_futures=True)


def job_of(path):
    track = Track(1, "thing", (Keyframe(0, BoundingBox(8, 8, 24, 24)),))
    return VideoJob(path.stem, path, (track,))


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    return [job_of(write_video(folder / f"{n}.mp4", count=10 + n)) for n in range(12)]


def pids_of(cluster):
    return {nanny.pid for nanny in cluster.workers.values()}


def wait_until(holds):
    for _ in range(600):
        if holds():
            return
        time.sleep(0.1)
    pytest.fail("this never came")


def is_over(pid):
    try:
        return psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def pid_in(file):
    wait_until(file.exists)
    return int(file.read_text())


def started(command):
    path = os.pathsep.join(sys.path)
    return subprocess.Popen(command, env={**os.environ, "PYTHONPATH": path})


def calls_at(cluster):
    with Client(cluster, set_as_default=False) as client:
        return [call for calls in client.run(frames_by_call).values() for call in calls]


def labels(output):
    return {str(path.relative_to(output)): path.read_bytes() for path in output.rglob("*.csv")}


def hidden(output):
    return {path.name for path in output.rglob(".*")}


# ---- the batch ---------------------------------------------------------------------------------


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a batch in which the videos "crash" and "long" make trouble."""
    output = tmp_path / "out"

    def run_batch(cluster, jobs, on_progress=None):
        executor = DaskExecutor(cluster.scheduler_address, output, preload=WARM)
        with monkeypatch.context() as patch:
            patch.setattr(scheduling, "annotate_job", on_cluster.annotate_with_trouble)
            return annotate_batch(jobs, output, RECIPE, executor=executor, on_progress=on_progress)

    return run_batch


def renamed(job, id_):
    return replace(job, id=id_)


def test_all_videos_complete_though_one_of_two_workers_is_killed_midway(
    run, cluster, jobs, tmp_path
):
    jobs = [*jobs[:5], renamed(jobs[5], "long"), *jobs[6:]]
    annotate_batch(jobs, tmp_path / "local", RECIPE, executor="serial")
    before, at_long = pids_of(cluster), tmp_path / "out" / ".worker"

    def kill_midway(progress):
        if progress.videos_done >= 3 and at_long.exists():
            os.kill(int(at_long.read_text()), signal.SIGKILL)
            at_long.unlink()

    report = run(cluster, jobs, kill_midway)
    assert report.counts == {"succeeded": 12, "failed": 0, "left": 0}
    assert pids_of(cluster) != before
    assert labels(tmp_path / "out") == labels(tmp_path / "local")
    assert hidden(tmp_path / "out") == {".cache", ".run"}
    assert not (tmp_path / "out" / ".run" / "videos").exists()


def test_a_video_that_crashes_its_process_is_one_failure_and_workers_live(run, cluster, jobs):
    before = pids_of(cluster)
    report = run(cluster, [jobs[0], renamed(jobs[1], "crash"), jobs[2]])
    assert [(failure.id, failure.kind) for failure in report.failures] == [("crash", "crashed")]
    assert report.counts == {"succeeded": 2, "failed": 1, "left": 0}
    assert pids_of(cluster) == before


def test_interruption_ends_all_processes_and_keeps_what_is_complete(run, cluster, jobs, tmp_path):
    at_long = tmp_path / "out" / ".worker"

    def interrupt(progress):
        if progress.videos_done == 1 and at_long.exists():
            at_long.unlink()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(cluster, [renamed(jobs[0], "long"), jobs[1]], interrupt)
    assert calls_at(cluster) == []
    assert (tmp_path / "out" / jobs[1].id / "labels.csv").exists()
    assert hidden(tmp_path / "out") == {".cache", ".run"}


def test_a_batch_ends_when_the_scheduler_is_gone(run, jobs, tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 1)
    with start_cluster(1) as small:

        def close(progress):
            if progress.videos_done == 1:
                small.close()

        with pytest.raises(SitupError, match="scheduler is gone"):
            run(small, jobs, close)
    left = json.loads((tmp_path / "out" / "batch.json").read_text())
    assert (left["interrupted"], left["succeeded"], left["failed"]) == (True, 1, 0)


# ---- calls -------------------------------------------------------------------------------------


def test_results_and_exceptions_come_through_futures(executor):
    futures = [executor.submit(on_cluster.square, number) for number in range(4)]
    assert [future.result() for future in futures] == [0, 1, 4, 9]
    with pytest.raises(ValueError, match="no"):
        executor.submit(on_cluster.fail).result()


def test_capacity_follows_the_workers_that_there_are(tmp_path):
    with start_cluster(1) as small, DaskExecutor(small.scheduler_address, tmp_path) as executor:
        assert executor.capacity == 1
        small.scale(2)
        wait_until(lambda: executor.capacity == 2)


def test_progress_of_a_call_is_known(executor, tmp_path):
    future = executor.submit(on_cluster.linger, tmp_path / "pid")
    wait_until(lambda: executor.frames(future) == (3, 5))


def test_relative_paths_mean_the_same_on_every_machine(executor, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    job = executor.submit(on_cluster.be_alone, job_of(Path("a.mp4")), Path()).result()
    assert job.path == tmp_path / "here" / "a.mp4"


def test_limits_hold_on_every_machine(cluster, tmp_path):
    for limits, error in (
        (CallLimits(timeout_s=0.5), VideoTimeoutError),
        (CallLimits(stall_s=0.5), VideoStalledError),
    ):
        with DaskExecutor(cluster.scheduler_address, tmp_path, limits, WARM) as executor:
            future = executor.submit(on_cluster.linger, tmp_path / "pid")
            with pytest.raises(error):
                future.result()


def test_a_killed_process_is_named(executor):
    with pytest.raises(WorkerKilledError, match="SIGKILL"):
        executor.submit(on_cluster.end_by, signal.SIGKILL).result()


def test_errors_of_dask_itself_mean_a_lost_worker(executor, monkeypatch):
    monkeypatch.setattr(dask_executor, "run_call", on_cluster.fail_oddly)
    with pytest.raises(WorkerLostError, match="odd"):
        executor.submit(on_cluster.square, 2).result()


def test_two_calls_for_one_video_wait_for_each_other(executor, tmp_path):
    job = job_of(tmp_path / "a.mp4")
    futures = [executor.submit(on_cluster.be_alone, job, tmp_path) for _ in range(4)]
    assert [future.result() for future in futures] == [job] * 4


def test_calls_for_different_videos_run_side_by_side(executor, tmp_path):
    jobs = [job_of(tmp_path / "a.mp4"), job_of(tmp_path / "b.mp4")]
    futures = [executor.submit(on_cluster.meet, job, tmp_path) for job in jobs]
    assert [future.result() for future in futures] == jobs


def test_limits_do_not_count_the_wait_for_another_call(cluster, tmp_path):
    limits, lock = CallLimits(stall_s=2), tmp_path / ".run" / "videos" / "a.lock"
    with DaskExecutor(cluster.scheduler_address, tmp_path, limits, WARM) as executor:
        lock.parent.mkdir(parents=True)
        with FileLock(lock):
            job = job_of(tmp_path / "a.mp4")
            future = executor.submit(on_cluster.be_alone, job, tmp_path)
            wait_until(lambda: calls_at(cluster))
            time.sleep(3)
        assert future.result() == job


def test_a_cancelled_call_is_ended(executor, tmp_path):
    future = executor.submit(on_cluster.linger, tmp_path / "pid")
    pid = pid_in(tmp_path / "pid")
    assert future.cancel()
    wait_until(lambda: is_over(pid))


def test_calls_of_a_client_that_is_killed_are_ended(cluster, tmp_path):
    script = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from situp_annotate.executors.dask_executor import DaskExecutor\n"
        "from support.on_cluster import linger\n"
        "folder = Path(sys.argv[2])\n"
        "DaskExecutor(sys.argv[1], folder).submit(linger, folder / 'pid').result()\n"
    )
    command = [sys.executable, "-c", script, cluster.scheduler_address, str(tmp_path)]
    with started(command) as client:
        pid = pid_in(tmp_path / "pid")
        client.kill()
    wait_until(lambda: is_over(pid))


# ---- clusters that cannot be used ---------------------------------------------------------------


def test_a_scheduler_without_this_package_is_refused(tmp_path):
    at = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0"]
    options = ["--no-dashboard", "--preload", "support.on_cluster", "--scheduler-file", str(at)]
    with started([*command, *options]) as scheduler:
        wait_until(at.exists)
        address = json.loads(at.read_text())["address"]
        with pytest.raises(SitupError, match=r"Dask scheduler .* has version 0\.0\.1"):
            DaskExecutor(address, tmp_path)
        scheduler.kill()


@contextmanager
def one_worker_pretends(cluster, trick, *arguments):
    worker = next(iter(cluster.scheduler_info["workers"]))
    with Client(cluster, set_as_default=False) as client:
        client.run(trick, *arguments, workers=[worker])
        yield worker
        client.run(on_cluster.stop_pretending, workers=[worker])


@pytest.mark.parametrize(("found", "words"), [("0.0.1", "has version 0.0.1"), (None, "no version")])
def test_another_version_is_refused(cluster, tmp_path, found, words):
    with one_worker_pretends(cluster, on_cluster.pretend_version, found) as worker:
        with pytest.raises(SitupError, match=words) as caught:
            DaskExecutor(cluster.scheduler_address, tmp_path)
        assert worker in str(caught.value)


def test_a_worker_with_another_disk_is_refused(cluster, tmp_path):
    with one_worker_pretends(cluster, on_cluster.pretend_blindness) as worker:
        with pytest.raises(SitupError, match="does not see this folder") as caught:
            DaskExecutor(cluster.scheduler_address, tmp_path / "out")
        assert worker in str(caught.value)
        assert [*(tmp_path / "out").iterdir()] == []


def test_a_worker_that_joins_and_cannot_be_used_ends_all_calls(tmp_path):
    with start_cluster(1) as small, DaskExecutor(small.scheduler_address, tmp_path) as executor:
        future = executor.submit(on_cluster.linger, tmp_path / "pid")
        small.new_spec["options"]["preload"] = ["support.on_cluster"]
        small.scale(2)
        with pytest.raises(SitupError, match=r"has version 0\.0\.1"):
            future.result()
        with pytest.raises(SitupError, match=r"has version 0\.0\.1"):
            executor.submit(on_cluster.square, 2)


def test_an_output_folder_that_cannot_be_made_is_refused(cluster, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(DiskError, match="out"):
        DaskExecutor(cluster.scheduler_address, tmp_path / "file" / "out")


def test_a_call_on_a_machine_without_the_shared_disk_is_an_error_there(tmp_path):
    lock = tmp_path / "nowhere" / "a.lock"
    call = ClusterCall("1", on_cluster.square, (2,), lock, CallLimits(), ())
    with pytest.raises(FileNotFoundError, match="nowhere"):
        run_call(call)
    assert not lock.parent.exists()


def test_what_is_no_scheduler_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 1)
    with HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with pytest.raises(SitupError, match="no Dask scheduler answers here"):
            DaskExecutor(f"tcp://127.0.0.1:{server.server_port}", tmp_path)
        server.shutdown()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "127.0.0.1:1", "nowhere", "what://is:1"])
def test_a_scheduler_that_does_not_answer_is_an_error(address, tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 1)
    with pytest.raises(SitupError, match="no Dask scheduler answers here") as caught:
        DaskExecutor(address, tmp_path)
    assert str(caught.value).startswith(address)


def test_a_cluster_without_workers_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 1)
    with start_cluster(0) as empty, pytest.raises(SitupError, match="has no workers"):
        DaskExecutor(empty.scheduler_address, tmp_path)


def test_a_cluster_that_stays_without_workers_ends_all_calls(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_PATIENCE_S", 1)
    with start_cluster(1) as small, DaskExecutor(small.scheduler_address, tmp_path) as executor:
        future = executor.submit(on_cluster.linger, tmp_path / "pid")
        small.scale(0)
        with pytest.raises(SitupError, match="has had no workers for 1 s"):
            future.result()


def test_dask_that_is_not_installed_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SitupError, match=r"pip install 'situp-annotate\[dask\]'"):
        DaskExecutor("tcp://127.0.0.1:1", tmp_path)
