"""The simulated annotator, on targets for which every box can be counted by hand."""

import numpy as np
import pytest
from support.targets import corner_truth, curved_truth, otb_target, pictures, subject_of

from situp_annotate.errors import SitupError, TrackingError
from situp_annotate.evaluation import overlaps
from situp_annotate.evaluation.contenders import CONTENDERS
from situp_annotate.evaluation.effort import BUDGETS, prepare, simulate
from situp_annotate.evaluation.jitter import jitter
from situp_annotate.evaluation.picks import PICKS, Situation, pick_suggested, pick_worst
from situp_annotate.evaluation.prefixes import PrefixCache
from situp_annotate.evaluation.samples import SampleCollector, Samples
from situp_annotate.evaluation.track_quality import judge_track
from situp_annotate.propagation import TrackLabels, suggest
from situp_annotate.propagation.confidence import feature_names
from situp_annotate.trackers import make_mil
from situp_annotate.types import BoundingBox, Keyframe, Provenance, Track

LINEAR, BOTH = CONTENDERS["linear"], CONTENDERS["both"]


@pytest.fixture(scope="module")
def curved():
    truth = curved_truth()
    return subject_of(truth, pictures(truth))


def watch(subject, contender, pick, **options):
    seen = []
    simulation = simulate(subject, contender, pick, observe=seen.append, **options)
    return simulation, seen


def drawn(situation):
    return [keyframe.frame for keyframe in situation.keyframes]


def test_a_corner_takes_linear_interpolation_three_boxes():
    simulation, seen = watch(subject_of(corner_truth()), LINEAR, pick_worst)
    assert [drawn(situation) for situation in seen] == [[0], [0, 10], [0, 10, 29]]
    assert simulation.boxes_drawn == {0.7: 3, 0.5: 3}
    assert simulation.reached == {0.7: True, 0.5: True}
    # Boxes 100 wide overlap by 0.7 when they are 17.6 apart, by 0.5 when they are 33.3 apart.
    assert simulation.recalls[0.7] == pytest.approx((12 / 29, 17 / 28, 1))
    assert simulation.recalls[0.5] == pytest.approx((24 / 29, 25 / 28, 1))


def test_after_the_goal_budgets_keep_the_last_recall():
    simulation = simulate(subject_of(corner_truth()), LINEAR, pick_worst)
    assert simulation.recall_by_budget[0.7] == pytest.approx(
        {1: 12 / 29, 2: 17 / 28, 3: 1, 5: 1, 10: 1}
    )


def test_the_person_gives_up():
    simulation = simulate(subject_of(corner_truth()), LINEAR, pick_worst, most_boxes=2)
    assert simulation.boxes_drawn == {0.7: 2, 0.5: 2}
    assert simulation.reached == {0.7: False, 0.5: False}
    assert simulation.recall_by_budget[0.7][10] == pytest.approx(17 / 28)


def test_an_absent_object_is_said_to_be_outside():
    truth = np.tile([20.0, 20.0, 30.0, 30.0], (30, 1))
    truth[10:20] = np.nan
    simulation, seen = watch(subject_of(truth), LINEAR, pick_worst)
    last = seen[-1]
    assert drawn(last) == [0, 10, 20]
    assert [keyframe.box is None for keyframe in last.keyframes] == [False, True, False]
    assert (last.overlaps == 1).all()
    assert seen[0].overlaps.tolist() == [1] * 10 + [0] * 10 + [1] * 10
    assert seen[1].overlaps.tolist() == [1] * 20 + [0] * 10
    assert simulation.boxes_drawn == {0.7: 3, 0.5: 3}


def test_the_first_box_is_drawn_where_the_object_first_is():
    truth = corner_truth()
    truth[:4] = 0.0  # no box
    _, seen = watch(subject_of(truth), LINEAR, pick_worst)
    assert drawn(seen[0]) == [4]
    assert (seen[0].overlaps[:5] == 1).all()


def test_a_target_that_is_never_there_is_an_error():
    with pytest.raises(SitupError, match="target: the truth has no box"):
        prepare(otb_target(np.full((3, 4), np.nan)), iter(()))


def test_who_is_asked_draws_their_own_box(curved):
    near = jitter(curved.truth, "a")
    _, seen = watch(curved, LINEAR, pick_worst, hand=near)
    for keyframe in seen[-1].keyframes:
        box = keyframe.box
        assert [box.x, box.y, box.width, box.height] == near[keyframe.frame].tolist()
    assert (seen[-1].overlaps[drawn(seen[-1])] == 1).all()


def test_jittered_boxes_are_near_and_repeat():
    truth = np.tile([20.0, 20.0, 30.0, 60.0], (500, 1))
    truth[7] = np.nan
    near = jitter(truth, "name")
    assert np.isnan(near[7]).all()
    shared = np.delete(overlaps(near, truth), 7)
    assert ((shared > 0.85 - 1e-9) & (shared < 0.95 + 1e-9)).all()
    assert np.ptp(shared) > 0.09
    np.testing.assert_array_equal(near, jitter(truth, "name"))
    assert not np.array_equal(near, jitter(truth, "other"), equal_nan=True)


@pytest.mark.parametrize("pick", PICKS.values(), ids=PICKS)
@pytest.mark.parametrize("contender", [LINEAR, BOTH], ids=["linear", "both"])
def test_no_frame_is_drawn_twice(curved, contender, pick):
    _, seen = watch(curved, contender, pick)
    for situation in seen:
        assert len(set(drawn(situation))) == len(situation.keyframes)
        told = {s.frame for s in suggest(situation.labels, situation.size_hw, most=50)}
        assert not told.intersection(drawn(situation))
        human = {f for f, p in situation.labels.points() if p.provenance is Provenance.HUMAN}
        assert human == set(drawn(situation))


def test_tracking_takes_fewer_boxes_than_interpolation(curved):
    ours, linear = (simulate(curved, each, pick_worst).boxes_drawn for each in (BOTH, LINEAR))
    assert ours[0.7] < linear[0.7]


def test_shared_passes_change_nothing(curved):
    shared = PrefixCache()
    for contender in (CONTENDERS["forward"], BOTH):
        for pick in PICKS.values():
            apart = simulate(curved, contender, pick, cache={})
            assert simulate(curved, contender, pick, cache=shared) == apart


def test_without_suggestions_and_boxes_the_furthest_frame_is_picked():
    nothing = TrackLabels(Track(1, "a", ()), ())
    keyframes = (Keyframe(2, None), Keyframe(4, None))
    assert pick_suggested(Situation(keyframes, nothing, np.zeros(10), (50, 50))) == 9


def test_without_suggestions_the_least_confident_frame_is_picked(monkeypatch, curved):
    _, seen = watch(curved, BOTH, pick_worst, most_boxes=1)
    monkeypatch.setattr("situp_annotate.evaluation.picks.suggest", lambda *_, **__: ())
    (stretch,) = seen[0].labels.stretches
    assert pick_suggested(seen[0]) == stretch.confidence.argmin()


def test_samples_are_what_nobody_drew(tmp_path, curved):
    collector = SampleCollector(curved, "worst")
    simulation = simulate(curved, LINEAR, pick_worst, observe=collector)
    samples = collector.samples()
    last = simulation.boxes_drawn[0.7]
    expected = [30 - budget for budget in BUDGETS if budget <= last]
    assert [int((samples.boxes == b).sum()) for b in BUDGETS if b <= last] == expected
    assert samples.features.shape == (sum(expected), len(feature_names()))
    first = samples.overlap[samples.boxes == 1]
    assert (first >= 0.7).mean() == pytest.approx(simulation.recalls[0.7][0])
    samples.save(tmp_path / "s.npz")
    again = Samples.joined([Samples.load(tmp_path / "s.npz"), samples])
    assert len(again.overlap) == 2 * len(samples.overlap)
    assert len(again.where(again.pick == "suggested").overlap) == 0
    assert set(again.target) == {"target"}


def test_a_straight_track_is_thinned_to_what_was_drawn():
    _, seen = watch(subject_of(corner_truth()), LINEAR, pick_worst)
    quality = judge_track(seen[-1])
    assert quality.thin_iou == pytest.approx(1)
    assert quality.thin_keyframes_per_100 == pytest.approx(10)
    assert quality.large_steps == 0


def test_a_jump_at_a_keyframe_is_a_large_step():
    truth = np.tile([20.0, 20.0, 30.0, 30.0], (200, 1))
    truth[100:, 0] = 60
    _, seen = watch(subject_of(truth), CONTENDERS["hold"], pick_worst)
    assert drawn(seen[-1]) == [0, 100]
    assert judge_track(seen[-1]).large_steps == 0.5


def test_mil_wants_a_target_first_and_keeps_its_size():
    image, following, *_ = pictures(curved_truth())
    tracker = make_mil()
    with pytest.raises(TrackingError, match="call init"):
        tracker.update(image)
    tracker.init(image, BoundingBox(20, 35, 24, 24))
    estimate = tracker.update(following)
    assert (estimate.box.width, estimate.box.height) == (24, 24)
    assert abs(estimate.box.x - 22.5) < 6


def test_mil_takes_boxes_that_reach_beyond_the_picture():
    image = next(pictures(curved_truth()))
    tracker = make_mil()
    tracker.init(image, BoundingBox(-10, 80, 30, 40))
    assert tracker.update(image).box.height == 40
