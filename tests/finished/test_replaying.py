"""A finished run's labels beside the pictures they belong to."""

import dataclasses
import threading

import pytest
from support.counting import COUNT, box_at, labelled, write_counting
from support.media import read_index, truncate, write_video

from situp_annotate.errors import VideoMissingError
from situp_annotate.finished.replaying import labelled_frames, labels_of


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    return labelled(write_counting(tmp_path_factory.mktemp("clips") / "clip.mp4"))


def test_labels_frame_by_frame(video):
    sure, lost = video.tracks
    few = dataclasses.replace(sure, points={4: sure.points[4], 9: sure.points[9]})
    labels = list(labels_of(dataclasses.replace(video, tracks=(few, lost))))
    assert len(labels) == COUNT
    assert [len(points) for points in labels[3:6]] == [1, 2, 1]
    assert [point.track_id for point in labels[4]] == [1, 2]


@pytest.mark.parametrize("threads", [1, 2])
def test_each_frame_has_its_labels(video, threads):
    for index, (frame, points) in enumerate(labelled_frames(video, threads=threads)):
        assert (frame.index, read_index(frame.image)) == (index, index)
        assert points[0].box == box_at(index)


def test_stopping_early_frees_everything(video):
    before = threading.active_count()
    frames = labelled_frames(video, threads=2)
    next(frames)
    frames.close()
    assert threading.active_count() == before


def test_a_video_that_was_kept_incomplete_is_read_as_far(tmp_path):
    whole = write_video(tmp_path / "whole.mp4", gop=1, container_options={"movflags": "+faststart"})
    times = {index: round(index * 1e9 / 30) for index in range(20)}
    video = labelled(write_counting(tmp_path / "other.mp4"))
    cut = truncate(whole, tmp_path / "cut.mp4", 0.6)
    kept = dataclasses.replace(
        video, info=dataclasses.replace(video.info, path=cut), frame_count=20, times_ns=times
    )
    assert [frame.index for frame, _ in labelled_frames(kept)] == list(range(20))


def test_a_video_that_is_gone_is_named(video, tmp_path):
    gone = dataclasses.replace(video.info, path=tmp_path / "gone.mp4")
    with pytest.raises(VideoMissingError, match=r"gone\.mp4"):
        next(labelled_frames(dataclasses.replace(video, info=gone)))
