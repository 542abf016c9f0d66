"""Each step against the arrays that the authors' code computed on two real sequences.

Tolerances: sampling, label, grey and colour names are exact up to rounding ties; the authors'
HOG uses reciprocal square roots of 12 bits, which now and then move a gradient to the next
orientation, so HOG and what follows from it agree on average only.
"""

import numpy as np
import pytest
import scipy.io

from situp_annotate.tracking import correlation
from situp_annotate.tracking.color_names import builtin_table, load_table
from situp_annotate.tracking.features import FeatureExtractor
from situp_annotate.tracking.params import TrackerParams
from situp_annotate.tracking.response import apce, find_peak
from situp_annotate.tracking.sampling import as_channels, sample_windows

POOL = TrackerParams().scale_factors


class Reference:
    """Arrays of one sequence, with channels in our order."""

    def __init__(self, shared, name):
        folder = shared / "reference"
        self.arrays = scipy.io.loadmat(folder / f"authors_arrays_{name}.mat")
        self.color = self.arrays["f1_image"].ndim == 3
        self.table = str(folder / "color_name_table.npz") if self.color else None
        self.window_hw = tuple(int(size) for size in self.arrays["window_sz"][0])

    def windows(self, frame):
        """Our windows of a frame's pool, sampled at the authors' state."""
        image = self.arrays[f"f{frame}_image"]
        image = np.ascontiguousarray(image[..., ::-1] if self.color else image)
        center = tuple(self.arrays[f"f{frame - 1}_pos"][0] - 1)
        size = tuple(2.5 * self.arrays[f"f{frame - 1}_target_sz"][0])
        return sample_windows(as_channels(image), center, size, POOL, self.window_hw)

    def authors_windows(self, frame):
        patches = np.moveaxis(self.arrays[f"f{frame}_test_patches"], -1, 0)
        return np.ascontiguousarray(patches[..., ::-1])

    def extractor(self):
        return FeatureExtractor(
            self.window_hw, color=self.color, params=TrackerParams(color_table=self.table)
        )

    def authors_features(self, frame):
        return np.moveaxis(self.arrays[f"f{frame}_test_feats"], (2, 3), (1, 0))


@pytest.fixture(params=["Crossing", "Dog1"])
def reference(shared, request):
    return Reference(shared, request.param)


def test_label(reference):
    rows, columns = reference.extractor().grid_hw
    sigma = 0.1 * np.sqrt(reference.arrays["f1_target_sz"].prod()) / 4
    labels = correlation.gaussian_labels((rows, columns), sigma)
    expected = np.fft.ifft2(reference.arrays["yf"]).real
    np.testing.assert_allclose(labels, expected, atol=1e-7)


@pytest.mark.parametrize("frame", [2, 3])
def test_windows(reference, frame):
    apart = reference.windows(frame).astype(int) - reference.authors_windows(frame)
    assert np.abs(apart).max() <= 1
    assert (apart != 0).mean() < 1e-4


@pytest.mark.parametrize("frame", [2, 3])
def test_features(reference, frame):
    ours = reference.extractor()(reference.authors_windows(frame))
    apart = np.abs(ours - reference.authors_features(frame))
    assert apart[:, :31].mean() < 2e-4  # HOG
    assert apart[:, 31:].max() < 5e-3  # grey and colour names; one grey level is 0.004


@pytest.mark.parametrize("frame", [2, 3])
def test_response_and_apce(reference, frame):
    """From the authors' features and model, so that nothing but the correlation is compared."""
    columns = reference.extractor().grid_hw[1]
    half = columns // 2 + 1
    arrays = reference.arrays
    template_f = np.moveaxis(arrays[f"f{frame - 1}_model_xf"], 2, 0)[..., :half]
    responses = correlation.respond(
        arrays[f"f{frame - 1}_model_alphaf"][:, :half].astype(np.complex64),
        np.ascontiguousarray(template_f),
        correlation.spectrum(np.ascontiguousarray(reference.authors_features(frame))),
        columns,
    )
    expected = np.moveaxis(arrays[f"f{frame}_response"], 2, 0)
    np.testing.assert_allclose(responses, expected, atol=1e-5)
    sharpness = [apce(response) for response in responses]
    np.testing.assert_allclose(sharpness, arrays[f"f{frame}_apce"][0], rtol=1e-3)
    best = int(np.argmax(sharpness))
    assert best == int(arrays[f"f{frame}_szid"][0, 0]) - 1
    assert find_peak(responses[best]).offset_yx == tuple(arrays[f"f{frame}_delta"][0])


def test_training_and_update(reference):
    columns = reference.extractor().grid_hw[1]
    half, arrays = columns // 2 + 1, reference.arrays
    labels_f = arrays["yf"][:, :half].astype(np.complex64)

    def spectrum(frame):
        features = np.moveaxis(arrays[f"f{frame}_train_feat"], 2, 0)
        return correlation.spectrum(np.ascontiguousarray(features))

    alpha_f = [correlation.train(spectrum(frame), labels_f, columns, 3e-4) for frame in (1, 2)]
    scale = np.abs(arrays["f1_alphaf"]).max()
    np.testing.assert_allclose(alpha_f[0], arrays["f1_alphaf"][:, :half], atol=1e-4 * scale)
    updated = correlation.interpolate(*alpha_f, 0.004)
    np.testing.assert_allclose(updated, arrays["f2_model_alphaf"][:, :half], atol=1e-4 * scale)


def test_builtin_colors_are_near_the_table(shared):
    """Inner products are all that the linear kernel sees, so those are compared."""
    table = load_table(str(shared / "reference" / "color_name_table.npz"))
    sample = np.random.default_rng(0).choice(len(table), 2000, replace=False)
    gram, builtin_gram = (t[sample] @ t[sample].T for t in (table, builtin_table()))
    assert np.linalg.norm(builtin_gram - gram) / np.linalg.norm(gram) < 0.1
