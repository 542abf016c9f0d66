"""COCO with videos: read by pycocotools, scored by TrackEval, and back again."""

import contextlib
import io
import json
import warnings
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.labelled import import_hints, labelled_track, labelled_video, labelled_videos

from situp_annotate.errors import SitupError
from situp_annotate.formats.coco.exporting import write_coco
from situp_annotate.formats.coco.importing import read_coco, recognizes_coco
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.types import BoundingBox, Keyframe, Provenance, State

BOX = BoundingBox(10, 20, 30, 40)
OPTIONS = ExportOptions()
ALL = ExportOptions(states=tuple(State))
LOST = (BOX, State.LOST, Provenance.TRACKED)
HINTS = import_hints()


def write(folder, *videos, options=OPTIONS):
    write_coco(iter(videos), folder, options)
    return folder / "coco.json"


def read(path, hints=HINTS):
    return read_coco(path, hints)


def load(path):
    """As pycocotools loads it."""
    from pycocotools.coco import COCO

    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(path)


# ---- export --------------------------------------------------------------------------------


def test_a_file_is_as_documented(tmp_path):
    hidden = (BoundingBox(-1.5, 1 / 3, 30, 40), State.OCCLUDED, Provenance.HUMAN)
    video = labelled_video(
        labelled_track(3, {0: BOX, 1: hidden}), labelled_track(7, {1: BOX}, "dog"), frame_count=3
    )
    coco = json.loads(write(tmp_path, video).read_text())
    assert list(coco) == ["info", "images", "annotations", "tracks", "videos", "categories"]
    assert coco["categories"] == [{"id": 1, "name": "car"}, {"id": 2, "name": "dog"}]
    assert coco["videos"] == [
        {
            "id": 1,
            "name": "clip",
            "file_name": "clip.mp4",
            "width": 640,
            "height": 480,
            "length": 3,
            "fps": 30000 / 1001,
            "neg_category_ids": [],
            "not_exhaustive_category_ids": [2],
        }
    ]
    assert coco["tracks"] == [
        {"id": 1, "video_id": 1, "category_id": 1, "instance_id": 3},
        {"id": 2, "video_id": 1, "category_id": 2, "instance_id": 7},
    ]
    size = {"width": 640, "height": 480}
    assert coco["images"] == [
        {"id": 1, "video_id": 1, "frame_index": 0, "file_name": "clip/000000.jpg", **size}
        | {"not_exhaustive_category_ids": [2]},
        {"id": 2, "video_id": 1, "frame_index": 1, "file_name": "clip/000001.jpg", **size},
        {"id": 3, "video_id": 1, "frame_index": 2, "file_name": "clip/000002.jpg", **size}
        | {"neg_category_ids": [1, 2]},
    ]
    seen = {"iscrowd": 0, "score": 0.5, "state": "visible", "occluded": False}
    first = {"video_id": 1, "category_id": 1, "track_id": 1, "instance_id": 3}
    second = {"video_id": 1, "category_id": 2, "track_id": 2, "instance_id": 7}
    box = {"bbox": [10, 20, 30, 40], "area": 1200, "provenance": "tracked"}
    assert coco["annotations"] == [
        {"id": 1, "image_id": 1, **first, **seen, **box},
        {
            "id": 2,
            "image_id": 2,
            **first,
            **seen,
            "bbox": [-1.5, 1 / 3, 30, 40],
            "area": 1200,
            "provenance": "human",
            "state": "occluded",
            "occluded": True,
        },
        {"id": 3, "image_id": 2, **second, **seen, **box},
    ]


def test_where_an_object_is_lost_its_class_is_said_to_be_incomplete(tmp_path):
    video = labelled_video(labelled_track(1, {0: BOX, 1: LOST}), frame_count=3)
    coco = json.loads(write(tmp_path, video).read_text())
    assert coco["videos"][0]["not_exhaustive_category_ids"] == [1]
    assert [image.get("not_exhaustive_category_ids") for image in coco["images"]] == [
        None,
        [1],
        None,
    ]
    with_lost = json.loads(write(tmp_path, video, options=ALL).read_text())
    assert with_lost["videos"][0]["not_exhaustive_category_ids"] == []
    assert [annotation["state"] for annotation in with_lost["annotations"]] == ["visible", "lost"]


def test_an_absence_is_claimed_only_where_a_person_said_so(tmp_path):
    video = labelled_video(
        labelled_track(1, {2: BOX}), labelled_track(2, {3: BOX}, "dog"), frame_count=6
    )
    coco = json.loads(write(tmp_path, video).read_text())
    said = [
        (image.get("neg_category_ids"), image.get("not_exhaustive_category_ids"))
        for image in coco["images"]
    ]
    assert said == [([], [1, 2]), ([], [1, 2]), (None, [2]), (None, None), *[([1, 2], None)] * 2]


def test_no_video_is_a_sound_file(tmp_path):
    path = write(tmp_path)
    assert load(path).dataset["annotations"] == []
    assert read(path) == []
    assert [entry.name for entry in tmp_path.iterdir()] == ["coco.json"]


@settings(deadline=None)
@given(st.lists(labelled_videos(), max_size=2))
def test_pycocotools_finds_the_same_boxes_by_track(tmp_path_factory, videos):
    coco = load(write(tmp_path_factory.mktemp("coco"), *videos))
    found = {}
    for annotation in coco.anns.values():
        image = coco.imgs[annotation["image_id"]]
        label = coco.cats[annotation["category_id"]]["name"]
        key = (image["video_id"], annotation["instance_id"], label, image["frame_index"])
        assert key not in found
        found[key] = tuple(annotation["bbox"])
    assert found == {
        (number, track.track.id, track.track.label, frame): (
            *(point.box.x, point.box.y, point.box.width, point.box.height),
        )
        for number, video in enumerate(videos, start=1)
        for track in video.tracks
        for frame, point in track.in_states(OPTIONS.states).items()
    }
    assert len(coco.imgs) == sum(video.frame_count for video in videos)
    by_image = {image: coco.getAnnIds(imgIds=image) for image in coco.imgs}
    assert sum(map(len, by_image.values())) == len(coco.anns)


def test_trackeval_scores_our_file_as_perfect_against_itself(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import trackeval

    moving = {frame: BoundingBox(10 + 3 * frame, 20, 30, 40) for frame in range(8)}
    one = labelled_video(
        labelled_track(1, moving), labelled_track(5, {2: BOX, 6: BOX}, "dog"), video_id="one"
    )
    two = labelled_video(labelled_track(1, moving, "dog"), video_id="two")
    truth, results = tmp_path / "truth", tmp_path / "trackers" / "ours" / "data"
    for folder in (truth, results):
        folder.mkdir(parents=True)
    path = write(truth, one, two)
    (results / "ours.json").write_text(json.dumps(json.loads(path.read_text())["annotations"]))
    config = {"GT_FOLDER": str(truth), "TRACKERS_FOLDER": str(tmp_path / "trackers")}
    with contextlib.redirect_stdout(io.StringIO()):
        dataset = trackeval.datasets.TAO({**config, "PRINT_CONFIG": False})
        evaluator = trackeval.Evaluator({"PRINT_CONFIG": False, "OUTPUT_SUMMARY": False})
        metrics = [trackeval.metrics.HOTA(), trackeval.metrics.TrackMAP({"PRINT_CONFIG": False})]
        scores, _ = evaluator.evaluate([dataset], metrics)
    combined = scores["TAO"]["ours"]["COMBINED_SEQ"]
    for label in ("car", "dog"):
        assert combined[label]["HOTA"]["HOTA"].mean() == pytest.approx(1)
        assert combined[label]["TrackMAP"]["AP_all"].mean() == pytest.approx(1)


# ---- there and back ------------------------------------------------------------------------


@settings(deadline=None)
@given(labelled_videos())
def test_what_is_exported_is_imported(tmp_path_factory, video):
    (seeds,) = read(write(tmp_path_factory.mktemp("coco"), video, options=ALL))
    assert seeds.name == "clip.mp4"
    wanted = {track.track.id: track for track in video.tracks if track.points}
    assert [track.id for track in seeds.tracks] == list(wanted)
    for track in seeds.tracks:
        points = wanted[track.id].points
        assert track.label == wanted[track.id].track.label
        told = [frame for frame in range(video.frame_count) if frame >= begun(video, track.label)]
        ends = {frame + 1 for frame in points if frame + 1 not in points}
        absent = {next((frame for frame in told if frame >= end), end) for end in ends}
        assert track.keyframes == tuple(
            Keyframe(frame, points[frame].box, points[frame].state is not State.VISIBLE)
            if frame in points
            else Keyframe(frame, None)
            for frame in sorted(points.keys() | absent - {video.frame_count})
        )


def begun(video, label):
    """First frame of which it is known where every object of a class is."""
    tracks = [track for track in video.tracks if track.track.label == label]
    return max(track.track.keyframes[0].frame + (not track.points) for track in tracks)


@settings(deadline=None)
@given(labelled_videos())
def test_labels_that_were_left_out_are_no_absences(tmp_path_factory, video):
    (seeds,) = read(write(tmp_path_factory.mktemp("coco"), video))
    wanted = {track.track.id: track for track in video.tracks}
    for track in seeds.tracks:
        boxes = {k.frame: k.box for k in track.keyframes if k.box is not None}
        points = wanted[track.id].in_states(OPTIONS.states)
        assert boxes == {frame: point.box for frame, point in points.items()}
        lost = wanted[track.id].in_states((State.LOST,))
        outside = {k.frame for k in track.keyframes if k.box is None}
        assert not outside & lost.keys()


# ---- import --------------------------------------------------------------------------------


def document(annotations, images=None, **more):
    """One video with images 10, 11, 12 of frames 0, 30, 60."""
    images = images or [{"id": 10 + n, "video_id": 1, "frame_index": 30 * n} for n in range(3)]
    return {
        "videos": [{"id": 1, "name": "train/street"}],
        "images": images,
        "annotations": annotations,
        "categories": [{"id": 7, "name": "car"}],
        **more,
    }


def box_in(image, track_id=5, **more):
    given = {"image_id": image, "track_id": track_id, "category_id": 7, "bbox": [10, 20, 30, 40]}
    return given | more


def seeds_of(folder, content, hints=HINTS):
    path = folder / "coco.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read(path, hints)


def frames(track):
    return [keyframe.frame if keyframe.box else -keyframe.frame for keyframe in track.keyframes]


def test_frames_between_annotated_ones_say_nothing(tmp_path):
    (seeds,) = seeds_of(tmp_path, document([box_in(10), box_in(11), box_in(12)]))
    (track,) = seeds.tracks
    assert (seeds.name, track.id, track.label) == ("train/street", 5, "car")
    assert track.keyframes == tuple(Keyframe(frame, BOX) for frame in (0, 30, 60))


def test_an_image_with_other_boxes_only_says_that_the_object_is_outside(tmp_path):
    boxes = [box_in(10), box_in(12), *(box_in(image, 6) for image in (10, 11, 12))]
    (seeds,) = seeds_of(tmp_path, document(boxes))
    assert [frames(track) for track in seeds.tracks] == [[0, -30, 60], [0, 30, 60]]


def test_an_image_without_boxes_is_not_annotated_unless_it_says_so(tmp_path):
    content = document([box_in(10), box_in(12)])
    assert frames(seeds_of(tmp_path, content)[0].tracks[0]) == [0, 60]
    content["images"][1]["neg_category_ids"] = [7]
    assert frames(seeds_of(tmp_path, content)[0].tracks[0]) == [0, -30, 60]
    content["images"][1]["not_exhaustive_category_ids"] = [7]
    assert frames(seeds_of(tmp_path, content)[0].tracks[0]) == [0, 60]


def test_instance_ids_do_as_track_ids(tmp_path):
    """As in CocoVID, where they are unique in a video only, and may be 0."""
    boxes = [box_in(10, None, instance_id=0), box_in(11, None, instance_id=0)]
    (seeds,) = seeds_of(tmp_path, document(boxes))
    assert [(track.id, frames(track)) for track in seeds.tracks] == [(1, [0, 30])]


def test_frame_id_counts_from_0_or_from_1(tmp_path):
    def images(numbers):
        return [{"id": 10 + n, "video_id": 1, "frame_id": number} for n, number in numbers]

    boxes = [box_in(10), box_in(11)]
    (zero,) = seeds_of(tmp_path, document(boxes, images(enumerate([0, 1, 2]))))
    assert (frames(zero.tracks[0]), zero.notes) == ([0, 1], ())
    (one,) = seeds_of(tmp_path, document(boxes, images(enumerate([1, 2, 3]))))
    assert (frames(one.tracks[0]), one.notes) == (
        [0, 1],
        ("Its frame_id are taken to count from 1.",),
    )
    (sparse,) = seeds_of(tmp_path, document(boxes, images(enumerate([1, 3, 5]))))
    assert (frames(sparse.tracks[0]), sparse.notes) == ([1, 3], ())


def test_youtube_vis_has_a_list_of_boxes_with_gaps(tmp_path):
    listed = [None, [10, 20, 30, 40], None, None, [10, 20, 30, 40], None]
    content = document([{"id": 9, "video_id": 1, "category_id": 7, "bboxes": listed}], [])
    del content["images"]
    (seeds,) = seeds_of(tmp_path, content)
    assert [(track.id, frames(track)) for track in seeds.tracks] == [(9, [1, -2, 4, -5])]


def test_crowds_are_left_out_and_occlusion_is_taken_over(tmp_path):
    boxes = [box_in(10, iscrowd=1), box_in(11, occluded=True)]
    (seeds,) = seeds_of(tmp_path, document(boxes))
    assert seeds.tracks[0].keyframes == (Keyframe(30, BOX, occluded=True),)


def test_the_pixels_origin_may_be_1(tmp_path):
    (seeds,) = seeds_of(tmp_path, document([box_in(10)]), import_hints(pixel_origin=1))
    assert seeds.tracks[0].keyframes[0].box == BoundingBox(9, 19, 30, 40)


def test_labels_come_from_categories_or_from_hints(tmp_path):
    boxes = [box_in(10, 1), box_in(10, 2, category_id=8), box_in(10, 3, category_id=None)]
    hints = import_hints(label="thing", labels={8: "van", 7: "never"})
    (seeds,) = seeds_of(tmp_path, document(boxes), hints)
    assert [track.label for track in seeds.tracks] == ["car", "van", "thing"]


def test_each_video_has_its_own_tracks(tmp_path):
    content = document([box_in(10), box_in(20)])
    content["videos"].append({"id": 2, "name": "b", "file_name": "b.mp4"})
    content["images"].append({"id": 20, "video_id": 2, "frame_index": 4})
    one, two = seeds_of(tmp_path, content)
    assert [(seeds.name, frames(seeds.tracks[0])) for seeds in (one, two)] == [
        ("train/street", [0]),
        ("b.mp4", [4]),
    ]


def without(name, entry):
    return {key: value for key, value in entry.items() if key != name}


IMAGE = {"id": 10, "video_id": 1, "frame_index": 0}
BAD = [
    ("{", r": not valid JSON"),
    ("[]", r"\$: \[\]: "),
    ({}, r"\$: videos is missing"),
    (document(3), r"\$\.annotations: 3: "),
    (document([box_in(10, None)]), r"\$\.annotations\[0\]: track_id is missing"),
    (document([box_in(99)]), r"\$\.annotations\[0\]\.image_id: no image has the id 99"),
    (document([box_in(10, bbox=[1, 2, 3])]), r"\$\.annotations\[0\]\.bbox: \[1, 2, 3\]: "),
    (document([box_in(10, bbox=[1, 2, 0, 4])]), r"\$\.annotations\[0\]\.bbox: .* is no box"),
    (document([without("bbox", box_in(10))]), r"\$\.annotations\[0\]: bbox is missing"),
    (document([box_in(10, category_id=8)]), r"\[0\]\.category_id: no category has the id 8"),
    (document([box_in(10), box_in(10)]), r"\[1\]\.bbox: this track has a box in frame 0"),
    (document([], [without("video_id", IMAGE)]), r"\$\.images\[0\]: .* no frame of a video"),
    (document([], [without("frame_index", IMAGE)]), r"\$\.images\[0\]: .* no frame of a video"),
    (document([], [IMAGE | {"video_id": 2}]), r"\$\.images\[0\]\.video_id: no video has the id 2"),
    (document([], [IMAGE, IMAGE | {"id": 11}]), r"\$\.images\[1\]: .* stands there already"),
    (document([], [IMAGE, IMAGE | {"frame_index": 1}]), r"\$\.images\[1\]: .* stands there"),
    (
        document([box_in(10)], categories=[{"id": 7, "name": "a\rb"}]),
        r"\$\.annotations\[0\]: 'a\\rb' cannot be a label",
    ),
    (document([{"id": 1, "video_id": 4, "bboxes": []}]), r"\[0\]\.video_id: no video has the id 4"),
]


@pytest.mark.parametrize(("content", "what"), BAD)
def test_a_bad_file_is_named_with_the_place(tmp_path, content, what):
    with pytest.raises(SitupError, match=what) as caught:
        seeds_of(tmp_path, content)
    assert str(caught.value).startswith(f"{tmp_path / 'coco.json'}: ")


def test_it_recognizes_its_own_kind(tmp_path):
    def recognized(content):
        return recognizes_coco(Path("x.json"), json.dumps(content).encode()[:4096])

    video = labelled_video(labelled_track(1, {0: BOX}))
    assert recognizes_coco(Path("x.json"), write(tmp_path, video).read_bytes()[:4096])
    assert recognized(document([box_in(10)]))
    assert not recognized({"version": 1, "videos": [{"path": "a.mp4", "tracks": []}]})
    assert not recognized([{"data": {}, "annotations": []}])


@given(
    st.lists(
        st.tuples(
            st.lists(st.integers(1, 3), max_size=3, unique=True),
            st.lists(st.integers(1, 3), max_size=2),
            st.lists(st.integers(1, 3), max_size=2),
        ),
        min_size=1,
        max_size=12,
    )
)
def test_absences_are_those_that_the_images_claim(tmp_path_factory, images):
    """Of each image: classes with a box in it, negative ones, and those left open."""
    content = {
        "videos": [{"id": 1}],
        "categories": [{"id": number, "name": "a"} for number in (1, 2, 3)],
        "images": [
            {"id": frame, "video_id": 1, "frame_index": frame, "neg_category_ids": negative,
             "not_exhaustive_category_ids": left_open}
            for frame, (_, negative, left_open) in enumerate(images)
        ],
        "annotations": [
            {"image_id": frame, "track_id": number, "category_id": number, "bbox": [1, 2, 3, 4]}
            for frame, (numbers, _, _) in enumerate(images)
            for number in numbers
        ],
    }  # fmt: skip
    (seeds,) = seeds_of(tmp_path_factory.mktemp("coco"), content)
    for track in seeds.tracks:
        expected, outside = [], True
        for frame, (numbers, negative, left_open) in enumerate(images):
            if track.id in numbers:
                expected.append(frame)
                outside = False
            elif not outside and track.id not in left_open and (numbers or track.id in negative):
                expected.append(-frame)
                outside = True
        assert frames(track) == expected
