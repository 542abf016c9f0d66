"""The overlay in a browser: it plays, and at frame N's time it shows frame N and its box."""

import pytest
from support.numbered import COUNT, SIZE_HW, TIMES_S, box_at, write_vfr
from support.shown import picture_of, seek, shown_box_left, shown_index

from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.formats.overlay.sink import OverlaySink
from situp_annotate.types import Keyframe, Provenance, State, Track, TrackPoint
from situp_annotate.video import open_video


def player(folder, source):
    page = folder / "player.html"
    page.write_text(f'<!doctype html><video src="{source}" preload="metadata"></video>')
    return page


def check_every_frame(page, times):
    page.wait_for_function("() => document.querySelector('video').readyState > 0")
    height, width, duration = page.eval_on_selector(
        "video", "(video) => [video.videoHeight, video.videoWidth, video.duration]"
    )
    assert (height, width) == SIZE_HW
    assert duration >= times[-1]
    ends = [*times[1:], times[-1] + 0.002]
    for frame in [*range(0, COUNT, 6), COUNT - 1, 1, COUNT - 2]:
        seek(page, (times[frame] + ends[frame]) / 2)
        picture = picture_of(page)
        assert shown_index(picture) == frame
        left = shown_box_left(picture, 1, slice(58, 70))
        assert left == pytest.approx(box_at(frame).x, abs=2)


@pytest.mark.parametrize(("clip", "video_id"), [("cfr", "cfr"), ("vfr", "vfr & <i>")])
def test_a_runs_overlay_shows_every_frame_at_its_time(
    clip, video_id, run_folder, open_page, tmp_path
):
    address = (run_folder / video_id / "overlay.mp4").as_uri()
    check_every_frame(open_page(player(tmp_path, address)), TIMES_S[clip])


@pytest.mark.parametrize("preset", ["ultrafast", "superfast", "medium"])
def test_every_preset_shows_every_frame_of_a_variable_rate(preset, open_page, tmp_path):
    track = Track(1, "van", (Keyframe(0, box_at(0)),))
    options = OverlayOptions(preset=preset)
    with open_video(write_vfr(tmp_path / "vfr.mkv")) as source:
        overlay = OverlaySink(
            tmp_path / "overlay.mp4", info=source.info, tracks=[track], options=options
        )
        with overlay:
            for frame in source:
                box = box_at(frame.index)
                point = TrackPoint(1, box, 0.5, State.VISIBLE, Provenance.TRACKED)
                overlay.write(frame, [point])
    check_every_frame(open_page(player(tmp_path, "overlay.mp4")), TIMES_S["vfr"])
