"""Label Studio: what its editor would show of our predictions, and what comes back of its exports.

The editor is played here by rules read from its source (``VideoRegion.js``,
``VideoRectangleRegion.js``, ``VideoCanvas.tsx``): which picture it shows at its frame n, whether a
region is there, and where.
"""

import json
from bisect import bisect_right
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.labelled import (
    SIZE,
    import_hints,
    labelled_track,
    labelled_video,
    labelled_videos,
)

from situp_annotate.errors import SitupError, VideoError
from situp_annotate.formats.clipping import clipped
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.label_studio.exporting import write_label_studio
from situp_annotate.formats.label_studio.frames import clock_rate, tick_of
from situp_annotate.formats.label_studio.importing import read_label_studio, recognizes_label_studio
from situp_annotate.types import NS_PER_S, BoundingBox, Keyframe, Provenance, State, Track

BOX = BoundingBox(64, 48, 32, 24)  # 10 %, 10 %, 5 %, 5 %
OPTIONS = ExportOptions()
MS = 1_000_000


def write(folder, *videos, options=OPTIONS):
    write_label_studio(iter(videos), folder, options)
    return json.loads((folder / "label_studio.json").read_text())


def timed(video, times_ns, rate=None):
    """The video with other times; its rate is the mean one, unless another is given."""
    span = times_ns[-1] - times_ns[0]
    mean = Fraction((len(times_ns) - 1) * NS_PER_S, span) if span else Fraction(25)
    frames = {frame for track in video.tracks for frame in track.points}
    return replace(
        video,
        info=replace(video.info, frame_rate=rate or mean),
        frame_count=len(times_ns),
        times_ns={frame: times_ns[frame] for frame in sorted(frames)},
    )


def hints_of(times_ns, label="object"):
    return replace(import_hints(label=label), times_ns=lambda _: times_ns)


def read(folder, tasks, times_ns=range(0, 40 * 100 * MS, 40 * MS), label="object"):
    path = folder / "export.json"
    path.write_text(tasks if isinstance(tasks, str) else json.dumps(tasks))
    return read_label_studio(path, hints_of(times_ns, label))


# ---- the editor ----------------------------------------------------------------------------


def picture_shown(tick, rate, times_ns):
    moment_ns = Fraction(tick - 1) / rate * NS_PER_S + 2 * MS + 1  # for the float that the rate is
    return max(0, bisect_right(times_ns, moment_ns) - 1)


def shape_shown(sequence, tick):
    """x, y, width and height in pixels, or None."""
    before = [item for item in sequence if item["frame"] <= tick]
    if not before or not (before[-1]["enabled"] or before[-1]["frame"] == tick):
        return None
    one = before[-1]
    other = next((item for item in sequence if item["frame"] > tick), one)
    share = (tick - one["frame"]) / max(1, other["frame"] - one["frame"])
    values = (one[n] + (other[n] - one[n]) * share for n in ("x", "y", "width", "height"))
    return BoundingBox(*(value * SIZE[number % 2] / 100 for number, value in enumerate(values)))


def iou(one, other):
    width = min(one.right, other.right) - max(one.x, other.x)
    height = min(one.bottom, other.bottom) - max(one.y, other.y)
    shared = max(0, width) * max(0, height)
    return shared / (one.width * one.height + other.width * other.height - shared)


def drawable(box):
    inside = clipped(box, *SIZE)
    if inside is None:
        return None
    return inside if box.width > SIZE[0] or box.height > SIZE[1] else box


def uneven_times(count):
    gaps = st.lists(st.integers(3, 60), min_size=count - 1, max_size=count - 1)
    return gaps.map(lambda steps: [sum(steps[:n]) * MS for n in range(count)])


FRAMES = 12
WHOLE = labelled_track(1000, dict.fromkeys(range(FRAMES), BOX), "backdrop")


@settings(max_examples=40, deadline=None)
@given(
    labelled_videos(frame_count=FRAMES, least_size=1),
    uneven_times(FRAMES),
    st.sampled_from([0.5, 0.9, 1.0]),
)
def test_the_editor_shows_each_label_over_its_picture(tmp_path_factory, video, times_ns, bound):
    video = timed(replace(video, tracks=(*video.tracks, WHOLE)), times_ns)
    folder = tmp_path_factory.mktemp("ls")
    (task,) = write(folder, video, options=ExportOptions(iou=bound))
    rate = Fraction(task["data"]["fps"])
    sequences = {r["meta"]["track_id"]: r["value"]["sequence"] for r in result_of(task)}
    ticks = [tick_of(time_ns, rate) for time_ns in times_ns]
    assert len(set(ticks)) == FRAMES, "each picture has a number of its own"
    assert [picture_shown(tick, rate, times_ns) for tick in ticks] == [*range(FRAMES)]
    pictures = [(n, picture_shown(n, rate, times_ns)) for n in range(1, ticks[-1] + 1)]
    for track in video.tracks:
        points = track.in_states(OPTIONS.states)
        for tick, picture in pictures:
            point = points.get(picture)
            wanted = drawable(point.box) if point else None
            shown = shape_shown(sequences.get(track.track.id, []), tick)
            assert (shown is None) == (wanted is None)
            if wanted is not None:
                assert iou(shown, wanted) >= bound - 1e-5


def result_of(task):
    (prediction,) = task["predictions"]
    return prediction["result"]


@settings(max_examples=40, deadline=None)
@given(labelled_videos(frame_count=FRAMES, least_size=1), uneven_times(FRAMES))
def test_what_is_exported_is_imported(tmp_path_factory, video, times_ns):
    video = timed(replace(video, tracks=(*video.tracks, WHOLE)), times_ns)
    folder = tmp_path_factory.mktemp("ls")
    (seeds,) = read(folder, write(folder, video), times_ns)
    assert (seeds.name, seeds.video_id) == ("clip.mp4", "clip")
    points = {
        track.track.id: {
            frame: replace(point, box=drawable(point.box))
            for frame, point in track.in_states(OPTIONS.states).items()
            if drawable(point.box) is not None
        }
        for track in video.tracks
    }
    assert [track.id for track in seeds.tracks] == [i for i in points if points[i]]
    labels = {track.track.id: track.track.label for track in video.tracks}
    for track in seeds.tracks:
        assert track.label == labels[track.id]
        wanted = points[track.id]
        for keyframe in track.keyframes:
            if keyframe.box is None:
                assert keyframe.frame not in wanted
                assert keyframe.frame - 1 in wanted
            else:
                point = wanted[keyframe.frame]
                assert_near(keyframe.box, point.box)
                assert keyframe.occluded == (point.state is not State.VISIBLE)
        outside = {keyframe.frame for keyframe in track.keyframes if keyframe.box is None}
        assert outside == {f + 1 for f in wanted if f + 1 not in wanted and f + 1 < FRAMES}
        human = {f for f, point in wanted.items() if point.provenance is Provenance.HUMAN}
        assert human <= {keyframe.frame for keyframe in track.keyframes}


def assert_near(found, wanted):
    for side in ("x", "y", "width", "height"):
        assert getattr(found, side) == pytest.approx(getattr(wanted, side), abs=1e-4)


# ---- export --------------------------------------------------------------------------------


def test_a_task_is_as_the_editor_writes_it(tmp_path):
    points = dict.fromkeys(range(3, 11), BOX)
    points[11] = (BOX, State.OCCLUDED, Provenance.HUMAN)
    track = labelled_track(7, points, "car", {"colour": "red"})
    (task,) = write(tmp_path, timed(labelled_video(track), range(0, 800 * MS, 40 * MS)))
    assert task["data"] == {
        "video": "/data/local-files/?d=clip.mp4",
        "fps": 25.0,
        "situp_id": "clip",
    }
    (prediction,) = task["predictions"]
    assert prediction["model_version"] == "situp-annotate"
    assert prediction["score"] == 0.5
    box = {"x": 10.0, "y": 10.0, "width": 5.0, "height": 5.0, "rotation": 0}
    assert prediction["result"] == [
        {
            "id": "track-7",
            "type": "videorectangle",
            "from_name": "box",
            "to_name": "video",
            "score": 0.5,
            "meta": {"track_id": 7, "attributes": {"colour": "red"}},
            "value": {
                "framesCount": 20,
                "duration": 0.8,
                "sequence": [
                    {"frame": 4, "time": 0.16, **box, "enabled": True, "occluded": False},
                    {"frame": 12, "time": 0.48, **box, "enabled": False, "occluded": True},
                ],
                "labels": ["car"],
            },
        }
    ]


def test_labels_up_to_the_end_are_not_switched_off(tmp_path):
    track = labelled_track(1, dict.fromkeys(range(20), BOX))
    (task,) = write(tmp_path, timed(labelled_video(track), range(0, 800 * MS, 40 * MS)))
    (region,) = result_of(task)
    assert [item["enabled"] for item in region["value"]["sequence"]] == [True, True]


def test_an_outside_in_the_last_pictures_stays_though_pictures_come_late(tmp_path):
    """The rate that a file says is not always the mean one: 25, and a pause of five seconds."""
    times_ns = [0, 40 * MS, 80 * MS, 5000 * MS, 5040 * MS]
    track = labelled_track(1, dict.fromkeys(range(4), BOX))
    tasks = write(tmp_path, timed(labelled_video(track), times_ns, Fraction(25)))
    (region,) = result_of(tasks[0])
    last = region["value"]["sequence"][-1]
    assert (last["frame"], last["enabled"]) == (126, False)
    assert region["value"]["framesCount"] == 127
    assert region["value"]["duration"] == 5.04
    (seeds,) = read(tmp_path, tasks, times_ns)
    assert seeds.tracks[0].keyframes[-1] == Keyframe(4, None)


def test_labels_up_to_a_late_end_are_not_switched_off(tmp_path):
    times_ns = [0, 40 * MS, 5000 * MS]
    track = labelled_track(1, dict.fromkeys(range(3), BOX))
    (task,) = write(tmp_path, timed(labelled_video(track), times_ns, Fraction(25)))
    value = result_of(task)[0]["value"]
    assert [item["enabled"] for item in value["sequence"]] == [True, True]
    assert value["framesCount"] == value["sequence"][-1]["frame"] == 126


def test_the_interface_names_the_labels_and_takes_each_task_s_rate(tmp_path):
    one = labelled_video(labelled_track(1, {0: BOX}, 'a "b" & <c>'), video_id="one")
    two = labelled_video(labelled_track(1, {0: BOX}, "car"), video_id="tw o", rate=Fraction(50))
    tasks = write(tmp_path, one, two)
    assert [task["data"]["fps"] for task in tasks] == [30000 / 1001, 50.0]
    assert tasks[1]["data"]["video"] == "/data/local-files/?d=tw%20o.mp4"
    interface = ElementTree.parse(tmp_path / "label_config.xml").getroot()
    assert [label.get("value") for label in interface.iter("Label")] == ['a "b" & <c>', "car"]
    assert interface.find("Video").attrib == {
        "name": "video",
        "value": "$video",
        "frameRate": "$fps",
    }
    assert {e.get("name"): e.get("toName") for e in interface if e.get("toName")} == {
        "box": "video",
        "label": "video",
    }


def test_no_video_is_an_empty_list(tmp_path):
    assert write(tmp_path) == []


def test_boxes_are_as_label_studio_allows_them(tmp_path):
    """Its SDK refuses x, y, width and height of more than 100 %, but not less than 0."""
    points = {
        0: BoundingBox(-10, -20, 30, 40),
        1: BoundingBox(-10, 10, 700, 20),
        2: BoundingBox(640, 0, 10, 10),
        3: BoundingBox(630, 470, 30, 40),
    }
    (task,) = write(
        tmp_path, timed(labelled_video(labelled_track(1, points)), range(0, 800 * MS, 40 * MS))
    )
    (region,) = result_of(task)
    items = region["value"]["sequence"]
    assert [(i["frame"], i["x"], i["width"], i["enabled"]) for i in items] == [
        (1, -1.5625, 4.6875, True),
        (2, 0.0, 100.0, False),
        (4, 98.4375, 4.6875, False),
    ]


@pytest.mark.parametrize(
    ("rate", "times_ms", "told"),
    [
        (Fraction(25), [0, 40, 80], 25),
        (Fraction(30000, 1001), [0, 33, 67, 100, 133, 167], 30000 / 1001),  # WebM's milliseconds
        (Fraction(4), [0, 20, 40, 1000], 50),  # a burst: no two pictures share a number
        (Fraction(1, 10), [0, 10_000], 1),
        (Fraction(2000), [0, 0.5, 1], 500),
    ],
)
def test_the_rate_gives_each_picture_a_number_where_it_can(rate, times_ms, told):
    times_ns = [round(ms * MS) for ms in times_ms]
    track = labelled_track(1, dict.fromkeys(range(len(times_ns)), BOX))
    assert float(clock_rate(timed(labelled_video(track), times_ns, rate))) == told


def test_pictures_before_time_zero_are_the_first_frame(tmp_path):
    times_ns = [-80 * MS, -40 * MS, 0, 40 * MS]
    points = {frame: BoundingBox(10 * frame + 1, 0, 10, 10) for frame in range(4)}
    video = timed(labelled_video(labelled_track(1, points)), times_ns, Fraction(25))
    tasks = write(tmp_path, video)
    (seeds,) = read(tmp_path, tasks, times_ns)
    assert seeds.tracks[0].keyframes == (
        Keyframe(2, points[2]),
        Keyframe(3, points[3]),
    )


# ---- import --------------------------------------------------------------------------------


def item(frame, rate=25, **more):
    box = {"x": 10, "y": 10, "width": 5, "height": 5}
    return {"frame": frame, "enabled": True, "rotation": 0, "time": frame / rate, **box, **more}


def region(*items, labels=("car",), **more):
    value = {"framesCount": 100, "duration": 4.0, "sequence": list(items), "labels": list(labels)}
    return {"type": "videorectangle", "id": "x", "value": value, **more}


def task(*regions, video="/data/upload/1/1a2b3c4d-clip.mp4", **more):
    annotation = {"id": 1, "result": list(regions), "was_cancelled": False}
    return {"id": 5, "data": {"video": video}, "annotations": [annotation], **more}


def test_an_export_of_the_editor_becomes_keyframes(tmp_path):
    car = region(item(1), item(11, enabled=False, x=20), item(21), item(31, enabled=False))
    (seeds,) = read(tmp_path, [task(car)])
    moved = BoundingBox(128, 48, 32, 24)
    assert (seeds.name, seeds.video_id) == ("clip.mp4", "")
    assert seeds.notes == ()
    assert seeds.tracks == (
        Track(
            1,
            "car",
            (
                Keyframe(0, BOX),
                Keyframe(10, moved),
                Keyframe(11, None),
                Keyframe(20, BOX),
                Keyframe(30, BOX),
                Keyframe(31, None),
            ),
        ),
    )


def frames(seeds):
    return [keyframe.frame for keyframe in seeds.tracks[0].keyframes]


def test_a_region_switched_off_and_on_in_one_step_has_no_gap(tmp_path):
    (seeds,) = read(tmp_path, [task(region(item(1, enabled=False), item(2)))])
    assert [k.box for k in seeds.tracks[0].keyframes] == [BOX, BOX]


def test_a_region_switched_off_at_the_last_picture_needs_no_outside(tmp_path):
    (seeds,) = read(tmp_path, [task(region(item(1), item(100, enabled=False)))])
    assert frames(seeds) == [0, 99]


@pytest.mark.parametrize("rate", [24, 25, 29.97, 60])
def test_frames_are_found_by_time_whatever_rate_the_editor_had(tmp_path, rate):
    """Half a picture after the beginning of pictures 10 and 50, of 25 a second."""
    numbers = [round((frame + 0.5) / 25 * rate) + 1 for frame in (10, 50)]
    (seeds,) = read(tmp_path, [task(region(*(item(n, rate) for n in numbers)))])
    assert frames(seeds) == [10, 50]


def test_uneven_times_are_the_video_s(tmp_path):
    times_ns = [0, 40 * MS, 1000 * MS, 1040 * MS]
    (seeds,) = read(tmp_path, [task(region(item(2), item(20), item(26)))], times_ns)
    assert frames(seeds) == [1, 2]  # what the player shows at its frame 20 is picture 1


@pytest.mark.parametrize("times", [{"time": None}, {}])
def test_without_times_the_length_gives_the_rate(tmp_path, times):
    made = item(11) | times
    if not times:
        del made["time"]
    (seeds,) = read(tmp_path, [task(region(made))])
    assert frames(seeds) == [10]


def test_numbers_from_zero_are_told_by_a_zero(tmp_path):
    items = [item(n) | {"time": n / 25} for n in (0, 10)]
    (seeds,) = read(tmp_path, [task(region(*items))])
    assert frames(seeds) == [0, 10]
    assert seeds.notes == ("Frames are taken to count from 0, since there is a frame 0.",)


def test_turned_boxes_become_upright(tmp_path):
    """A quarter turn clockwise about the top-left corner puts the box to the left of it."""
    (seeds,) = read(tmp_path, [task(region(item(1, rotation=90), item(2, rotation=-90)))])
    found = [k.box for k in seeds.tracks[0].keyframes]
    assert_near(found[0], BoundingBox(64 - 24, 48, 24, 32))
    assert_near(found[1], BoundingBox(64, 48 - 32, 24, 32))
    assert seeds.notes == ("2 turned boxes are replaced by upright ones around them.",)


def test_the_annotation_changed_last_counts(tmp_path):
    made = task()
    made["annotations"] = [
        {"result": [region(item(2))], "updated_at": "2025-02-01T00:00:00Z"},
        {"result": [region(item(1))], "updated_at": "2025-01-01T00:00:00Z"},
        {"result": [region(item(3))], "updated_at": "2025-03-01T00:00:00Z", "was_cancelled": True},
    ]
    made["predictions"] = [{"result": [region(item(4))]}]
    (seeds,) = read(tmp_path, [made])
    assert frames(seeds) == [1]
    assert seeds.notes == ("Of 2 annotations, the one changed last is taken.",)


def test_predictions_count_where_nobody_annotated(tmp_path):
    made = {"data": {"video": "s3://bucket/a/b/clip.mp4?x=1"}, "annotations": []}
    made["predictions"] = [{"result": [region(item(4))]}]
    (seeds,) = read(tmp_path, made)
    assert (seeds.name, frames(seeds)) == ("clip.mp4", [3])


def test_other_regions_are_none_of_ours(tmp_path):
    others = [
        {"type": "timelinelabels", "value": {"ranges": [{"start": 3, "end": 5}]}},
        {"type": "relation", "from_id": "a", "to_id": "b"},
        {"type": "choices", "value": {"choices": ["good"]}},
    ]
    tasks = [task(*others), task(*others, region(item(1)), video="http://h/two%20words.webm")]
    empty, one = read(tmp_path, tasks)
    assert (empty.name, empty.tracks) == ("clip.mp4", ())
    assert (one.name, len(one.tracks)) == ("two words.webm", 1)


def test_ids_labels_and_attributes_come_back_where_they_are_known(tmp_path):
    regions = [
        region(item(1), labels=[]),
        region(item(1), labels=["car", "red"], meta={"track_id": 2, "attributes": {"a": 1}}),
        region(item(1), meta={"track_id": 2}),  # a copy made in the editor
        region(item(1), meta={"text": ["note"], "track_id": "x"}),
    ]
    (seeds,) = read(tmp_path, [task(*regions)], label="thing")
    assert [(t.id, t.label, t.attributes) for t in seeds.tracks] == [
        (1, "thing", {}),
        (2, "car", {"a": 1}),
        (3, "car", {}),
        (4, "car", {}),
    ]


@pytest.mark.parametrize(
    ("video", "name"),
    [
        ("/data/upload/3/0123abcd-my_clip.mp4", "my_clip.mp4"),
        ("/data/local-files/?d=day%201/clip.mp4", "clip.mp4"),
        ("/data/local-files/?d=C%3A%5Cvideos%5Cclip.mp4", "clip.mp4"),
        ("https://host/0123abcd-clip.mp4", "0123abcd-clip.mp4"),
        ("clip", ""),
        ("http://[broken", ""),
    ],
)
def test_the_name_is_that_of_the_file(tmp_path, video, name):
    (seeds,) = read(tmp_path, task(video=video))
    assert seeds.name == name


@pytest.mark.parametrize(("given", "found"), [("day.2", "day.2"), (3, ""), (None, "")])
def test_the_id_of_the_video_in_the_run_is_no_name_of_a_file(tmp_path, given, found):
    made = {"data": {"situp_id": given, "video": "clip"}, "predictions": []}
    (seeds,) = read(tmp_path, made)
    assert (seeds.name, seeds.video_id) == ("", found)


BAD = [
    ("[", "not valid JSON"),
    ([task(region(item(1), labels=["a\nb"]))], r"\.value\.labels: 'a\\nb' cannot be a label"),
    ("[1]", r"\$\[0\]: 1: "),
    ("[{}]", r"\$\[0\]: data is missing"),
    ('[{"data": {"video": "a.mp4"}, "annotations": 3}]', r"\$\[0\]\.annotations: 3: "),
    ([task(region(item(1, x="left")))], r"\.sequence\[0\]\.x: \"left\": "),
    ([task(region(item(-1)))], r"\.sequence\[0\]\.frame: -1: "),
    ([task(region(item(1.5)))], r"\.sequence\[0\]\.frame: 1\.5: "),
    ([task(region(item(1), item(2, width=0)))], r"\.sequence\[1\]: .*is no box"),
    ([task(region(item(1), item(2, x=1e308)))], r"\.sequence\[1\]: .*is no box"),
    ([task(region(item(200)))], r"\.sequence\[0\]\.frame: frame 200 is shown at 7\.960 s"),
    ([task(region(item(1), item(2, time=0.0)))], r"\$\[0\]: .*no frame rate"),
    ([task(region(item(5, time=0)))], r"\$\[0\]: .*no frame rate"),
]


@pytest.mark.parametrize(("content", "what"), BAD)
def test_a_bad_file_is_named_with_the_place(tmp_path, content, what):
    with pytest.raises(SitupError, match=what) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(f"{tmp_path / 'export.json'}: ")


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(SitupError, match="No such file"):
        read_label_studio(tmp_path / "none.json", import_hints())


def test_a_byte_order_mark_does_no_harm(tmp_path):
    path = tmp_path / "export.json"
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps([task()]).encode())
    assert recognizes_label_studio(path, path.read_bytes())
    assert len(read_label_studio(path, import_hints())) == 1


def test_it_recognizes_its_own_kind(tmp_path):
    def recognized(content):
        return recognizes_label_studio(Path("x.json"), json.dumps(content).encode()[:4096])

    assert recognized(write(tmp_path, labelled_video(labelled_track(1, {0: BOX}))))
    assert recognized([task(region(item(1)))])
    assert recognized(task(region(item(1))))
    assert not recognized({"videos": [], "images": [], "annotations": []})
    assert not recognized([{"path": "a.mp4"}])
    assert not recognizes_label_studio(Path("x.xml"), b"<annotations>")


@pytest.mark.parametrize(
    ("value", "what"),
    [("NaN", r"\$\.a: NaN"), ("1e999", "Infinity"), ("[" * 60 + "]" * 60, "deep")],
)
def test_attributes_that_no_manifest_can_hold_are_refused(tmp_path, value, what):
    text = json.dumps([task(region(item(1), meta={"attributes": {"a": "here"}}))])
    with pytest.raises(SitupError, match=rf"\.meta\.attributes cannot be taken over: .*{what}"):
        read(tmp_path, text.replace('"here"', value))


def test_a_stray_time_does_not_make_millions_of_labels(tmp_path):
    video = labelled_video(labelled_track(1, {0: BOX, 1: BOX}))
    stray = replace(video, times_ns={0: 0, 1: 10**18})
    with pytest.raises(VideoError, match=r"would count \d+ frames in it, more than 5000000"):
        write(tmp_path, stray)
