"""MOTChallenge and CVAT's archive: files to the byte, and scored by TrackEval itself."""

import zipfile

import pytest
from support.labelled import labelled_track, labelled_video
from support.scores import trackeval_scores

from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.mot.exporting import write_cvat_mot, write_mot, write_mot_truth
from situp_annotate.formats.mot.rows import read_mot
from situp_annotate.types import BoundingBox, Provenance, State

BOX = BoundingBox(-3.25, 10, 20, 30)
OPTIONS = ExportOptions()


def in_state(state):
    return (BOX, state, Provenance.TRACKED)


@pytest.fixture
def video():
    return labelled_video(
        labelled_track(2, {0: BOX, 1: in_state(State.OCCLUDED), 2: in_state(State.LOST)}, "dog"),
        labelled_track(5, {1: BOX}, "small\ncar"),
    )


def test_a_result_is_a_file_a_video(tmp_path, video):
    write_mot([video, labelled_video(video_id="empty")], tmp_path, OPTIONS)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["clip.txt", "empty.txt"]
    assert (tmp_path / "clip.txt").read_bytes() == (
        b"1,2,-3.25,10,20,30,0.5,-1,-1,-1\n"
        b"2,2,-3.25,10,20,30,0.5,-1,-1,-1\n"
        b"2,5,-3.25,10,20,30,0.5,-1,-1,-1\n"
    )
    assert (tmp_path / "empty.txt").read_bytes() == b""


def test_ground_truth_is_a_folder_a_video(tmp_path, video):
    other = labelled_video(labelled_track(1, {0: BOX}, "cat"), video_id="other")
    write_mot_truth([video, other], tmp_path, ExportOptions(states=tuple(State)))
    assert (tmp_path / "clip/gt/gt.txt").read_bytes() == (
        b"1,2,-3.25,10,20,30,1,1,1\n"
        b"2,2,-3.25,10,20,30,1,1,0\n"
        b"2,5,-3.25,10,20,30,1,2,1\n"
        b"3,2,-3.25,10,20,30,1,1,0\n"
    )
    assert (tmp_path / "clip/gt/labels.txt").read_text() == "dog\nsmall car\n"
    assert (tmp_path / "clip/seqinfo.ini").read_bytes() == (
        b"[Sequence]\nname=clip\nimDir=img1\nframeRate=30\nseqLength=20\nimWidth=640\n"
        b"imHeight=480\nimExt=.jpg\n"
    )
    assert (tmp_path / "other/gt/gt.txt").read_text() == "1,1,-3.25,10,20,30,1,3,1\n"
    assert (tmp_path / "other/gt/labels.txt").read_text() == "dog\nsmall car\ncat\n"


def test_an_archive_for_cvat_is_the_same_whenever_it_is_written(tmp_path, video):
    contents = []
    for name in ("now", "then"):
        (tmp_path / name).mkdir()
        write_cvat_mot([video], tmp_path / name, OPTIONS)
        contents.append((tmp_path / name / "clip.zip").read_bytes())
    assert contents[0] == contents[1]
    with zipfile.ZipFile(tmp_path / "now/clip.zip") as archive:
        assert archive.namelist() == ["gt/gt.txt", "gt/labels.txt"]
        assert archive.read("gt/gt.txt").startswith(b"1,2,-3.25,10,20,30,1,1,1\n")
        assert archive.read("gt/labels.txt") == b"dog\nsmall car\n"


def test_a_box_never_shrinks_to_nothing(tmp_path):
    thin = BoundingBox(3, 4, 0.0001, 5)
    write_mot([labelled_video(labelled_track(1, {0: thin}))], tmp_path, OPTIONS)
    assert read_mot(tmp_path / "clip.txt")[0].box.width == 0.001


def scores(folder, truth, result):
    (folder / "results").mkdir()
    write_mot_truth([truth], folder, OPTIONS)
    write_mot([result], folder / "results", OPTIONS)
    return trackeval_scores(folder, folder / "results", "clip")


@pytest.mark.filterwarnings("ignore")  # TrackEval and Matplotlib, which it imports
def test_trackeval_scores_a_result_as_perfect_against_itself(tmp_path):
    def walking(shift):
        tracks = [
            {f: BoundingBox(40 * i + 2.5 * f + shift, 30 + f, 30, 50) for f in range(i, 10)}
            for i in (1, 2, 12)
        ]
        return labelled_video(*(labelled_track(n, t) for n, t in enumerate(tracks, 1) if t))

    perfect, moved = tmp_path / "perfect", tmp_path / "moved"
    perfect.mkdir()
    moved.mkdir()
    assert scores(perfect, walking(0), walking(0)) == pytest.approx((1, 1, 1))
    hota, mota, idf1 = scores(moved, walking(0), walking(9))
    assert hota < 0.7
    assert (mota, idf1) == pytest.approx((1, 1))  # an overlap of 0.54 still counts as found
