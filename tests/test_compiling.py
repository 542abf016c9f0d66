"""Kernels are compiled by one process while the others wait."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from situp_annotate import compiling


@pytest.fixture
def trackers(monkeypatch, tmp_path):
    """Trackers that only count themselves, and a fresh place for the marker."""
    made = []

    class Counted:
        def __init__(self, params):
            made.append(self)

        def init(self, image, box):
            pass

        def update(self, image):
            pass

    monkeypatch.setattr(compiling, "SitupTracker", Counted)
    monkeypatch.setattr(compiling, "_marker", lambda: tmp_path / "cache" / "kernels.compiled")
    return made


def test_many_at_a_time_compile_once(trackers):
    assert not compiling.kernels_are_compiled()
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: compiling.compile_kernels(), range(8)))
    assert compiling.kernels_are_compiled()
    once = len(trackers)
    assert once > 0
    compiling.compile_kernels()
    assert len(trackers) == once


def test_a_failure_leaves_no_marker(trackers, monkeypatch):
    def fail(self, image):
        raise MemoryError

    monkeypatch.setattr(compiling.SitupTracker, "update", fail)
    with pytest.raises(MemoryError):
        compiling.compile_kernels()
    assert not compiling.kernels_are_compiled()


def test_the_marker_depends_on_the_sources(monkeypatch, tmp_path):
    before = compiling._marker()
    monkeypatch.setattr(compiling.numba, "__version__", "0.0")
    assert compiling._marker() != before
    assert compiling._marker().parent == before.parent
