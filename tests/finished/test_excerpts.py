"""Excerpts: which frames, when, how large."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image as Pillow
from support.counting import VFR, box_index, labelled, write_counting
from support.media import read_index

from situp_annotate.errors import SitupError
from situp_annotate.finished.excerpts import make_excerpt
from situp_annotate.formats.overlay.options import OverlayOptions

OPTIONS = OverlayOptions(captions="none", tracks=(1,))


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    return labelled(write_counting(tmp_path_factory.mktemp("clips") / "clip.mp4"))


def excerpt(video, **values):
    """Numbers that the pictures spell, their durations in milliseconds, and their size."""
    settings = {"form": "gif", "start_s": 0.0, "seconds": 1.0, **values}
    file = Pillow.open(BytesIO(make_excerpt(video, OPTIONS, **settings)))
    numbers, durations = [], []
    for place in range(file.n_frames):
        file.seek(place)
        image = np.asarray(file.convert("RGB"))[..., ::-1]
        numbers.append(read_index(image))
        durations.append(file.info["duration"])
        assert box_index(image) == numbers[-1]
    return numbers, durations, file.size


def test_by_default_ten_pictures_a_second(video):
    assert excerpt(video) == (list(range(0, 30, 3)), [100] * 10, (480, 360))


def test_from_when_and_how_long(video):
    numbers, durations, _ = excerpt(video, start_s=0.5, seconds=0.35)
    assert numbers == [15, 18, 21, 24]
    assert sum(durations) == pytest.approx(400, abs=20)


def test_no_more_pictures_than_the_video_has(video):
    assert excerpt(video, seconds=0.3, frame_rate=50)[0] == list(range(9))


def test_it_ends_with_the_video(video):
    assert excerpt(video, start_s=1.2, seconds=9)[0] == [36, 39]


def test_uneven_times_are_kept(tmp_path):
    video = labelled(write_counting(tmp_path / "clip.mp4", **VFR))
    numbers, durations, _ = excerpt(video, seconds=1.0, frame_rate=30)
    steps = np.diff([video.times_ns[number] for number in numbers]) / 1e6
    assert durations[:-1] == pytest.approx(steps, abs=10)


@pytest.mark.parametrize(("width", "size"), [(320, (320, 240)), (2000, (640, 480))])
def test_width_is_a_limit(video, width, size):
    assert excerpt(video, seconds=0.1, width=width)[2] == size


def test_an_excerpt_from_beyond_the_end_is_refused(video):
    with pytest.raises(SitupError, match=r"ends after 1\.33 s, before the excerpt begins at 2 s"):
        excerpt(video, start_s=2.0)


def test_a_huge_excerpt_is_refused(video):
    with pytest.raises(SitupError, match="1800 pictures of 640 × 480 pixels would be huge"):
        excerpt(video, seconds=60, width=640, frame_rate=50)
