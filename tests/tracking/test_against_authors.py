"""Each step against the arrays that the authors' code computed on two real sequences.

Tolerances: sampling is exact up to a tie in rounding here and there; label, grey and colour names
to single precision; fHOG to 1e-4 at most and 1e-5 on average (the authors' gradients have lengths
of 12 bits); what follows from their own features, to the noise of single precision.
"""

import numpy as np
import pytest
import scipy.io

from situp_annotate.tracking import SitupTracker, TrackerParams
from situp_annotate.tracking.color_names import builtin_table, load_table
from situp_annotate.tracking.correlation import CorrelationFilter, gaussian_labels, respond
from situp_annotate.tracking.features import add_colors, plan_features
from situp_annotate.tracking.fourier import invert, plan_transform, transform
from situp_annotate.tracking.hog import fhog
from situp_annotate.tracking.response import apce, find_peak
from situp_annotate.tracking.sampling import sample_window, sampling_steps
from situp_annotate.types import BoundingBox

POOL = TrackerParams().scale_factors
FIRST_BOX = {"Crossing": BoundingBox(204, 150, 17, 50), "Dog1": BoundingBox(138, 111, 51, 36)}


class Reference:
    """Arrays of one sequence, in our order of axes and channels."""

    def __init__(self, shared, name):
        folder = shared / "reference"
        self.arrays = scipy.io.loadmat(folder / f"authors_arrays_{name}.mat")
        self.first_box = FIRST_BOX[name]
        self.color = self.arrays["f1_image"].ndim == 3
        self.window_hw = tuple(int(size) for size in self.arrays["window_sz"][0])
        table = str(folder / "color_name_table.npz") if self.color else None
        self.params = TrackerParams(color_table=table)
        self.features = plan_features(self.window_hw, self.params, color=self.color)
        self.grid_hw = self.features.cosine_window.shape
        self.transform = plan_transform(self.grid_hw, self.features.channels)

    def image(self, frame):
        image = self.arrays[f"f{frame}_image"]
        return np.ascontiguousarray(image[..., ::-1] if self.color else image)

    def windows(self, frame):
        """Our windows of a frame's pool, sampled at the authors' state."""
        image = self.image(frame)
        center = tuple(self.arrays[f"f{frame - 1}_pos"][0] - 1)
        size = tuple(2.5 * self.arrays[f"f{frame - 1}_target_sz"][0])
        rows, columns = self.window_hw
        windows = np.empty((len(POOL), rows, 3 if self.color else 1, columns), np.uint8)
        for window, factor in zip(windows, POOL, strict=True):
            steps = sampling_steps(size, (factor, factor), self.window_hw)
            sample_window(image.reshape(*image.shape[:2], -1), center, steps, window)
        return windows

    def authors_windows(self, frame):
        patches = np.moveaxis(self.arrays[f"f{frame}_test_patches"], -1, 0)
        patches = patches.reshape(*patches.shape[:3], -1)[..., ::-1]
        return np.ascontiguousarray(np.swapaxes(patches, 2, 3))

    def as_ours(self, features):
        """(rows, columns, channels) to (columns, rows, channels), one grey channel for two."""
        ours = np.ascontiguousarray(np.swapaxes(features, 0, 1), np.float32)
        if not self.color:
            ours = ours[..., :32].copy()
            ours[..., 31] *= np.float32(np.sqrt(2))
        return ours

    def spectrum(self, features):
        rows, columns = self.grid_hw
        spectrum = np.empty((rows, 2, columns // 2 + 1, self.features.channels), np.float32)
        transform(self.as_ours(features), self.transform, spectrum)
        return spectrum

    def filter(self):
        """A filter that has learnt from nothing yet."""
        rows, columns = self.grid_hw
        sigma = 0.1 * np.sqrt(self.arrays["f1_target_sz"].prod()) / 4
        shape = (rows, 2, columns // 2 + 1, self.features.channels)
        labels = gaussian_labels(self.grid_hw, sigma)
        return CorrelationFilter(labels, shape, self.features.elements, 3e-4)


@pytest.fixture(params=sorted(FIRST_BOX), scope="module")
def reference(shared, request):
    return Reference(shared, request.param)


def test_label(reference):
    sigma = 0.1 * np.sqrt(reference.arrays["f1_target_sz"].prod()) / 4
    labels = gaussian_labels(reference.grid_hw, sigma)
    np.testing.assert_allclose(labels, np.fft.ifft2(reference.arrays["yf"]).real, atol=1e-7)


@pytest.mark.parametrize("frame", [2, 3])
def test_windows(reference, frame):
    apart = reference.windows(frame).astype(int) - reference.authors_windows(frame)
    assert np.abs(apart).max() <= 1
    assert (apart != 0).mean() < 1e-4


@pytest.mark.parametrize("frame", [2, 3])
def test_features(reference, frame):
    plan = reference.features
    rows, columns = reference.grid_hw
    ours = np.empty((columns, rows, plan.channels), np.float32)
    theirs = np.moveaxis(reference.arrays[f"f{frame}_test_feats"], 3, 0)
    for window, expected in zip(reference.authors_windows(frame), theirs, strict=True):
        fhog(window, plan.orientations, plan.cell_size, plan.cosine_window, ours)
        add_colors(window, plan, ours)
        apart = np.abs(ours - reference.as_ours(expected))
        assert apart[..., :31].max() < 1e-4
        assert apart[..., :31].mean() < 1e-5
        assert apart[..., 31:].max() < 1e-6


@pytest.mark.parametrize("frame", [2, 3])
def test_response_and_apce(reference, frame):
    """From the authors' features and model, so that nothing but the correlation is compared."""
    arrays, (rows, columns) = reference.arrays, reference.grid_hw
    half = columns // 2 + 1
    tracked = reference.filter()
    tracked.model.alpha_f[...] = arrays[f"f{frame - 1}_model_alphaf"][:, :half]
    template = np.fft.ifft2(arrays[f"f{frame - 1}_model_xf"], axes=(0, 1)).real
    tracked.model.template_f[...] = reference.spectrum(template)
    responses_f = np.empty((rows, 2, half, len(POOL)), np.float32)
    for n in range(len(POOL)):
        spectrum = reference.spectrum(arrays[f"f{frame}_test_feats"][..., n])
        respond(spectrum, tracked.model, responses_f[..., n])
    responses = np.empty((len(POOL), rows, columns), np.float32)
    invert(responses_f, reference.transform, responses)
    expected = np.moveaxis(arrays[f"f{frame}_response"], 2, 0)
    np.testing.assert_allclose(responses, expected, atol=1e-5)
    sharpness = [apce(response) for response in responses]
    np.testing.assert_allclose(sharpness, arrays[f"f{frame}_apce"][0], rtol=1e-4)
    best = int(np.argmax(sharpness))
    assert best == int(arrays[f"f{frame}_szid"][0, 0]) - 1
    assert find_peak(responses[best]).offset_yx == tuple(arrays[f"f{frame}_delta"][0])


def test_training_and_update(reference):
    arrays = reference.arrays
    half = reference.grid_hw[1] // 2 + 1
    tracked = reference.filter()
    for frame, name in ((1, "f1_alphaf"), (2, "f2_model_alphaf")):
        tracked.learn(reference.spectrum(arrays[f"f{frame}_train_feat"]), 0.004)
        expected = arrays[name][:, :half]
        atol = 1e-5 * np.abs(expected).max()
        np.testing.assert_allclose(tracked.model.alpha_f, expected, atol=atol)
    template = np.fft.ifft2(arrays["f2_model_xf"], axes=(0, 1)).real
    np.testing.assert_allclose(
        tracked.model.template_f, reference.spectrum(template), rtol=1e-4, atol=1e-3
    )


def test_everything_together(reference):
    """From pictures to APCE over the first frames, our own model all along."""
    tracker = SitupTracker(reference.params)
    tracker.init(reference.image(1), reference.first_box)
    for frame in (2, 3):
        image = reference.image(frame)
        sharpness = [candidate.apce for candidate in tracker.candidates(image)]
        np.testing.assert_allclose(sharpness, reference.arrays[f"f{frame}_apce"][0], rtol=1e-4)
        height, width = reference.arrays[f"f{frame}_target_sz"][0]
        box = tracker.update(image).box
        assert (box.width, box.height) == pytest.approx((width, height), abs=1e-9)


def test_builtin_colors_are_near_the_table(shared):
    """Inner products are all that the linear kernel sees, so those are compared."""
    table = load_table(str(shared / "reference" / "color_name_table.npz"))
    sample = np.random.default_rng(0).choice(len(table), 2000, replace=False)
    gram, builtin_gram = (t[sample] @ t[sample].T for t in (table, builtin_table()))
    assert np.linalg.norm(builtin_gram - gram) / np.linalg.norm(gram) < 0.1
