"""Footage: the same frames in every walk, and what a walk leaves behind."""

import numpy as np
import pytest
from support.media import read_index, truncate, write_image_folder, write_video

from situp_annotate.errors import VideoError, VideoIncompleteError, VideoMissingError
from situp_annotate.video import VideoFootage, footage, open_video

COUNT = 30


@pytest.fixture(scope="module", params=["mp4", "avi", "folder"])
def video(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("footage")
    if request.param == "folder":
        return write_image_folder(folder / "pictures", COUNT)
    return write_video(folder / f"clip.{request.param}", count=COUNT)


def test_all_walks_give_the_same_frames(video):
    with open_video(video) as source:
        plain = [(frame.index, frame.pts_ns, frame.image) for frame in source]
    with VideoFootage(video) as both:
        assert both.size_hw == (48, 64)
        walks = [list(both.forward()), list(both.forward())]
        walks += [list(both.backward(0, COUNT))[::-1]]
    for walk in walks:
        assert [(frame.index, frame.pts_ns) for frame in walk] == [each[:2] for each in plain]
        assert all((f.image == each[2]).all() for f, each in zip(walk, plain, strict=True))


def test_stretches_backward_share_one_open_file(video, monkeypatch):
    made = []
    rewinder = footage.Rewinder

    def counted(*arguments, **options):
        made.append(rewinder(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(footage, "Rewinder", counted)
    with VideoFootage(video) as both:
        for _ in both.forward():
            pass
        for start, stop in ((20, 25), (3, 9), (3, 3)):
            numbers = [read_index(frame.image) for frame in both.backward(start, stop)]
            assert numbers == list(range(stop - 1, start - 1, -1))
    assert len(made) == 1


def test_a_walk_leaves_everything_but_the_pictures(video):
    with VideoFootage(video) as both:
        frames = list(both.forward())
        left = both.walk
    assert [(f.index, f.pts_ns, f.findings) for f in left.frames()] == [
        (f.index, f.pts_ns, f.findings) for f in frames
    ]
    assert {frame.image.shape for frame in left.frames()} == {(0, 0)}


def test_a_walk_from_before_spares_the_walk_forward(video, monkeypatch):
    with VideoFootage(video) as both:
        frames = list(both.forward())
        left = both.walk
    monkeypatch.setattr(footage, "open_video", None)
    with VideoFootage(video, walk=left) as later:
        assert (later.info, later.size_hw) == (left.info, (48, 64))
        backward = list(later.backward(10, 20))
    assert [frame.pts_ns for frame in backward] == [f.pts_ns for f in frames[19:9:-1]]
    np.testing.assert_array_equal(backward[0].image, frames[19].image)


def test_findings_are_kept_with_their_frames(tmp_path):
    pts = [*range(15), *range(25, 40)]
    gap = write_video(tmp_path / "gap.mkv", count=30, pts=pts)
    with VideoFootage(gap) as both:
        frames = list(both.forward())
        found = [(frame.index, frame.findings) for frame in frames if frame.findings]
        assert [index for index, _ in found] == [15]
        assert list(both.walk.findings_at.items()) == found
        assert [finding.kind for finding in both.walk.findings] == ["gap"]


def test_nothing_is_known_before_the_end(tmp_path):
    clip = write_video(tmp_path / "clip.mp4", count=5)
    with VideoFootage(clip) as both:
        next(both.forward())
        with pytest.raises(ValueError, match="not been walked through"):
            both.backward(0, 1)
    with pytest.raises(VideoMissingError):
        VideoFootage(tmp_path / "none.mp4")


def test_an_incomplete_video_fails_or_is_kept(tmp_path):
    whole = write_video(tmp_path / "whole.mp4", gop=1, container_options={"movflags": "+faststart"})
    cut = truncate(whole, tmp_path / "cut.mp4", 0.6)
    with VideoFootage(cut) as both, pytest.raises(VideoIncompleteError):
        list(both.forward())
    with VideoFootage(cut, incomplete="keep") as both:
        count = len(list(both.forward()))
        assert len(both.walk.times_ns) == count < 60
        assert both.walk.findings[-1].kind == "incomplete"


def test_a_video_that_changes_meanwhile_is_noticed(tmp_path):
    clip = write_video(tmp_path / "clip.mp4", count=8)
    with VideoFootage(clip) as both:
        list(both.forward())
        write_video(clip, count=9)
        with pytest.raises(VideoError, match="9 frames where there were 8"):
            list(both.forward())
