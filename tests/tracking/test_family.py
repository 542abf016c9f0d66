"""SITUP's relatives: filters, criteria and the search along scales, on small pictures."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import fft, ndimage

from situp_annotate.errors import TrackingError
from situp_annotate.tracking import SitupTracker, TrackerParams
from situp_annotate.tracking.correlation import gaussian_labels
from situp_annotate.tracking.filters import BackgroundAwareFilter, GaussianFilter, RatioFilter
from situp_annotate.tracking.response import psr
from situp_annotate.types import BoundingBox

GRID_HW = (9, 12)
LABELS = gaussian_labels(GRID_HW, 1.0)


def spectrum_of(maps):
    """Half spectra (rows, 2, columns // 2 + 1, channels) of maps (rows, columns, channels)."""
    spectrum = fft.rfft2(maps, axes=(0, 1))
    return np.stack([spectrum.real, spectrum.imag], axis=1).astype(np.float32)


def maps(seed=0, channels=3):
    return np.random.default_rng(seed).normal(size=(*GRID_HW, channels))


def gaussian_kernel(z, x, sigma):
    """Kernel of every shift of z with x, from its definition."""
    kernel = np.empty(GRID_HW)
    for row in range(GRID_HW[0]):
        for column in range(GRID_HW[1]):
            shifted = np.roll(z, (-row, -column), (0, 1))
            kernel[row, column] = np.exp(-((shifted - x) ** 2).sum() / x.size / sigma**2)
    return kernel


def test_gaussian_kernel_regression_is_that_of_its_definition():
    x, z, sigma, regularization = maps(1), np.roll(maps(1), (2, -3), (0, 1)), 0.7, 1e-3
    filter_ = GaussianFilter(LABELS, spectrum_of(x).shape, x.size, regularization, sigma)
    filter_.learn(spectrum_of(x), 0.5)
    alpha_f = fft.fft2(LABELS) / (fft.fft2(gaussian_kernel(x, x, sigma)) + regularization)
    wanted = fft.ifft2(alpha_f * fft.fft2(gaussian_kernel(z, x, sigma))).real
    (response,) = filter_.respond(spectrum_of(z)[np.newaxis])
    np.testing.assert_allclose(response, wanted, atol=2e-4)
    assert np.unravel_index(response.argmax(), GRID_HW) == (2, GRID_HW[1] - 3)


def test_the_ratio_filter_averages_numerator_and_denominator():
    windows, regularization, rate = [maps(1), maps(2), maps(3)], 0.5, 0.25
    filter_ = RatioFilter(LABELS, spectrum_of(windows[0]).shape, regularization)
    label_f = fft.fft2(LABELS)[..., np.newaxis]
    numerator, denominator = 0.0, 0.0
    for number, window in enumerate(windows[:2]):
        filter_.learn(spectrum_of(window), rate)
        window_f, part = fft.fft2(window, axes=(0, 1)), rate if number else 1.0
        numerator = (1 - part) * numerator + part * label_f.conj() * window_f
        denominator = (1 - part) * denominator + part * (np.abs(window_f) ** 2).sum(axis=-1)
    shared = (numerator.conj() * fft.fft2(windows[2], axes=(0, 1))).sum(axis=-1)
    wanted = fft.ifft2(shared / (denominator + regularization)).real
    (response,) = filter_.respond(spectrum_of(windows[2])[np.newaxis])
    np.testing.assert_allclose(response, wanted, atol=1e-5)


@pytest.mark.parametrize("kind", ["gaussian", "ratio"])
def test_a_copy_of_a_filter_learns_by_itself(kind):
    x = spectrum_of(maps(1))
    filter_ = (
        GaussianFilter(LABELS, x.shape, maps().size, 1e-4, 0.5)
        if kind == "gaussian"
        else RatioFilter(LABELS, x.shape, 0.01)
    )
    filter_.learn(x, 1.0)
    before = filter_.respond(x[np.newaxis])
    filter_.copy().learn(spectrum_of(maps(2)), 0.5)
    np.testing.assert_array_equal(filter_.respond(x[np.newaxis]), before)


def background_aware(support_hw, *windows, rate=0.25):
    filter_ = BackgroundAwareFilter(LABELS, spectrum_of(windows[0]).shape, support_hw)
    for window in windows:
        filter_.learn(spectrum_of(window), rate)
    return filter_


def in_space(filter_):
    template_f = filter_.model.template_f
    return fft.irfft2(template_f[:, 0] + 1j * template_f[:, 1], s=GRID_HW, axes=(0, 1))


@pytest.mark.parametrize("support_hw", [(5.0, 7.0), (99.0, 99.0)])
def test_the_background_aware_filter_is_that_of_two_iterations_with_matrices(support_hw):
    windows, cells = [maps(1), maps(2)], GRID_HW[0] * GRID_HW[1]
    average = 0.75 * windows[0] + 0.25 * windows[1]
    shifts = [
        np.roll(average, (-row, -column), (0, 1)).reshape(-1)
        for row in range(GRID_HW[0])
        for column in range(GRID_HW[1])
    ]
    samples, labels = np.array(shifts), LABELS.reshape(-1)
    inside = np.zeros((*GRID_HW, 3))
    inside[(slice(2, 7), slice(2, 9)) if support_hw[0] < 99 else ()] = 1.0
    support = inside.reshape(-1)
    filter_ = multiplier = np.zeros(samples.shape[1])
    for penalty in (cells * 1.0, cells * 10.0):
        left = samples.T @ samples + penalty * np.eye(len(support))
        free = np.linalg.solve(left, samples.T @ labels + penalty * (filter_ - multiplier))
        filter_ = support * (free + multiplier)
        multiplier = multiplier + free - filter_
    found = in_space(background_aware(support_hw, *windows))
    np.testing.assert_allclose(found, filter_.reshape(found.shape), atol=1e-6)
    assert np.abs(found[inside == 0]).max(initial=0.0) < 1e-6


def test_the_background_aware_filter_s_response_to_what_it_has_learnt_is_one_in_the_middle():
    window = maps(1)
    filter_ = background_aware((5.0, 7.0), window)
    shared_f = (spectrum_of(window) * filter_.model.template_f).sum(axis=(1, 3))
    half = fft.irfft2(shared_f * filter_.model.alpha_f.real, s=GRID_HW)
    assert half[0, 0] == pytest.approx(1)
    blank = background_aware((5.0, 7.0), 0 * window)
    assert np.isfinite(blank.model.alpha_f).all()


def test_a_copy_of_a_background_aware_filter_learns_by_itself():
    filter_ = background_aware((5.0, 7.0), maps(1))
    before = filter_.model.template_f.copy()
    filter_.copy().learn(spectrum_of(maps(2)), 0.5)
    np.testing.assert_array_equal(filter_.model.template_f, before)


def test_peak_to_sidelobe_ratio_by_hand():
    response = np.array([[0, 0, 0, 0, 2], [0, 10, 0, 0, 4], [0, 0, 0, 0, 2], [3, 3, 3, 3, 3.0]])
    sidelobe = np.array([0, 0, 0, 2, 4, 2, 3, 3, 3, 3, 3])
    assert psr(response) == pytest.approx((10 - sidelobe.mean()) / sidelobe.std())
    assert psr(np.roll(response, (2, 3), (0, 1))) == pytest.approx(psr(response))
    assert psr(np.zeros((5, 5))) == psr(np.ones((2, 2))) == 0.0


# ---- whole trackers ----------------------------------------------------------------------------

ONE = (1.0,)
KCF = TrackerParams(features=("hog",), kernel="gaussian", learning_rate=0.02, scale_factors=ONE)
RELATIVES = {
    "kcf": KCF,
    "dcf": replace(KCF, kernel="linear"),
    "csk": replace(KCF, features=("gray",), cell_size=1, kernel_sigma=0.2),
    "mosse": TrackerParams(
        features=("gray",), cell_size=1, filter="ratio", learning_rate=0.125, scale_factors=ONE
    ),
    "colour": TrackerParams(features=("gray", "color"), cell_size=2),
    "square": TrackerParams(window="square", sampling="plain"),
    "background": TrackerParams(window="square", padding=4.0, filter="background"),
    "small template": TrackerParams(template_side=(0.0, 72.0), sampling="plain", subcell=True),
    "large template": TrackerParams(template_side=(200.0, 200.0), sampling="plain", subcell=True),
}


def noise(height=140, width=180, channels=3):
    rng = np.random.default_rng(5)
    smooth = ndimage.gaussian_filter(rng.normal(size=(height, width, channels)), (2, 2, 0))
    return np.uint8(np.clip(128 + 500 * smooth, 0, 255))


def resized(image, box, factor):
    """The same picture, larger around the middle of a box."""
    center = np.array([box.y + box.height / 2, box.x + box.width / 2, 1])
    inverse = np.array([1 / factor, 1 / factor, 1])
    return ndimage.affine_transform(image, inverse, center - center * inverse, order=1)


@pytest.mark.parametrize("name", RELATIVES)
@pytest.mark.parametrize("channels", [1, 3])
def test_relatives_follow_what_moves(name, channels):
    image = noise(channels=channels).squeeze()
    tracker = SitupTracker(RELATIVES[name])
    tracker.init(image, BoundingBox(70, 50, 40, 32))
    for step in range(1, 4):
        box = tracker.update(np.roll(image, (4 * step, -8 * step), (0, 1))).box
        assert (box.x, box.y) == pytest.approx((70 - 8 * step, 50 + 4 * step), abs=1)


@pytest.mark.parametrize("criterion", ["apce", "max", "psr"])
@pytest.mark.parametrize("factor", [1.06, 0.94])
def test_each_criterion_follows_what_grows(criterion, factor):
    image, box = noise(), BoundingBox(70, 50, 40, 32)
    params = TrackerParams(
        scale_factors=(1.0, 0.94, 0.97, 1.03, 1.06), scale_criterion=criterion, sampling="plain"
    )
    tracker = SitupTracker(params)
    tracker.init(image, box)
    assert tracker.update(resized(image, box, factor)).scale == pytest.approx(factor)


@pytest.mark.parametrize("size", [40, 120])
@pytest.mark.parametrize("factor", [1.08, 0.92])
def test_the_search_along_scales_follows_what_grows(size, factor):
    image, box = noise(300, 340), BoundingBox(110, 90, size, size)
    params = TrackerParams(
        filter="ratio", scale_factors=ONE, scale_search="filter", subcell=True, sampling="plain"
    )
    tracker = SitupTracker(params)
    tracker.init(image, box)
    for _ in range(3):
        estimate = tracker.update(resized(image, box, factor))
    assert estimate.scale == pytest.approx(factor, abs=0.025)
    assert estimate.fine_box.width == pytest.approx(estimate.box.width)


def test_aspect_factors_follow_what_grows_in_one_direction():
    image, box = noise(), BoundingBox(70, 50, 40, 32)
    params = TrackerParams(
        scale_factors=(1.0, 1.04), aspect_factors=(1.0, 1 / 1.08, 1.08), sampling="plain"
    )
    tracker = SitupTracker(params)
    tracker.init(image, box)
    center = np.array([66, 90, 1])
    inverse = np.array([1.0, 1 / 1.08, 1])
    wide = ndimage.affine_transform(image, inverse, center - center * inverse, order=1)
    found = tracker.update(wide).box
    assert found.width / found.height == pytest.approx(1.08 * 40 / 32, rel=0.01)


def test_scales_can_be_left_alone_in_between():
    image, box = noise(), BoundingBox(70, 50, 40, 32)
    params = TrackerParams(scale_factors=(1.0, 1.06), scale_interval=3, sampling="plain")
    tracker = SitupTracker(params)
    tracker.init(image, box)
    grown = resized(image, box, 1.06)
    scales = [tracker.update(grown).scale for _ in range(4)]
    assert scales == pytest.approx([1, 1, 1.06, 1.06])
    assert tracker.locate(resized(image, box, 1.06**2)).scale == pytest.approx(1.06**2)


@pytest.mark.parametrize(("share", "finds"), [(0.5, True), (0.0, False)])
def test_what_hides_the_target_is_not_learnt(share, finds):
    image, box = noise(), BoundingBox(70, 50, 40, 32)
    params = TrackerParams(learning_rate=0.2, learn_above=share, scale_factors=ONE)
    tracker = SitupTracker(params)
    tracker.init(image, box)
    for shift in (4, 8, 4, 0):
        tracker.update(np.roll(image, shift, 1))
    hidden = np.full_like(image, 128)
    for _ in range(40):
        tracker.update(hidden)
        tracker.place(box)
    assert (tracker.locate(image).peak > 0.3) == finds


@pytest.mark.parametrize("size", [40, 110])
@pytest.mark.parametrize("search", ["pool", "filter"])
def test_pictures_can_be_turned_grey_first(size, search):
    color, box = noise(200, 240), BoundingBox(90, 60, size, size)
    params = TrackerParams(scale_search=search)
    trackers = SitupTracker(replace(params, grayscale=True)), SitupTracker(params)
    boxes = []
    for shift in range(0, 16, 4):
        moved = np.roll(color, (shift, -shift), (0, 1))
        pictures = moved, cv2.cvtColor(moved, cv2.COLOR_BGR2GRAY)
        for tracker, picture in zip(trackers, pictures, strict=True):
            if shift == 0:
                tracker.init(picture, box)
            boxes.append(tracker.update(picture).box)
    assert boxes[::2] == boxes[1::2]
    assert boxes[-1].x == pytest.approx(78, abs=4)


def test_positions_between_cells_are_gone_on_from():
    image = noise()
    tracker = SitupTracker(TrackerParams(subcell=True, scale_factors=ONE))
    tracker.init(image, BoundingBox(70, 50, 40, 32))
    for step in range(1, 7):
        estimate = tracker.update(np.roll(image, step, 1))
        assert estimate.box == estimate.fine_box
    assert estimate.box.x == pytest.approx(76, abs=0.6)


@pytest.mark.parametrize(
    "values",
    [{"features": ("color",)}, {"features": ("gray",), "cell_size": 0}, {"kernel_sigma": 0.0},
     {"aspect_factors": ()}, {"scale_interval": 0}, {"aspect_factors": (3.0,)},
     {"kernel": "gaussian", "filter": "ratio"}, {"template_side": (9.0, 3.0)}, {"support": 0.0},
     {"learn_above": 1.1}],
)  # fmt: skip
def test_what_does_not_go_together_is_refused(values):
    with pytest.raises(TrackingError, match="is not allowed: give"):
        TrackerParams(**values)


def test_copies_of_relatives_go_their_own_way():
    params = TrackerParams(
        filter="ratio", scale_factors=ONE, scale_search="filter", sampling="plain"
    )
    image = noise()
    tracker = SitupTracker(params)
    tracker.init(image, BoundingBox(70, 50, 40, 32))
    twin = tracker.copy()
    for shift in (4, 8, 12):
        twin.update(np.roll(image, shift, 0))
    estimate = tracker.update(image)
    assert (estimate.box.x, estimate.box.y) == pytest.approx((70, 50), abs=0.5)
