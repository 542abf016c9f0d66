"""Propagation with a tracker whose every answer is known."""

import numpy as np
import pytest

from situp_annotate.propagation import propagate
from situp_annotate.propagation.confidence import RelativeSharpness
from situp_annotate.tracking import Estimate
from situp_annotate.types import BoundingBox, Frame, Keyframe, Provenance, State, Track


class Sliding:
    """Says that the target moves by one pixel a frame to the right."""

    def init(self, image, box):
        self.box, self.age = box, 0

    def update(self, image):
        self.age += 1
        box = BoundingBox(self.box.x + self.age, self.box.y, self.box.width, self.box.height)
        return Estimate(box, apce=40.0 / self.age, peak=0.5, scale=1.0)


def frames(count, size=(50, 60)):
    for index in range(count):
        yield Frame(index, index * 40_000_000, np.zeros(size, np.uint8))


def label(tracks, count=10):
    propagation = propagate(frames(count), tracks, Sliding)
    return {frame.index: points for frame, points in propagation}, propagation.skipped


BOX = BoundingBox(10, 20, 8, 9)
OTHER = BoundingBox(30, 5, 6, 7)


def test_a_keyframe_has_the_persons_box_and_the_rest_the_trackers():
    labels, skipped = label([Track(1, "a", (Keyframe(2, BOX),))], 5)
    assert [len(labels[index]) for index in range(5)] == [0, 0, 1, 1, 1]
    (human,), (first,), (second,) = labels[2], labels[3], labels[4]
    assert (human.box, human.provenance, human.confidence) == (BOX, Provenance.HUMAN, 1.0)
    assert human.apce is None
    assert (first.box.x, second.box.x) == (11, 12)
    assert (first.provenance, first.apce, first.peak) == (Provenance.TRACKED, 40.0, 0.5)
    assert skipped == ()


def test_each_keyframe_starts_anew():
    labels, _ = label([Track(1, "a", (Keyframe(0, BOX), Keyframe(3, OTHER)))], 5)
    assert [labels[index][0].box.x for index in range(5)] == [10, 11, 12, 30, 31]
    assert [labels[index][0].provenance for index in (0, 3)] == [Provenance.HUMAN] * 2


def test_outside_ends_the_track_until_the_next_box():
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(2, None), Keyframe(4, OTHER)))
    labels, _ = label([track], 6)
    assert [len(labels[index]) for index in range(6)] == [1, 1, 0, 0, 1, 1]


def test_occlusion_holds_until_the_next_keyframe():
    track = Track(1, "a", (Keyframe(0, BOX), Keyframe(1, BOX, occluded=True), Keyframe(3, BOX)))
    labels, _ = label([track], 5)
    assert [labels[index][0].state for index in range(5)] == [
        State.VISIBLE, State.OCCLUDED, State.OCCLUDED, State.VISIBLE, State.VISIBLE,
    ]  # fmt: skip


def test_points_are_sorted_by_track_and_do_not_depend_on_each_other():
    one, two = Track(1, "a", (Keyframe(0, BOX),)), Track(2, "b", (Keyframe(1, OTHER),))
    both, _ = label([two, one])
    alone = {**label([one])[0]}, {**label([two])[0]}
    for index, points in both.items():
        assert [point.track_id for point in points] == sorted(point.track_id for point in points)
        assert points == alone[0][index] + alone[1][index]


def test_unusable_keyframes_are_told():
    track = Track(3, "a", (Keyframe(0, BoundingBox(60, 0, 5, 5)), Keyframe(10, BOX)))
    labels, skipped = label([track], 10)
    assert not any(labels.values())
    assert [(skip.track_id, skip.frame) for skip in skipped] == [(3, 0), (3, 10)]
    assert skipped[0].reason.endswith("lies outside the picture of 60×50 pixels.")
    assert skipped[1].reason.endswith("is past the end; the video's last frame is 9.")


def test_a_frame_is_handed_out_before_the_next_is_asked_for():
    asked = []

    def source():
        for frame in frames(3):
            asked.append(frame.index)
            yield frame

    labelled = iter(propagate(source(), [], Sliding))
    next(labelled)
    assert asked == [0]


def test_confidence_compares_with_what_is_usual():
    confidence = RelativeSharpness()
    assert [confidence(40.0) for _ in range(25)] == [1.0] * 25
    assert confidence(20.0) == 0.5
    assert confidence(80.0) == 1.0
    assert confidence(20.0) == 0.5  # what is usual was settled by the first frames


def test_confidence_of_a_track_without_any_response_is_zero():
    assert RelativeSharpness()(0.0) == 0.0


@pytest.mark.parametrize("count", [0, 1])
def test_videos_of_no_and_of_one_frame(count):
    labels, skipped = label([Track(1, "a", (Keyframe(0, BOX),))], count)
    assert len(labels) == count
    assert len(skipped) == 1 - count


@pytest.mark.parametrize("threads", [2, 3])
def test_labels_do_not_depend_on_the_number_of_threads(threads):
    images = np.random.default_rng(0).integers(0, 256, (70, 60, 80, 3), np.uint8)
    video = [Frame(index, index, image) for index, image in enumerate(images)]
    tracks = [
        Track(1, "a", (Keyframe(0, BOX), Keyframe(30, OTHER))),
        Track(2, "b", (Keyframe(3, OTHER),)),
        Track(3, "c", (Keyframe(65, BOX),)),
    ]
    alone = list(propagate(video, tracks))
    together = list(propagate(video, tracks, threads=threads))
    assert [points for _, points in together] == [points for _, points in alone]
    assert [frame.index for frame, _ in together] == list(range(70))


def test_a_trackers_error_comes_out_of_its_thread():
    class Failing(Sliding):
        def update(self, image):
            raise RuntimeError("no")

    tracks = [Track(number, "a", (Keyframe(0, BOX),)) for number in (1, 2)]
    with pytest.raises(RuntimeError, match="no"):
        list(propagate(frames(5), tracks, Failing, threads=2))


def test_frames_before_a_decoding_error_are_labelled_by_threads_too():
    def broken():
        yield from frames(5)
        raise OSError("gone")

    seen = []
    tracks = [Track(number, "a", (Keyframe(0, BOX),)) for number in (1, 2)]
    with pytest.raises(OSError, match="gone"):
        for frame, _ in propagate(broken(), tracks, Sliding, threads=2):
            seen.append(frame.index)
    assert seen == [0, 1, 2, 3, 4]
