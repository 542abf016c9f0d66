"""Trackers by name: presets, OpenCV's, and those of other packages."""

import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from situp_annotate.errors import TrackingError
from situp_annotate.trackers import (
    PRESETS,
    find_tracker,
    folder_name,
    make_tracker,
    model_files,
    registry,
    tracker_names,
)
from situp_annotate.trackers.variants import variant_params
from situp_annotate.tracking import TrackerParams
from situp_annotate.types import BoundingBox

PLUGIN = Path(__file__).parents[2] / "samples" / "tracker_plugin"


def noise():
    rng = np.random.default_rng(7)
    smooth = ndimage.gaussian_filter(rng.normal(size=(120, 160, 3)), (2, 2, 0))
    return np.uint8(np.clip(128 + 500 * smooth, 0, 255))


@pytest.fixture
def plugin(monkeypatch):
    """The example package as if it were installed, and one that is broken."""
    monkeypatch.syspath_prepend(str(PLUGIN))
    points = [
        EntryPoint("template", "template_tracker:TemplateTracker", registry.ENTRY_POINTS),
        EntryPoint("broken", "template_tracker:nothing", registry.ENTRY_POINTS),
        EntryPoint("number", "sys:maxsize", registry.ENTRY_POINTS),
    ]
    monkeypatch.setattr(registry, "entry_points", lambda **_group: points)
    registry._plugins.cache_clear()
    yield
    registry._plugins.cache_clear()
    sys.modules.pop("template_tracker", None)


@pytest.mark.parametrize("name", [*PRESETS, "mil"])
def test_each_tracker_follows_what_moves(name):
    assert name in tracker_names()
    image, tracker = noise(), make_tracker(name)
    tracker.init(image, BoundingBox(60, 40, 40, 32))
    estimate = tracker.update(np.roll(image, (4, -4), (0, 1)))
    # Some have to interpolate between cells of four pixels, and scales beside the right one.
    assert (estimate.box.x, estimate.box.y) == pytest.approx((56, 44), abs=1.5)
    assert estimate.box.width / 40 == pytest.approx(1, abs=0.05)


def test_presets_say_where_they_come_from():
    assert all(preset.source for preset in PRESETS.values())
    assert PRESETS["situp"].params == type(PRESETS["situp"].params)()


def test_settings_of_a_preset_can_be_changed_in_its_name():
    params = variant_params("kcf:padding=3, scale_factors=[1.0, 1.1],scale_criterion=apce")
    assert params == replace(
        PRESETS["kcf"].params, padding=3.0, scale_factors=(1.0, 1.1), scale_criterion="apce"
    )
    assert variant_params("situp:") == variant_params("situp") == TrackerParams()
    make_tracker("dsst:learning_rate=0.1").init(noise(), BoundingBox(60, 40, 30, 20))


def test_a_tracker_of_another_package_is_found(plugin):
    assert tracker_names()[-1] == "template"
    tracker = make_tracker("template")
    tracker.init(noise(), BoundingBox(60, 40, 30, 20))
    found = tracker.update(np.roll(noise(), (5, -7), (0, 1)))
    assert found.box == BoundingBox(53, 45, 30, 20)
    assert found.peak == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("kfc", "'kfc' is no tracker; known are mosse, csk"),
        (
            "situp:scale_criterion=min",
            "'situp:scale_criterion=min': scale_criterion is not allowed",
        ),
        ("situp:padding", "'padding' is no setting KEY=VALUE; keys are padding, window"),
        ("situp:pading=3", "'pading=3' is no setting KEY=VALUE"),
        ("situp:padding=0.5", "'situp:padding=0.5': padding = 0.5 is not allowed: give at least 1"),
        ("broken", "'broken' of template_tracker:nothing cannot be loaded"),
        ("number", "sys:maxsize cannot be called"),
        ("vit", "vit needs 1 model file"),
        ("nano:a.onnx", "nano needs 2 model file"),
        ("vit:gone.onnx", "gone.onnx: this model file for vit is not there"),
    ],
)
def test_what_is_no_tracker_is_named(plugin, name, said):
    with pytest.raises(TrackingError, match=said):
        find_tracker(name)


@pytest.mark.parametrize(("name", "files"), [("vit", 1), ("nano", 2), ("dasiamrpn", 3)])
def test_files_that_are_no_models_are_refused(tmp_path, name, files):
    path = tmp_path / "text.onnx"
    path.write_text("no model")
    full = f"{name}:{','.join([str(path)] * files)}"
    assert model_files(full) == [path] * files
    with pytest.raises(TrackingError, match="cannot make this tracker"):
        make_tracker(full).init(noise(), BoundingBox(60, 40, 40, 32))


def test_names_of_folders_lead_nowhere_else():
    assert folder_name("situp") == "situp"
    assert "/" not in folder_name("vit:../model.onnx")
    assert model_files("situp") == []


def test_a_tracker_of_opencv_needs_a_target_first():
    with pytest.raises(TrackingError, match="call init"):
        make_tracker("mil").update(noise())
