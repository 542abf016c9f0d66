"""``situp-annotate thin``: the manifest it writes, what it says, and what it refuses."""

import inspect
import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from situp_annotate.cli import cli
from situp_annotate.cli.thin import thin as command
from situp_annotate.finished.thinned import thin_video
from situp_annotate.formats.labels_csv import LabelsCsvSink
from situp_annotate.formats.manifest import dump_manifest, load_manifest
from situp_annotate.outcomes import VideoReport
from situp_annotate.propagation import Skip
from situp_annotate.propagation.thinning import overlaps, thin
from situp_annotate.types import (
    BoundingBox,
    Frame,
    Keyframe,
    Method,
    Provenance,
    State,
    TrackPoint,
    VideoInfo,
)

IMAGE = np.zeros((2, 2), np.uint8)


def write_run(project, video_id, tracks, frames, *, skipped=()):
    """Write what a run leaves of a video of 320 × 200 pixels; tracks: {id: {frame: box}}."""
    folder = project.out / video_id
    folder.mkdir(parents=True)
    (job,) = (job for job in load_manifest(project.manifest).jobs if job.id == video_id)
    (folder / "manifest.json").write_text(dump_manifest([job], folder))
    with LabelsCsvSink(folder / "labels.csv", tracks=job.tracks) as sink:
        for index in range(frames):
            points = [
                point_of(track, index, tracks[track.id][index])
                for track in job.tracks
                if index in tracks.get(track.id, {})
            ]
            sink.write(Frame(index, index, IMAGE), points)
    report = VideoReport(
        id=video_id,
        video=VideoInfo(Path("clip.mp4"), "opencv", 320, 200, Fraction(25)),
        sha256="",
        entry_sha256="",
        frames=frames,
        tracks=(),
        skipped=tuple(skipped),
        findings=(),
        outputs=("labels.csv", "summary.json"),
    )
    (folder / "summary.json").write_text(json.dumps(report.as_dict()))


def point_of(track, frame, box):
    """A label in the state that the track's last keyframe before it says."""
    said = [keyframe for keyframe in track.keyframes if keyframe.frame <= frame]
    human = any(keyframe.frame == frame for keyframe in said)
    return TrackPoint(
        track.id,
        box,
        1.0,
        State.OCCLUDED if said and said[-1].occluded else State.VISIBLE,
        Provenance.HUMAN if human else Provenance.TRACKED,
    )


def sliding(frames, start=(10, 20, 40, 30), pace=(1.5, 0, 0, 0)):
    """A box that moves evenly, in each of the frames."""
    return {f: BoundingBox(*(a + b * f for a, b in zip(start, pace, strict=True))) for f in frames}


def track(number, *keyframes, **more):
    return {"id": number, "label": "car", "keyframes": list(keyframes), **more}


def key(frame, box, **more):
    return {"frame": frame, "box": [box.x, box.y, box.width, box.height], **more}


class Project:
    """A manifest and the output folder of its run."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = folder / "manifest.json"
        self.thinned = folder / "thinned.json"
        self.out = folder / "out"
        self.out.mkdir()

    def write_manifest(self, videos):
        entries = [{"path": f"{name}.mp4", "tracks": tracks} for name, tracks in videos.items()]
        self.manifest.write_text(json.dumps({"version": 1, "videos": entries}))

    def thin(self, *options):
        arguments = ["thin", str(self.manifest), str(self.out), *map(str, options)]
        return CliRunner().invoke(cli, arguments)

    def tracks(self, name="thinned.json"):
        """Tracks of all videos of a manifest, in order."""
        jobs = load_manifest(self.folder / name).jobs
        return [track for job in jobs for track in job.tracks]


@pytest.fixture
def project(tmp_path):
    return Project(tmp_path)


def frames_of(track):
    return [keyframe.frame for keyframe in track.keyframes]


def test_what_is_written_and_said(project):
    # One track bends at 60 and ends with the video; the other is gone from 30 to 49 and from 80.
    bend = sliding(range(61)) | sliding(range(61, 100), (100, 20 - 120, 40, 30), (0, 2, 0, 0))
    gone = sliding(range(5, 30)) | sliding(range(50, 80), (300, 20, 40, 30), (-2, 0, 0, 0))
    project.write_manifest(
        {
            "one": [track(7, key(0, bend[0]), attributes={"colour": "red"})],
            "two": [
                track(3, key(5, gone[5]), {"frame": 30, "outside": True}, key(50, gone[50])),
            ],
        }
    )
    write_run(project, "one", {7: bend}, 100)
    write_run(project, "two", {3: gone}, 100)
    outcome = project.thin("--iou", "0.995")
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(project.thinned.read_text()) == {
        "version": 1,
        "videos": [
            {
                "path": "one.mp4",
                "id": "one",
                "tracks": [
                    track(
                        7,
                        *(key(frame, bend[frame]) for frame in (0, 60, 99)),
                        attributes={"colour": "red"},
                        method="linear",
                        extend="forward",
                    )
                ],
            },
            {
                "path": "two.mp4",
                "id": "two",
                "tracks": [
                    track(
                        3,
                        key(5, gone[5]),
                        key(29, gone[29]),
                        {"frame": 30, "outside": True},
                        key(50, gone[50]),
                        key(79, gone[79]),
                        {"frame": 80, "outside": True},
                        method="linear",
                        extend="forward",
                    )
                ],
            },
        ],
    }
    assert outcome.stdout.splitlines() == [
        "video  status   tracks  boxes  keyframes  per 100 frames  mean IoU  least IoU",
        "one    thinned       1    100          3             3.0     1.000      1.000",
        "two    thinned       1     55          4             7.3     1.000      1.000",
        f"2 of 2 videos thinned: 7 keyframes for 155 boxes; they are in {project.thinned}.",
    ]
    assert outcome.stderr == ""


def test_interpolation_gives_the_labels_back_to_the_last_decimal(project):
    random = np.random.default_rng(1)
    rows = np.cumsum(random.normal(0, 0.4, (300, 4)), axis=0) + (100, 80, 30, 25)
    boxes = {f: BoundingBox(*map(float, row)) for f, row in enumerate(rows)}
    project.write_manifest({"a": [track(1, key(0, boxes[0]))]})
    write_run(project, "a", {1: boxes}, 300)
    assert project.thin("--iou", "0.8").exit_code == 0
    (thinned,) = project.tracks()
    kept = {keyframe.frame: keyframe.box for keyframe in thinned.keyframes}
    assert all(keyframe.box for keyframe in thinned.keyframes)
    assert 2 < len(kept) < 60
    # The first is a person's; the others are as they stand in the file.
    assert kept[0] == boxes[0]
    for frame in list(kept)[1:]:
        assert kept[frame].x == float(f"{boxes[frame].x:.3f}")
    written = {f: BoundingBox(*(round(float(v), 3) for v in row)) for f, row in enumerate(rows)}
    assert overlaps(written, kept).min() >= 0.8
    assert thinned.method is Method.LINEAR


def test_what_a_person_drew_stays_to_the_digit(project):
    boxes = sliding(range(100))
    drawn = BoundingBox(70.00012345, 20, 40, 30.0004)
    boxes[40] = drawn
    project.write_manifest(
        {"a": [track(1, key(0, boxes[0]), key(40, drawn, occluded=True), key(70, boxes[70]))]}
    )
    boxes[55] = BoundingBox(20, 20, 40, 30)  # needs keyframes between those of the person
    write_run(project, "a", {1: boxes}, 100)
    assert project.thin().exit_code == 0
    (thinned,) = project.tracks()
    assert thinned.keyframes == (
        Keyframe(0, boxes[0]),
        Keyframe(40, drawn, occluded=True),
        Keyframe(54, boxes[54], occluded=True),
        Keyframe(55, boxes[55], occluded=True),
        Keyframe(56, boxes[56], occluded=True),
        Keyframe(70, boxes[70]),
        Keyframe(99, boxes[99]),
    )


def test_keyframes_and_boxes_outside_the_picture_are_left_out(project):
    boxes = sliding(range(100), (301, 20, 40, 30), (1, 0, 0, 0))  # leaves at 320: frame 19
    project.write_manifest(
        {"a": [track(1, key(0, boxes[0]), key(50, boxes[50]), key(120, boxes[99]))]}
    )
    skipped = [Skip(1, 50, "Outside."), Skip(1, 120, "Past the end.")]
    write_run(project, "a", {1: boxes}, 100, skipped=skipped)
    assert project.thin().exit_code == 0
    (thinned,) = project.tracks()
    assert frames_of(thinned) == [0, 18, 19]
    assert thinned.keyframes[-1] == Keyframe(19, None)


def test_tracks_without_boxes_stay_as_they_are(project):
    boxes = sliding(range(10))
    project.write_manifest({"a": [track(2, key(12, boxes[0]))], "b": []})
    write_run(project, "a", {}, 10, skipped=[Skip(2, 12, "Past the end.")])
    write_run(project, "b", {}, 10)
    outcome = project.thin()
    assert outcome.exit_code == 0
    assert project.tracks() == project.tracks("manifest.json")
    assert outcome.stdout.splitlines()[1:3] == [
        "a      thinned       1      0          0               –         –          –",
        "b      thinned       0      0          0               –         –          –",
    ]


def test_a_video_without_results_stays_as_it_is(project):
    boxes = sliding(range(10))
    project.write_manifest(
        {"gone": [track(1, key(3, boxes[3]))], "here": [track(1, key(0, boxes[0]))]}
    )
    write_run(project, "here", {1: boxes}, 10)
    outcome = project.thin()
    assert outcome.exit_code == 1
    assert outcome.stderr == (
        f"gone stays as it is: {project.out / 'gone'}: there is no such folder; annotate the "
        f"video first.\n"
    )
    lines = outcome.stdout.splitlines()
    assert lines[1].split() == ["gone", "as", "it", "was", "1", *"–––––"]
    assert lines[-1].startswith("1 of 2 videos thinned: 2 keyframes for 10 boxes")
    untouched, thinned = project.tracks()
    assert untouched == project.tracks("manifest.json")[0]
    assert frames_of(thinned) == [0, 9]


def test_nothing_is_written_when_nothing_is_thinned(project):
    project.write_manifest({"a": [], "b": []})
    outcome = project.thin()
    assert outcome.exit_code == 1
    assert outcome.stderr.splitlines()[-1] == (
        f"Error: {project.out}: no video of {project.manifest} is thinned, so nothing is written."
    )
    assert not project.thinned.exists()


def damage_summary(folder):
    (folder / "summary.json").write_text('{"frames": 10}')


def remove_summary(folder):
    (folder / "summary.json").unlink()


def damage_labels(folder):
    (folder / "labels.csv").write_text("1,1,0,0\n")


def remove_labels(folder):
    (folder / "labels.csv").unlink()


def move_box(folder):
    path = folder / "manifest.json"
    path.write_text(path.read_text().replace("[10, 20, 40, 30]", "[11, 20, 40, 30]"))


@pytest.mark.parametrize(
    ("change", "file", "message"),
    [
        (damage_summary, "/summary.json", "this is not what `situp-annotate run` writes; "),
        (remove_summary, "/summary.json", "cannot be read (No such file or directory); "),
        (damage_labels, "/labels.csv", "the first line is not the header of a labels.csv; "),
        (remove_labels, "/labels.csv", "cannot be read: No such file or directory."),
        (move_box, "", "this run was given other keyframes for track 1 than the manifest has; "),
    ],
)
def test_results_that_cannot_be_used(project, change, file, message):
    boxes = sliding(range(10))
    project.write_manifest({"a": [track(1, key(0, boxes[0]))]})
    write_run(project, "a", {1: boxes}, 10)
    change(project.out / "a")
    outcome = project.thin()
    assert outcome.exit_code == 1
    expected = f"a stays as it is: {project.out / 'a'}{file}: {message}"
    assert outcome.stderr.startswith(expected)


@pytest.fixture
def thinnable(project):
    boxes = sliding(range(10))
    project.write_manifest({"a": [track(1, key(0, boxes[0]))]})
    write_run(project, "a", {1: boxes}, 10)
    return project


def test_does_not_overwrite_unless_told_so(thinnable):
    target = thinnable.thinned
    target.write_text("corrected by hand")
    outcome = thinnable.thin()
    assert outcome.exit_code == 5
    assert outcome.stderr.startswith(f"Error: {target}: there is a file already; ")
    assert target.read_text() == "corrected by hand"
    assert thinnable.thin("--overwrite").exit_code == 0
    assert frames_of(thinnable.tracks()[0]) == [0, 9]


def test_never_replaces_the_manifest_itself(thinnable):
    before = thinnable.manifest.read_text()
    outcome = thinnable.thin("--output", thinnable.manifest, "--overwrite")
    assert outcome.exit_code == 5
    assert "this is the manifest to be thinned" in outcome.stderr
    assert thinnable.manifest.read_text() == before


def test_the_manifest_may_go_elsewhere(thinnable, monkeypatch, tmp_path_factory):
    away = tmp_path_factory.mktemp("away")
    monkeypatch.chdir(thinnable.folder)
    arguments = ["thin", "manifest.json", "out", "--output", str(away / "new" / "t.json")]
    outcome = CliRunner().invoke(cli, arguments)
    assert outcome.exit_code == 0, outcome.output
    assert "Some videos lie outside" in outcome.stderr
    monkeypatch.chdir(away)
    (job,) = load_manifest(away / "new" / "t.json", allow_outside=True).jobs
    assert job.path == thinnable.folder / "a.mp4"
    monkeypatch.chdir(thinnable.folder)
    assert CliRunner().invoke(cli, ["thin", "manifest.json", "out"]).exit_code == 0
    document = json.loads(Path("thinned.json").read_text())
    assert document["videos"][0]["path"] == "a.mp4"


def test_videos_outside_are_taken_only_when_allowed(thinnable):
    document = json.loads(thinnable.manifest.read_text())
    document["videos"][0] |= {"path": "/elsewhere/a.mp4", "id": "a"}
    thinnable.manifest.write_text(json.dumps(document))
    assert thinnable.thin().exit_code == 3
    outcome = thinnable.thin("--allow-outside")
    assert outcome.exit_code == 0
    assert "give run --allow-outside" in outcome.stderr
    document = json.loads(thinnable.thinned.read_text())
    assert document["videos"][0]["path"] == "/elsewhere/a.mp4"


@pytest.mark.parametrize("wrong", [("--iou", "0"), ("--iou", "1.01")])
def test_wrong_use_exits_with_2(thinnable, wrong):
    assert thinnable.thin(*wrong).exit_code == 2


def test_the_default_bound_is_the_same_everywhere():
    (option,) = [parameter for parameter in command.params if parameter.name == "iou"]
    for function in (thin, thin_video):
        assert inspect.signature(function).parameters["iou"].default == option.default
