"""Calls for the workers of a cluster, which find them here, and tricks to play on a worker."""

import genericpath
import importlib.metadata
import os
import signal
import time
from multiprocessing import parent_process

from situp_annotate.executors import report_frames

_exists, _version = genericpath.exists, importlib.metadata.version


def note_pid(file, pid):
    partial = file.with_suffix(".partial")
    partial.write_text(str(pid))
    partial.rename(file)


# ---- calls -------------------------------------------------------------------------------------


def square(number):
    return number * number


def fail():
    raise ValueError("no")


def end_by(number):
    os.kill(os.getpid(), number)


def linger(pid_file):
    """Be at the third of five frames, until somebody ends this."""
    note_pid(pid_file, os.getpid())
    report_frames(3, 5)
    time.sleep(600)


def be_alone(job, folder):
    """Fail if another call is between the same two lines."""
    (folder / job.id).mkdir()
    time.sleep(0.5)
    (folder / job.id).rmdir()
    return job


def meet(job, folder):
    """Wait until another call does the same."""
    (folder / job.id).touch()
    while len([*folder.glob("?")]) < 2:
        time.sleep(0.1)
    return job


def annotate_with_trouble(job, output, *arguments):
    """Crash at one video, and stop in the middle of another until somebody ends this."""
    from situp_annotate.batch.worker import annotate_job

    half_done = output / ".long.partial"
    if job.id == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if job.id == "long" and not half_done.exists():
        half_done.mkdir()
        (half_done / "labels.csv").write_text("frame,")
        note_pid(output / ".worker", parent_process().pid)
        time.sleep(600)
    return annotate_job(job, output, *arguments)


# ---- tricks ------------------------------------------------------------------------------------


def fail_oddly(call):
    """In the place of what runs a call: what Dask may do while it computes a lost result anew."""
    raise TypeError("odd")


def pretend_version(found):
    """Have another version of everything, or with None have nothing."""

    def pretended(name):
        if found is None:
            raise importlib.metadata.PackageNotFoundError(name)
        return found

    importlib.metadata.version = pretended


def pretend_blindness():
    """See no file."""
    genericpath.exists = lambda _path: False


def stop_pretending():
    genericpath.exists, importlib.metadata.version = _exists, _version


def dask_setup(_machine):
    """Called by a worker, or a scheduler, that preloads this module."""
    pretend_version("0.0.1")
