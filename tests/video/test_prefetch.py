"""Reading ahead: the same frames, errors in their place, and a thread that ends."""

import threading
import time

import numpy as np
import pytest
from support.media import write_video

from situp_annotate.types import Frame
from situp_annotate.video import VideoFootage
from situp_annotate.video.prefetch import reading_ahead


class Source:
    """Frames that count how many were taken, and note in which thread."""

    def __init__(self, count, *, fails_at=None, nbytes=100):
        self.taken = 0
        self.threads = set()
        self._count = count
        self._fails_at = fails_at
        self._image = np.zeros((1, nbytes), np.uint8)

    def __iter__(self):
        return self

    def __next__(self):
        self.threads.add(threading.get_ident())
        if self.taken == self._fails_at:
            raise ArithmeticError("broken here")
        if self.taken >= self._count:
            raise StopIteration
        self.taken += 1
        return Frame(self.taken - 1, self.taken, self._image)


def settle(source):
    """Wait until nothing more is taken."""
    before = -1
    while source.taken != before:
        before = source.taken
        time.sleep(0.05)
    return source.taken


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("count", [0, 1, 200])
def test_all_frames_come_in_order(threads, count):
    source = Source(count)
    with reading_ahead(source, threads) as frames:
        assert [frame.index for frame in frames] == list(range(count))
    assert (source.threads == {threading.get_ident()}) == (threads == 1)


@pytest.mark.parametrize(("nbytes", "ahead"), [(1000, 64), (4 * 2**20, 8), (100 * 2**20, 1)])
def test_how_far_ahead_depends_on_the_size(nbytes, ahead):
    source = Source(100, nbytes=nbytes)
    with reading_ahead(source, 2) as frames:
        next(frames)
        assert settle(source) == 1 + ahead


def test_one_thread_takes_nothing_ahead():
    source = Source(100)
    with reading_ahead(source, 1) as frames:
        next(frames)
        assert source.taken == 1


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_comes_in_its_place(threads):
    seen = []

    def take(frames):
        for frame in frames:
            seen.append(frame.index)  # noqa: PERF401 - what came before the error counts

    with (
        pytest.raises(ArithmeticError, match="broken here"),
        reading_ahead(Source(9, fails_at=5), threads) as frames,
    ):
        take(frames)
    assert seen == [0, 1, 2, 3, 4]


def test_leaving_early_ends_the_thread():
    before = threading.active_count()
    source = Source(10_000)
    with reading_ahead(source, 2) as frames:
        next(frames)
        assert threading.active_count() == before + 1
    assert threading.active_count() == before
    assert settle(source) <= 1 + 64


def test_an_error_of_the_reader_ends_the_thread():
    before = threading.active_count()
    with pytest.raises(ZeroDivisionError), reading_ahead(Source(10_000), 2) as frames:
        next(frames)
        raise ZeroDivisionError
    assert threading.active_count() == before


def test_footage_gives_the_same_frames(tmp_path):
    clip = write_video(tmp_path / "clip.mp4", count=90)
    walks = []
    for threads in (1, 2):
        with VideoFootage(clip, threads=threads) as footage:
            walks.append([(f.index, f.pts_ns, f.image.tobytes()) for f in footage.forward()])
            assert len(footage.walk.times_ns) == 90
    assert walks[0] == walks[1]


def test_a_walk_that_is_given_up_frees_the_video(tmp_path):
    before = threading.active_count()
    clip = write_video(tmp_path / "clip.mp4", count=90)
    with VideoFootage(clip, threads=2) as footage:
        frames = footage.forward()
        next(frames)
        frames.close()
        assert threading.active_count() == before
