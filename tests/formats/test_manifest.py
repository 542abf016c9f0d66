"""Manifests: what is accepted, how each problem is told, and that what is written reads back."""

import copy
import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from situp_annotate.errors import ManifestError
from situp_annotate.formats.class_labels import is_label
from situp_annotate.formats.manifest import (
    Manifest,
    dump_manifest,
    load_manifest,
    manifest_schema,
)
from situp_annotate.formats.manifest.ids import default_id, is_safe_id, unique_ids
from situp_annotate.formats.manifest.schema import (
    InfoEntry,
    KeyframeEntry,
    ManifestEntry,
    TrackEntry,
    VideoEntry,
)
from situp_annotate.formats.manifest.wording import RULES
from situp_annotate.types import MOST_PIXELS, BoundingBox, Extend, Keyframe, Method, Track, VideoJob

BOX = [10, 20, 30, 40]
SHORT = {"id": 1, "label": "car", "frame": 0, "box": BOX}
VIDEO = {"path": "a.mp4", "tracks": [SHORT]}


def video(**changes):
    return {**copy.deepcopy(VIDEO), **changes}


def track(**changes):
    return {**copy.deepcopy(SHORT), **changes}


def manifest(*videos):
    return {"version": 1, "videos": list(videos)}


def tracks(*items):
    return manifest(video(tracks=list(items)))


def keyframes(*items):
    return tracks({"id": 1, "label": "car", "keyframes": list(items)})


def without(entry, *keys):
    return {key: value for key, value in entry.items() if key not in keys}


def write(folder, content):
    path = folder / "manifest.json"
    if not isinstance(content, bytes):
        content = (content if isinstance(content, str) else json.dumps(content)).encode()
    path.write_bytes(content)
    return path


def problems(folder, content, **options):
    """The problems' places and texts, without the name of the file."""
    path = write(folder, content)
    with pytest.raises(ManifestError) as caught:
        load_manifest(path, **options)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}: ") for line in lines)
    return [line.removeprefix(f"{path}: ") for line in lines]


# ---- what is accepted ----------------------------------------------------------------------


def test_everything_a_manifest_can_say(tmp_path):
    path = write(
        tmp_path,
        {
            "$schema": "manifest.schema.json",
            "version": 1,
            "videos": [
                {
                    "path": "clips/street.mp4",
                    "id": "street",
                    "info": {"width": 640, "height": 360, "frame_rate": "30000/1001", "frames": 9},
                    "tracks": [
                        {
                            "id": 1,
                            "label": "person",
                            "attributes": {"colour": "red", "n": [1, None, {"deep": True}]},
                            "keyframes": [
                                {"frame": 0, "box": [1, 2.5, 3, 4]},
                                {"frame": 4, "box": [-5, 6, 7, 8], "occluded": True},
                                {"frame": 9, "outside": True},
                            ],
                        },
                        {
                            "id": 7,
                            "label": "car",
                            "method": "linear",
                            "extend": "both",
                            "frame": 3,
                            "box": [0.5, 0, 1, 1],
                        },
                    ],
                },
                {"path": "night/b.mp4", "tracks": []},
            ],
        },
    )
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
    person = Track(
        1,
        "person",
        (
            Keyframe(0, BoundingBox(1.0, 2.5, 3.0, 4.0)),
            Keyframe(4, BoundingBox(-5.0, 6.0, 7.0, 8.0), occluded=True),
            Keyframe(9, None),
        ),
        {"colour": "red", "n": [1, None, {"deep": True}]},
    )
    car = Track(
        7,
        "car",
        (Keyframe(3, BoundingBox(0.5, 0.0, 1.0, 1.0)),),
        method=Method.LINEAR,
        extend=Extend.BOTH,
    )
    assert load_manifest(str(path)) == Manifest(
        path,
        sha256,
        (
            VideoJob("street", tmp_path / "clips/street.mp4", (person, car), sha256, 9, (360, 640)),
            VideoJob("night-b", tmp_path / "night/b.mp4", (), sha256),
        ),
    )


def test_box_numbers_become_floats(tmp_path):
    box = load_manifest(write(tmp_path, tracks(track()))).jobs[0].tracks[0].keyframes[0].box
    assert [type(value) for value in (box.x, box.y, box.width, box.height)] == [float] * 4


def test_a_byte_order_mark_is_no_obstacle(tmp_path):
    path = write(tmp_path, b"\xef\xbb\xbf" + json.dumps(tracks(track())).encode())
    assert len(load_manifest(path).jobs) == 1


def test_the_folder_may_be_named_without_a_path(tmp_path, monkeypatch):
    write(tmp_path, manifest(video(path="clips/a.mp4")))
    monkeypatch.chdir(tmp_path)
    assert load_manifest("manifest.json").jobs[0].path == Path("clips/a.mp4")


# ---- each problem --------------------------------------------------------------------------

REFUSED = {
    # name: (document, the place, words of the line)
    "top is a list": ([], "$", ["[] is not allowed", "must be an object"]),
    "top is null": (None, "$", ["null is not allowed", "must be an object"]),
    "no version": ({"videos": [VIDEO]}, "$.version", ["missing", "version must be 1"]),
    "no videos key": ({"version": 1}, "$.videos", ["missing", "at least one video"]),
    "no videos": (manifest(), "$.videos", ["[] is not allowed", "at least one video"]),
    "version as text": (
        {"version": "1", "videos": [VIDEO]},
        "$.version",
        ['"1" is not allowed', "version must be 1"],
    ),
    "version true": (
        {"version": True, "videos": [VIDEO]},
        "$.version",
        ["true is not allowed", "version must be 1"],
    ),
    "version null": (
        {"version": None, "videos": [VIDEO]},
        "$.version",
        ["null is not allowed", "version must be 1"],
    ),
    "version 2": (
        {"version": 2, "videos": "whatever"},
        "$.version",
        ["2 is not supported", "version must be 1"],
    ),
    "unknown key, near one": (
        {**manifest(VIDEO), "vidoes": []},
        "$.vidoes",
        ["unknown key", 'did you mean "videos"?'],
    ),
    "unknown key, near none": (
        manifest(video(zzz=1)),
        "$.videos[0].zzz",
        ["unknown key", "path, id, tracks, info"],
    ),
    "unknown key that is no name": (
        manifest(video(**{"a b": 1})),
        '$.videos[0]["a b"]',
        ["unknown key"],
    ),
    "unknown key of a track": (
        tracks(track(lable="x")),
        "$.videos[0].tracks[0].lable",
        ['did you mean "label"?'],
    ),
    "unknown key of a keyframe": (
        keyframes({"frame": 0, "box": BOX, "Occluded": True}),
        "$.videos[0].tracks[0].keyframes[0].Occluded",
        ['did you mean "occluded"?'],
    ),
    "unknown key of info": (
        manifest(video(info={"widht": 3})),
        "$.videos[0].info.widht",
        ['did you mean "width"?'],
    ),
    "video is text": (manifest("a.mp4"), "$.videos[0]", ['"a.mp4" is not allowed', "an object"]),
    "no path": (manifest({"tracks": [SHORT]}), "$.videos[0].path", ["missing", "path must be"]),
    "empty path": (manifest(video(path="")), "$.videos[0].path", ['"" is not allowed']),
    "path of a number": (manifest(video(path=3)), "$.videos[0].path", ["3 is not allowed"]),
    "null character in a path": (manifest(video(path="a\0b")), "$.videos[0].path", ["\\u0000"]),
    "absolute path": (
        manifest(video(path="/etc/a.mp4")),
        "$.videos[0].path",
        ['"/etc/a.mp4" is absolute', "--allow-outside"],
    ),
    "path upwards": (
        manifest(video(path="x/../../a.mp4")),
        "$.videos[0].path",
        ['"x/../../a.mp4" leads outside', "--allow-outside"],
    ),
    "no tracks": (manifest({"path": "a.mp4"}), "$.videos[0].tracks", ["missing", "an empty one"]),
    "tracks null": (manifest(video(tracks=None)), "$.videos[0].tracks", ["null is not allowed"]),
    "tracks as an object": (manifest(video(tracks={"1": 2})), "$.videos[0].tracks", ["an object"]),
    "track is a number": (tracks(3), "$.videos[0].tracks[0]", ["3 is not allowed", "a track must"]),
    "id as text": (tracks(track(id="1")), "$.videos[0].tracks[0].id", ['"1" is not allowed']),
    "id true": (tracks(track(id=True)), "$.videos[0].tracks[0].id", ["true is not allowed"]),
    "id as a float": (tracks(track(id=1.0)), "$.videos[0].tracks[0].id", ["1.0 is not allowed"]),
    "id zero": (tracks(track(id=0)), "$.videos[0].tracks[0].id", ["0 is not allowed", "from 1"]),
    "id too large": (tracks(track(id=2**31)), "$.videos[0].tracks[0].id", ["2147483648 is not"]),
    "no track id": (tracks(without(SHORT, "id")), "$.videos[0].tracks[0].id", ["missing"]),
    "track id twice": (
        tracks(track(), track()),
        "$.videos[0].tracks[1].id",
        ["1 is not allowed", "$.videos[0].tracks[0] has this id"],
    ),
    "no label": (tracks(without(SHORT, "label")), "$.videos[0].tracks[0].label", ["missing"]),
    "empty label": (tracks(track(label="")), "$.videos[0].tracks[0].label", ['"" is not allowed']),
    "blank label": (tracks(track(label=" ")), "$.videos[0].tracks[0].label", ["not empty"]),
    **{
        f"{kind} in a label": (
            tracks(track(label=f"a{character}b")),
            "$.videos[0].tracks[0].label",
            ["is not allowed", "no control characters, such as line breaks"],
        )
        for kind, character in {
            "carriage return": "\r",
            "line break": "\n",
            "tab": "\t",
            "null": "\0",
            "next line": "\x85",
        }.items()
    },
    "attributes as a list": (
        tracks(track(attributes=[1])),
        "$.videos[0].tracks[0].attributes",
        ["[1] is not allowed", "must be an object"],
    ),
    "unknown method": (
        tracks(track(method="magic")),
        "$.videos[0].tracks[0].method",
        ['"magic" is not allowed', "situp, linear, cubic, hold"],
    ),
    "unknown extend": (
        tracks(track(extend="backward")),
        "$.videos[0].tracks[0].extend",
        ['"backward" is not allowed', "forward, both"],
    ),
    "negative frame": (tracks(track(frame=-1)), "$.videos[0].tracks[0].frame", ["-1", "from 0"]),
    "frame as a float": (tracks(track(frame=1.5)), "$.videos[0].tracks[0].frame", ["whole number"]),
    "negative width": (
        tracks(track(box=[1, 2, -5, 4])),
        "$.videos[0].tracks[0].box[2]",
        ["-5 is not allowed; width must be greater than 0 and at most 1000000000."],
    ),
    "no height": (
        tracks(track(box=[1, 2, 3, 0])),
        "$.videos[0].tracks[0].box[3]",
        ["0 is not allowed; height must be greater than 0 and at most 1000000000."],
    ),
    "a place beyond all pictures": (
        tracks(track(box=[-1e300, 2, 3, 4])),
        "$.videos[0].tracks[0].box[0]",
        ["-1e+300 is not allowed; x must be a number from -1000000000 to 1000000000."],
    ),
    "box of three": (
        tracks(track(box=[1, 2, 3])),
        "$.videos[0].tracks[0].box",
        ["[1, 2, 3] is not allowed", "four numbers: x, y, width, height"],
    ),
    "box of five": (tracks(track(box=[1] * 5)), "$.videos[0].tracks[0].box", ["four numbers"]),
    "box as an object": (tracks(track(box={"x": 1})), "$.videos[0].tracks[0].box", ["an object"]),
    "box null": (tracks(track(box=None)), "$.videos[0].tracks[0].box", ["null is not allowed"]),
    "text in a box": (tracks(track(box=["1", 2, 3, 4])), "$.videos[0].tracks[0].box[0]", ['"1"']),
    "true in a box": (tracks(track(box=[1, True, 3, 4])), "$.videos[0].tracks[0].box[1]", ["true"]),
    "too much for a float": (
        tracks(track(box=[1, 2, 10**400, 4])),
        "$.videos[0].tracks[0].box[2]",
        ["…", "is not allowed"],
    ),
    "NaN in a box": (
        tracks(track(box=[float("nan"), 2, 3, 4])),
        "$.videos[0].tracks[0].box[0]",
        ["NaN is not allowed; numbers must be finite."],
    ),
    "Infinity in attributes": (
        tracks(track(attributes={"a": [float("-inf")]})),
        "$.videos[0].tracks[0].attributes.a[0]",
        ["-Infinity is not allowed; numbers must be finite."],
    ),
    "half a surrogate pair": (
        tracks(track(label="a\ud800")),
        "$.videos[0].tracks[0].label",
        ["surrogate", "valid Unicode"],
    ),
    "shorthand and keyframes: box": (
        tracks({**without(SHORT, "frame"), "keyframes": [{"frame": 0, "box": BOX}]}),
        "$.videos[0].tracks[0].box",
        ["not allowed beside keyframes"],
    ),
    "neither shorthand nor keyframes": (
        tracks({"id": 1, "label": "car"}),
        "$.videos[0].tracks[0]",
        ["nothing says where", "keyframes or frame and box"],
    ),
    "shorthand without frame": (
        tracks(without(SHORT, "frame")),
        "$.videos[0].tracks[0].frame",
        ["missing"],
    ),
    "shorthand without box": (
        tracks(without(SHORT, "box")),
        "$.videos[0].tracks[0].box",
        ["missing", "four numbers"],
    ),
    "no keyframes": (keyframes(), "$.videos[0].tracks[0].keyframes", ["at least one keyframe"]),
    "keyframe is a number": (keyframes(0), "$.videos[0].tracks[0].keyframes[0]", ["a keyframe"]),
    "keyframe without frame": (
        keyframes({"box": BOX}),
        "$.videos[0].tracks[0].keyframes[0].frame",
        ["missing"],
    ),
    "keyframes out of order": (
        keyframes({"frame": 9, "box": BOX}, {"frame": 4, "box": BOX}, {"frame": 6, "box": BOX}),
        "$.videos[0].tracks[0].keyframes[1].frame",
        ["4 is not allowed", "before is at 9", "must increase"],
    ),
    "two keyframes at a frame": (
        keyframes({"frame": 9, "box": BOX}, {"frame": 9, "box": BOX}),
        "$.videos[0].tracks[0].keyframes[1].frame",
        ["9 is not allowed", "$.videos[0].tracks[0].keyframes[0] is at this frame already"],
    ),
    "neither box nor outside": (
        keyframes({"frame": 0, "box": BOX}, {"frame": 1, "outside": False}),
        "$.videos[0].tracks[0].keyframes[1].box",
        ["missing", '"outside": true'],
    ),
    "outside with a box": (
        keyframes({"frame": 0, "box": BOX}, {"frame": 1, "outside": True, "box": BOX}),
        "$.videos[0].tracks[0].keyframes[1].box",
        ["not allowed where outside is true"],
    ),
    "outside at first": (
        keyframes({"frame": 0, "outside": True}, {"frame": 1, "box": BOX}),
        "$.videos[0].tracks[0].keyframes[0].outside",
        ["must begin with a box"],
    ),
    "occluded as a number": (
        keyframes({"frame": 0, "box": BOX, "occluded": 1}),
        "$.videos[0].tracks[0].keyframes[0].occluded",
        ["1 is not allowed", "true or false"],
    ),
    "outside as text": (
        keyframes({"frame": 0, "box": BOX, "outside": "no"}),
        "$.videos[0].tracks[0].keyframes[0].outside",
        ['"no" is not allowed', "true or false"],
    ),
    "video id twice": (
        manifest(video(id="Street"), video(path="b.mp4", id="street")),
        "$.videos[1].id",
        ['"street" is that of $.videos[0] already', "upper and lower case"],
    ),
    "default id twice": (
        manifest(video(path="a.mp4"), video(path="a.avi")),
        "$.videos[1].path",
        ['"a" is that of $.videos[0] already', 'an "id" of its own'],
    ),
    "default id is another's id": (
        manifest(video(id="b"), video(path="b.mp4")),
        "$.videos[1].path",
        ['"b" is that of $.videos[0] already'],
    ),
    "info as a list": (manifest(video(info=[])), "$.videos[0].info", ["[] is not allowed"]),
    "info without width": (manifest(video(info={"width": 0})), "$.videos[0].info.width", ["1 or"]),
    "info of half a frame": (manifest(video(info={"frames": 0.5})), "$.videos[0].info.frames", []),
    "info frame rate as words": (
        manifest(video(info={"frame_rate": "fast"})),
        "$.videos[0].info.frame_rate",
        ['"fast" is not allowed', "30000/1001"],
    ),
    "info frame rate over zero": (
        manifest(video(info={"frame_rate": "25/0"})),
        "$.videos[0].info.frame_rate",
        ['"25/0" is not allowed'],
    ),
    "info frame rate true": (
        manifest(video(info={"frame_rate": True})),
        "$.videos[0].info.frame_rate",
        ["true is not allowed"],
    ),
}


@pytest.mark.parametrize(("document", "place", "words"), REFUSED.values(), ids=REFUSED)
def test_each_problem_is_told_at_its_place(tmp_path, document, place, words):
    (line,) = problems(tmp_path, document)
    found, _, text = line.partition(": ")
    assert found == place
    assert all(word in text for word in words), text
    assert text.endswith((".", "?"))


@pytest.mark.parametrize(
    "video_id",
    [
        *("", ".", "..", ".hidden", "a/b", "a\\b", "a\nb", "a\x85b", "a\u2028b", " a", "a ", "a\0"),
        *("a" * 101, "\N{MUSICAL SYMBOL G CLEF}" * 51, "batch.json", "Batch.JSON", 3, None),
    ],
)
def test_ids_that_cannot_name_a_folder(tmp_path, video_id):
    (line,) = problems(tmp_path, manifest(video(id=video_id)))
    assert line.startswith("$.videos[0].id: ")
    assert "id must be text that can name a folder" in line
    assert line.isprintable()


@pytest.mark.parametrize("video_id", ["a", "Straße 1", "a.b", "12:30", "a" * 100, "車", "-"])
def test_ids_that_can(tmp_path, video_id):
    assert load_manifest(write(tmp_path, manifest(video(id=video_id)))).jobs[0].id == video_id


def test_a_key_given_twice(tmp_path):
    text = '{"version": 1, "videos": [{"path": "a.mp4", "path": "b.mp4", "tracks": []}]}'
    assert problems(tmp_path, text) == [
        "$.videos[0].path: this key is given more than once; keep one, since only one counts."
    ]


def test_nesting_has_a_limit(tmp_path):
    deep = "[" * 300 + "]" * 300
    text = json.dumps(tracks(track(attributes={"a": "HERE"}))).replace('"HERE"', deep)
    (line,) = problems(tmp_path, text)
    assert line.startswith("$.videos[0].tracks[0].attributes.a[0][0]")
    assert line.endswith("nested too deeply; at most 50 levels are allowed.")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'{"version": 1,\n "videos": oops}', "line 2, column 12: not JSON"),
        (b"", "line 1, column 1: not JSON"),
        (b'{"a": 1} 2', "line 1, column 10: not JSON"),
        (b'{"label": "\xff"}', "byte 11: not UTF-8; save the manifest as UTF-8 text."),
        ('{"version": 1}'.encode("utf-16"), "byte 0: not UTF-8"),
        (b"[" * 100_000, "nested too deeply"),
        (b"9" * 5000, "too many digits"),
    ],
)
def test_what_is_no_json(tmp_path, content, words):
    (line,) = problems(tmp_path, content)
    assert words in line


def test_no_file(tmp_path):
    with pytest.raises(ManifestError, match=r"nothing\.json: there is no such file; .*init"):
        load_manifest(tmp_path / "nothing.json")
    with pytest.raises(ManifestError, match="this is a folder; give the manifest file"):
        load_manifest(tmp_path)
    with pytest.raises(ManifestError, match="no file can have this name"):
        load_manifest("a\0b")


# ---- paths that leave the folder -----------------------------------------------------------


def test_symbolic_links_count_where_they_lead(tmp_path):
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir()
    outside.mkdir()
    (inside / "link").symlink_to(outside)
    (inside / "loop").symlink_to("loop")
    (inside / "here").symlink_to(".")
    document = manifest(
        video(path="link/a.mp4"), video(path="loop/a.mp4"), video(path="here/a.mp4")
    )
    first, *others = problems(inside, document)
    assert '"link/a.mp4" leads outside' in first
    assert not any("here" in line for line in others)
    assert len(load_manifest(inside / "manifest.json", allow_outside=True).jobs) == 3


def test_allow_outside(tmp_path):
    document = manifest(video(path="/data/a.mp4"), video(path="../b.mp4"))
    jobs = load_manifest(write(tmp_path, document), allow_outside=True).jobs
    assert [job.path for job in jobs] == [Path("/data/a.mp4"), tmp_path / "../b.mp4"]
    assert [job.id for job in jobs] == ["data-a", "b"]


def test_dots_that_stay_inside_are_fine(tmp_path):
    load_manifest(write(tmp_path, manifest(video(path="x/../a.mp4"))))


# ---- all problems together -----------------------------------------------------------------


def test_all_problems_at_once_in_the_order_of_the_document(tmp_path):
    document = {
        "videos": [
            {
                "id": "same",
                "path": "/a.mp4",
                "tracks": [
                    {"id": 1, "label": "", "frame": 0, "box": [0, float("nan"), 0, 1]},
                    "no track",
                    {
                        "id": 1,
                        "label": "x",
                        "keyframes": [
                            {"frame": 5, "outside": True},
                            {"frame": "6"},
                            {"frame": 3, "box": BOX, "why": 1},
                        ],
                    },
                ],
            },
            7,
            {"path": "b.mp4", "tracks": None, "id": "same"},
        ],
        "version": 1,
        "extra": 0,
    }
    places = [line.partition(": ")[0] for line in problems(tmp_path, document)]
    assert places == [
        "$.videos[0].path",
        "$.videos[0].tracks[0].label",
        "$.videos[0].tracks[0].box[1]",
        "$.videos[0].tracks[0].box[2]",
        "$.videos[0].tracks[1]",
        "$.videos[0].tracks[2].id",
        "$.videos[0].tracks[2].keyframes[0].outside",
        "$.videos[0].tracks[2].keyframes[1].box",
        "$.videos[0].tracks[2].keyframes[1].frame",
        "$.videos[0].tracks[2].keyframes[2].frame",
        "$.videos[0].tracks[2].keyframes[2].why",
        "$.videos[1]",
        "$.videos[2].tracks",
        "$.videos[2].id",
        "$.extra",
    ]


def test_another_version_silences_everything_else(tmp_path):
    assert len(problems(tmp_path, {"version": 3, "videos": [1, 2, 3], "new": 0})) == 1


def test_at_most_fifty_lines_and_the_number_of_the_rest(tmp_path):
    lines = problems(tmp_path, manifest(*range(73)))
    assert len(lines) == 51
    assert lines[-1] == "and 23 more."


# ---- default ids ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("street.mp4", "street"),
        ("clips/street.mp4", "clips-street"),
        ("./clips//street.2.mp4", "clips-street.2"),
        ("../x/a.mp4", "x-a"),
        ("/data/a.mp4", "data-a"),
        ("Car4", "Car4"),
        ("Car4/img", "Car4"),
        ("run.2024", "run.2024"),
        (".hidden/a.mp4", "hidden-a"),
        ("a\nb.mp4", "a-b"),
        ("batch.json.mp4", "video-batch.json"),
        ("...", "video-"),
        ("d/" * 60 + "end.mp4", ("-".join("d" * 60) + "-end")[-100:].lstrip("-. ")),
    ],
)
def test_default_ids_follow_from_the_path(tmp_path, path, expected):
    for folder in ("Car4/img", "run.2024"):
        (tmp_path / folder).mkdir(parents=True)
    assert default_id(path, tmp_path).lstrip("-") == expected
    assert is_safe_id(default_id(path, tmp_path))


def test_the_manifest_s_own_folder_gives_its_name(tmp_path):
    assert default_id(".", tmp_path) == tmp_path.name


def test_unique_ids_number_what_would_collide(tmp_path):
    paths = ["a.mp4", "a.avi", "A.mov", "a-2.mp4", "b.mp4", f"{'x' * 120}.mp4", f"{'x' * 110}.avi"]
    ids = unique_ids(paths, tmp_path)
    assert ids[:5] == ["a", "a-2", "A-3", "a-2-2", "b"]
    assert ids[5:] == ["x" * 100, "x" * 98 + "-2"]


@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1))
def test_default_ids_are_always_safe(path):
    folder = Path("/nowhere at all")
    assert is_safe_id(default_id(path, folder))
    assert len(set(map(str.casefold, unique_ids([path, path, path + "/"], folder)))) == 3


def test_a_path_that_no_file_system_takes_is_a_path(tmp_path):
    (job,) = load_manifest(write(tmp_path, manifest({"path": "x" * 300, "tracks": []}))).jobs
    assert job.id == "x" * 100


def test_a_key_is_shown_no_longer_than_a_value(tmp_path):
    (problem,) = problems(tmp_path, manifest({**VIDEO, "x" * 100_000: 1}))
    assert "unknown key" in problem
    assert len(problem) < 500


# ---- writing -------------------------------------------------------------------------------

_numbers = st.floats(allow_nan=False, allow_infinity=False)
_places = st.floats(-MOST_PIXELS, MOST_PIXELS)
_extents = st.floats(0, MOST_PIXELS, exclude_min=True)
_text = st.text(st.characters(exclude_categories=["Cs"]))
_json = st.recursive(
    st.none() | st.booleans() | st.integers() | _numbers | _text,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_text, inner, max_size=3),
    max_leaves=5,
)
_boxes = st.builds(BoundingBox, _places, _places, _extents, _extents)
_frames = st.integers(0, 2**31 - 1)


@st.composite
def _tracks(draw, track_id):
    frames = sorted(draw(st.sets(_frames, min_size=1, max_size=4)))
    points = [
        Keyframe(frame, draw(_boxes if i == 0 else st.none() | _boxes), draw(st.booleans()))
        for i, frame in enumerate(frames)
    ]
    label = draw(_text.filter(is_label))
    return Track(
        track_id,
        label,
        tuple(points),
        draw(st.dictionaries(_text, _json, max_size=2)),
        draw(st.none() | st.sampled_from(Method)),
        draw(st.none() | st.sampled_from(Extend)),
    )


@st.composite
def _jobs(draw, folder):
    ids = draw(st.lists(_text.filter(is_safe_id), min_size=1, max_size=3, unique_by=str.casefold))
    paths = st.sampled_from([folder / "a.mp4", folder / "b/c d.mp4", Path("/e/f"), folder])
    return [
        VideoJob(
            video_id,
            draw(paths),
            tuple(draw(_tracks(i)) for i in draw(st.sets(st.integers(1, 99), max_size=2))),
        )
        for video_id in ids
    ]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(data=st.data())
def test_what_is_dumped_loads_as_it_was(tmp_path, data):
    jobs = data.draw(_jobs(tmp_path))
    loaded = load_manifest(write(tmp_path, dump_manifest(jobs, tmp_path)), allow_outside=True)
    assert [replace(job, manifest_sha256=None) for job in loaded.jobs] == jobs


def test_the_text_reads_well(tmp_path):
    keyframed = Track(1, "a", (Keyframe(0, BoundingBox(1.0, 2.5, 3, 4)), Keyframe(9, None)))
    short = Track(2, "b", (Keyframe(0, BoundingBox(1, 2, 3, 4)),), {"k": 1})
    jobs = [VideoJob("x", tmp_path / "d/x.mp4", (keyframed, short))]
    assert dump_manifest(jobs, tmp_path, info={"x": {"frames": 3}}) == (
        """\
{
  "version": 1,
  "videos": [
    {
      "path": "d/x.mp4",
      "id": "x",
      "info": {"frames": 3},
      "tracks": [
        {
          "id": 1,
          "label": "a",
          "keyframes": [{"frame": 0, "box": [1, 2.5, 3, 4]}, {"frame": 9, "outside": true}]
        },
        {"id": 2, "label": "b", "attributes": {"k": 1}, "frame": 0, "box": [1, 2, 3, 4]}
      ]
    }
  ]
}
"""
    )


@pytest.mark.parametrize("label", ["", " ", "a\rb", "a\ud800"])
def test_a_label_that_would_be_refused_is_not_written(tmp_path, label):
    odd = Track(7, label, (Keyframe(0, BoundingBox(1, 2, 3, 4)),))
    with pytest.raises(ManifestError, match=r"of track 7 is not allowed; label must be text"):
        dump_manifest([VideoJob("x", tmp_path / "x.mp4", (odd,))], tmp_path)


@pytest.mark.parametrize("value", [float("nan"), {1, 2}, Path(), "\ud800", {"\ud800": 1}])
def test_attributes_that_json_cannot_say(tmp_path, value):
    odd = Track(1, "a", (Keyframe(0, BoundingBox(1, 2, 3, 4)),), {"k": value})
    with pytest.raises(ManifestError, match="cannot be written as JSON"):
        dump_manifest([VideoJob("x", tmp_path / "x.mp4", (odd,))], tmp_path)


def test_a_path_that_is_no_text_is_not_written(tmp_path):
    job = VideoJob("x", Path(os.fsdecode(b"/videos/\xff.mp4")), ())
    with pytest.raises(ManifestError, match=r"udcff\.mp4': the name is not valid UTF-8"):
        dump_manifest([job], tmp_path)


# ---- anything at all -----------------------------------------------------------------------

_keys = st.sampled_from(
    ["version", "videos", "path", "id", "tracks", "label", "frame", "box", "outside", "keyframes"]
)
_odd = st.floats() | st.sampled_from([0, 1, -1, 10**400, True, "", ".", "/", "..", "a.mp4", "a\0"])
_document = st.recursive(
    st.none() | _odd | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(_keys | st.text(max_size=2), inner, max_size=6)
        | st.lists(_odd, min_size=4, max_size=4)
    ),
    max_leaves=30,
)


def _damaged(draw):
    """A valid manifest with some of its values replaced by anything."""
    document = manifest(
        video(info={"frames": 2}),
        video(path="b", tracks=[{"id": 1, "label": "x", "keyframes": [{"frame": 0, "box": BOX}]}]),
    )
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(0, 4))):
        owner = document
        while True:
            keys = list(owner) if isinstance(owner, dict) else range(len(owner))
            key = draw(st.sampled_from(list(keys)))
            if isinstance(owner[key], dict | list) and owner[key] and draw(st.booleans()):
                owner = owner[key]
                continue
            owner[key] = draw(_document)
            break
    return document


@settings(
    max_examples=300,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=st.data())
def test_any_document_gives_a_manifest_or_its_error(tmp_path, data):
    document = data.draw(_document) if data.draw(st.booleans()) else _damaged(data.draw)
    path = write(tmp_path, json.dumps(document))
    try:
        outcome = load_manifest(path, allow_outside=data.draw(st.booleans()))
    except ManifestError as error:
        outcome = str(error)
    if isinstance(outcome, str):
        assert all(line.isprintable() for line in outcome.split("\n"))
        assert all(line.startswith(f"{path}: $") for line in outcome.split("\n")[:50])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary() | st.text().map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_any_bytes_give_a_manifest_or_its_error(tmp_path, content):
    with pytest.raises(ManifestError):  # nothing drawn at random is valid
        load_manifest(write(tmp_path, content))


# ---- the schema ----------------------------------------------------------------------------


def test_the_schema_s_example_loads(tmp_path):
    (example,) = manifest_schema()["examples"]
    assert len(load_manifest(write(tmp_path, example)).jobs) == 1


def test_the_schema_describes_every_key_and_admits_no_null():
    text = json.dumps(manifest_schema())
    assert '"null"' not in text
    assert ": null" not in text
    schema = manifest_schema()
    for entry in [schema, *schema["$defs"].values()]:
        assert entry["description"]
        if entry["type"] == "object":
            assert entry["additionalProperties"] is False
        for key, value in entry.get("properties", {}).items():
            assert "description" in value or "$ref" in value or "items" in value, key


def test_every_key_has_its_rule():
    owners = {
        "": ManifestEntry,
        "videos[].": VideoEntry,
        "info.": InfoEntry,
        "tracks[].": TrackEntry,
        "keyframes[].": KeyframeEntry,
    }
    keys = {
        owner + (field.alias or name)
        for owner, entry in owners.items()
        for name, field in entry.model_fields.items()
    }
    assert keys <= RULES.keys()
    assert {rule for rule in RULES if "box[" not in rule and not rule.endswith("[]")} - {""} == keys
