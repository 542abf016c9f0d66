"""Scores of many objects: numbers worked out by hand, and those of TrackEval's own runner."""

import sys
from math import sqrt

import numpy as np
import pytest
from support.scores import trackeval_scores

from situp_annotate.errors import SitupError
from situp_annotate.evaluation.mot_scores import MotSequence, ScoreOptions, score_sequences
from situp_annotate.formats.mot.rows import MotRow, read_mot
from situp_annotate.types import BoundingBox

# TrackEval's runner, and Matplotlib, which it imports, warn; what scores here does not.
runner = pytest.mark.filterwarnings("ignore")

FRAMES = range(10)


def track(track_id, frames=FRAMES, *, left=0.0, **more):
    """A box of 10 × 10 pixels in each frame."""
    given = {"confidence": 1.0, **more}
    return [MotRow(f, track_id, BoundingBox(left + 3 * f, 5, 10, 10), **given) for f in frames]


A, B = track(1), track(2, left=200)


def scored(result, truth, **options):
    videos, combined = score_sequences(
        [MotSequence("clip", result, truth)], ScoreOptions(**options)
    )
    assert videos["clip"] == combined
    return {**combined.rates, **combined.counts, **combined.boxes}


def check(scores, **wanted):
    assert {key: scores[key] for key in wanted} == pytest.approx(wanted)


def test_a_perfect_result():
    scores = scored(track(7, left=200) + track(4), A + B)
    assert {key: scores[key] for key in ("HOTA", "DetA", "AssA", "LocA")} == pytest.approx(
        {"HOTA": 1, "DetA": 1, "AssA": 1, "LocA": 1}
    )
    check(scores, MOTA=1, MOTP=1, IDF1=1, IDR=1, IDP=1, DetRe=1, DetPr=1, AssRe=1, AssPr=1)
    check(scores, TP=20, FP=0, FN=0, IDSW=0, Frag=0, MT=2, PT=0, ML=0)
    check(scores, truth_boxes=20, truth_objects=2, result_boxes=20, result_tracks=2)
    check(scores, truth_left_out=0, result_ignored=0)


def test_one_identity_switch():
    scores = scored(track(1, range(6)) + track(2, range(6, 10)), A)
    check(scores, MOTA=1 - 1 / 10, IDSW=1, Frag=0, FP=0, FN=0, MT=1)
    # One of the two ids can be the object: that of six boxes.
    check(scores, IDTP=6, IDFN=4, IDFP=4, IDF1=0.6)
    # Six boxes share their identity with 6 of 10, four with 4 of 10.
    check(scores, DetA=1, AssA=0.6 * 0.6 + 0.4 * 0.4, HOTA=sqrt(0.52), LocA=1)


def test_a_missed_box():
    scores = scored([row for row in A if row.frame != 4] + B, A + B)
    check(scores, FN=1, FP=0, IDSW=0, Frag=1, TP=19, MT=2, MOTA=19 / 20)
    check(scores, IDTP=19, IDFN=1, IDFP=0, IDF1=19 / 19.5)
    check(scores, DetA=19 / 20, AssA=(9 * 0.9 + 10 * 1) / 19, HOTA=sqrt(18.1 / 20))


def test_a_false_box():
    scores = scored(A + B + track(3, [4], left=400), A + B)
    check(scores, FN=0, FP=1, IDSW=0, Frag=0, MOTA=19 / 20, IDF1=20 / 20.5)
    check(scores, DetA=20 / 21, AssA=1, HOTA=sqrt(20 / 21), LocA=1)


def test_shifted_boxes():
    # 3 of 10 columns are shared: an overlap of 30 / 170, which is 0.18.
    result = track(1, left=7) + track(2, left=207)
    scores = scored(result, A + B)
    check(scores, TP=0, FP=20, FN=20, MOTA=-1, IDF1=0, MT=0, PT=0, ML=2)
    # Found with the thresholds 0.05, 0.1 and 0.15 of 19; where nothing is found, LocA is 1.
    check(scores, HOTA=3 / 19, DetA=3 / 19, AssA=3 / 19, LocA=(3 * 3 / 17 + 16) / 19)
    lenient = scored(result, A + B, iou=0.15)
    check(lenient, TP=20, FP=0, FN=0, MOTA=1, MOTP=3 / 17, IDF1=1, MT=2, HOTA=3 / 19)


def test_objects_that_are_found_in_part():
    # In more than 0.8 of its frames, in 0.8, in 0.2, in less.
    truth = [row for n in range(4) for row in track(n + 1, left=100 * n)]
    found = zip((9, 8, 2, 1), range(4), strict=True)
    result = [row for count, n in found for row in track(n + 1, range(count), left=100 * n)]
    check(scored(result, truth), MT=1, PT=2, ML=1, FN=20)


def test_videos_combine_by_their_boxes():
    switched = MotSequence("switched", track(1, range(6)) + track(2, range(6, 10)), A)
    perfect = MotSequence("perfect", A + B, A + B)
    videos, combined = score_sequences([switched, perfect], ScoreOptions())
    assert list(videos) == ["switched", "perfect"]
    assert combined.rates["MOTA"] == pytest.approx(29 / 30)
    assert combined.rates["IDF1"] == pytest.approx(26 / 30)
    assert combined.rates["AssA"] == pytest.approx((10 * 0.52 + 20) / 30)
    assert combined.rates["HOTA"] == pytest.approx(sqrt(25.2 / 30))
    assert combined.counts["IDSW"] == 1
    assert combined.boxes["truth_objects"] == 3


def test_nothing_found():
    check(scored([], A), FN=10, FP=0, MOTA=0, IDF1=0, HOTA=0, ML=1)


def test_frames_may_be_anything():
    far = [MotRow(2**31 - 2, 1, BoundingBox(0, 0, 9, 9), 1.0)]
    check(scored(far, far), HOTA=1, MOTA=1)


def test_boxes_without_area_overlap_nothing():
    thin = [MotRow(0, 1, BoundingBox(0, 0, 1e-200, 1e-200), 1.0)]
    check(scored(thin, thin), TP=0, FP=1, FN=1)


def test_truth_with_flag_0_is_left_out():
    ignored = track(3, left=400, confidence=0.0)
    check(scored(A, A + ignored), truth_left_out=10, truth_objects=1, MOTA=1, HOTA=1)
    # TrackEval counts what finds it as false.
    check(scored(A + ignored, A + ignored), FP=10, MOTA=0)


def test_classes():
    car = track(1, class_number=1)
    bus = track(2, left=200, class_number=2)
    check(scored(A, car + bus, classes=(1,)), FP=0, FN=0, truth_left_out=10)
    check(scored(A + B, car + bus, classes=(1,)), FP=10, FN=0)
    ignoring = {"classes": (1,), "ignored_classes": (2,)}
    check(scored(A + B, car + bus, **ignoring), FP=0, FN=0, HOTA=1, result_ignored=10)
    check(scored(A + B, car + bus, ignored_classes=(1,)), FP=0, FN=0, result_ignored=10)
    # What is beside it by more than half is false, whatever the threshold of the scores.
    aside = track(2, left=207)
    check(scored(A + aside, car + bus, iou=0.1, **ignoring), FP=10, result_ignored=0)


@pytest.mark.parametrize(
    ("truth", "options", "message"),
    [
        ([], {}, "The truth has no box; give truth that has some."),
        (
            track(1, class_number=3, confidence=0.0),
            {},
            "No box of the truth counts: each has flag 0; classes there are 3; give",
        ),
        (
            track(1, class_number=3),
            {"classes": (1,)},
            "each is of another class or has flag 0; classes there are 3;",
        ),
    ],
)
def test_truth_that_does_not_count(truth, options, message):
    with pytest.raises(SitupError, match=message):
        scored(A, truth, **options)


def test_without_trackeval(monkeypatch):
    monkeypatch.setitem(sys.modules, "trackeval.metrics", None)
    with pytest.raises(SitupError, match=r"install it with pip install 'situp-annotate\[mot\]'"):
        scored(A, A)


def random_files(folder):
    """Objects of all classes that wander, and a result that errs in every way."""
    random = np.random.default_rng(5)
    truth, result = [], []
    for track_id in range(1, 15):
        start = random.uniform(0, 150, 2)
        for frame in range(1, 31):
            x, y = start + random.normal(0, 2, 2) + 3 * frame
            flag, number = int(random.random() > 0.1), 1 + (track_id - 1) % 12
            if random.random() > 0.1:
                truth.append(f"{frame},{track_id},{x:.3f},{y:.3f},40,50,{flag},{number},1\n")
            if random.random() > 0.2:
                found = track_id + 20 * (frame // (10 + track_id))
                x, y = (x, y) + random.normal(0, 6, 2)
                result.append(f"{frame},{found},{x:.3f},{y:.3f},40,50,0.5,-1,-1,-1\n")
    (folder / "clip" / "gt").mkdir(parents=True)
    (folder / "results").mkdir()
    (folder / "clip" / "gt" / "gt.txt").write_text("".join(truth))
    (folder / "clip" / "seqinfo.ini").write_text("[Sequence]\nseqLength=30\n")
    (folder / "results" / "clip.txt").write_text("".join(result))
    return read_mot(folder / "results" / "clip.txt"), read_mot(folder / "clip" / "gt" / "gt.txt")


@runner
@pytest.mark.parametrize("preprocess", [False, True])
def test_trackeval_s_own_runner_finds_the_same(tmp_path, preprocess):
    result, truth = random_files(tmp_path)
    options = {"classes": (1,), "ignored_classes": (2, 7, 8, 12)} if preprocess else {}
    scores = scored(result, truth, **options)
    hota, mota, idf1 = trackeval_scores(
        tmp_path, tmp_path / "results", "clip", preprocess=preprocess
    )
    check(scores, HOTA=hota, MOTA=mota, IDF1=idf1)
    assert 0 < hota < 0.9
    assert bool(scores["result_ignored"]) == preprocess
