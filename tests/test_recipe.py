"""Recipes: what is ready-made, what is refused, and that the defaults stand in one place."""

import tomllib
from dataclasses import asdict, replace

import pytest

from situp_annotate.errors import RecipeError
from situp_annotate.formats.mcap.pictures import McapOptions
from situp_annotate.formats.overlay.options import OverlayOptions
from situp_annotate.limits import Limits
from situp_annotate.propagation import PropagationOptions
from situp_annotate.recipe import (
    MotOptions,
    Outputs,
    Recipe,
    _folder,
    load_recipe,
    recipe_from_dict,
    recipe_names,
)
from situp_annotate.trackers import PRESETS
from situp_annotate.tracking import TrackerParams
from situp_annotate.types import Extend, Method, State


def test_ready_made_recipes_equal_the_defaults():
    assert load_recipe() == load_recipe("fast") == Recipe()
    assert load_recipe("situp") == replace(Recipe(), tracker=TrackerParams())


@pytest.mark.parametrize(
    ("section", "defaults"),
    [
        ("tracker", TrackerParams()),
        ("propagation", PropagationOptions()),
        ("outputs", Outputs()),
        ("mot", MotOptions()),
        ("mcap", McapOptions()),
        ("overlay", OverlayOptions()),
        ("limits", Limits()),
    ],
)
def test_situp_spells_out_every_setting(section, defaults):
    document = tomllib.loads((_folder() / "situp.toml").read_text())
    settings = {name for name, value in asdict(defaults).items() if value is not None}
    assert set(document[section]) == settings


def test_every_ready_made_recipe_loads():
    assert recipe_names() == ["accurate", "csv_only", "fast", "overlay", "situp"]
    for name in recipe_names():
        load_recipe(name)


@pytest.mark.parametrize("name", ["accurate", "fast"])
def test_recipes_with_another_tracker_differ_in_nothing_else(name):
    assert load_recipe(name) == replace(Recipe(), tracker=PRESETS[name].params)


def test_csv_only_and_overlay_write_nothing_else():
    assert load_recipe("csv_only").outputs == Outputs(True, mcap=False, overlay=False, report=False)
    assert load_recipe("overlay").outputs == Outputs(False, mcap=False, overlay=True, report=False)


def test_recipe_of_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[tracker]\nlearning_rate = 0.02\nscale_factors = [1]\n")
    changed = replace(Recipe().tracker, learning_rate=0.02, scale_factors=(1.0,))
    assert load_recipe(path).tracker == changed


def test_settings_win_over_the_recipe():
    recipe = load_recipe(
        "csv_only",
        ["tracker.learning_rate=0.01", "outputs.mcap = true", "decoding.incomplete=keep",
         "tracker.scale_factors=[1.0, 1.1]"],
    )  # fmt: skip
    assert recipe.tracker.learning_rate == 0.01
    assert recipe.tracker.scale_factors == (1.0, 1.1)
    assert recipe.outputs.mcap
    assert not recipe.outputs.overlay
    assert recipe.decoding.incomplete == "keep"


def test_a_preset_is_another_tracker(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('[tracker]\npreset = "dcf"\nlearning_rate = 0.5\n')
    dcf = PRESETS["dcf"].params
    assert load_recipe(path).tracker == replace(dcf, learning_rate=0.5)
    assert load_recipe("situp", ["tracker.preset=dcf"]).tracker == dcf
    settings = ["tracker.padding=3", "tracker.preset=dcf", "tracker.cell_size=6"]
    assert load_recipe(path, settings).tracker == replace(dcf, cell_size=6)
    recipe = load_recipe(path)
    assert recipe_from_dict(recipe.as_dict()) == recipe


def test_settings_of_propagation():
    recipe = load_recipe(
        "situp",
        ["propagation.method=cubic", "propagation.direction=forward", "propagation.extend=both",
         "propagation.memory_mb=64", 'mot.states=["lost"]'],
    )  # fmt: skip
    assert recipe.propagation == PropagationOptions(Method.CUBIC, "forward", Extend.BOTH, 64)
    assert isinstance(recipe.propagation.method, Method)
    assert recipe.mot.states == (State.LOST,)
    assert recipe.as_dict()["mot"]["states"] == ["lost"]
    assert recipe.sha256 != Recipe().sha256


def test_settings_of_the_overlay():
    recipe = load_recipe(
        "situp",
        ['overlay.tracks=[1, "van"]', "overlay.trails=2", "overlay.captions=id",
         "overlay.below=0.5", "overlay.max_height=360", "overlay.sound=false"],
    )  # fmt: skip
    expected = OverlayOptions(
        captions="id", trails=2.0, tracks=(1, "van"), below=0.5, max_height=360, sound=False
    )
    assert recipe.overlay == expected


def test_settings_of_the_limits():
    recipe = load_recipe("situp", ["limits.max_pixels=90_000_000", "limits.max_frames=99"])
    assert recipe.limits == Limits(max_pixels=90_000_000, max_frames=99)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["tracker.learning_rat=0.01"], "did you mean 'learning_rate'"),
        (["traker.learning_rate=0.01"], "did you mean 'tracker'"),
        (["tracker.preset=situ"], "tracker.preset = 'situ' is no tracker of the family; did you"),
        (["tracker.preset=3"], "preset = 3 is no tracker of the family; Known are accurate"),
        (["tracker.preset=dcf", "tracker.kernel=x"], "tracker.kernel = 'x' is not allowed"),
        (["tracker.learning_rate=2"], "learning_rate = 2.0 is not allowed: give from 0 to 1"),
        (["tracker.learning_rate=fast"], "tracker.learning_rate = 'fast' is not allowed"),
        (["tracker.learning_rate=true"], "tracker.learning_rate = True is not allowed"),
        (["tracker.learning_rate=nan"], "is not allowed"),
        (["tracker.learning_rate"], "give SECTION.KEY=VALUE"),
        (["learning_rate=1"], "give SECTION.KEY=VALUE"),
        (["decoding.incomplete=maybe"], "'fail' or 'keep'"),
        (["outputs.mot=1"], "outputs.mot = 1 is not allowed"),
        (["mot.pixel_origin=2"], "mot.pixel_origin = 2 is not allowed"),
        (['mot.states=["gone"]'], "mot.states.0 = 'gone' is not allowed"),
        (["propagation.method=magic"], "propagation.method = 'magic' is not allowed"),
        (["propagation.direction=backward"], "'both' or 'forward'"),
        (["propagation.memory_mb=0"], "memory_mb = 0 is not allowed: give at least 1"),
        (["propagation.memory_mb=1.5"], "propagation.memory_mb = 1.5 is not allowed"),
        (["overlay.crf=0"], "crf = 0 is not allowed: give from 1 to 51"),
        (["mcap.pictures=png"], "'auto', 'h264', 'jpeg' or 'none'"),
        (["mcap.crf=52"], "mcap.crf = 52 is not allowed: give from 1 to 51"),
        (["mcap.jpeg_quality=0"], "jpeg_quality = 0 is not allowed: give from 1 to 100"),
        (["overlay.tracks=1"], "overlay.tracks = 1 is not allowed"),
        (["overlay.tracks=[1.5]"], "overlay.tracks.0"),
        (["overlay.captions=big"], "'full', 'id' or 'none'"),
        (["overlay.trails=-1"], "overlay.trails = -1.0 is not allowed: give seconds, 0 or more"),
        (["overlay.below=2"], "below = 2.0 is not allowed: give from 0 to 1"),
        (["overlay.max_height=7"], "max_height = 7 is not allowed: give 0, or at least 16"),
        (["limits.max_tracks=0"], "limits.max_tracks = 0 is not allowed: give at least 1"),
        (["limits.max_pixels=1.5"], "limits.max_pixels = 1.5 is not allowed"),
        (["overlay.preset=hurried"], "overlay.preset = 'hurried' is not allowed"),
    ],
)
def test_bad_settings_are_refused(settings, words):
    with pytest.raises(RecipeError) as caught:
        load_recipe("situp", settings)
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"--set {settings[-1]}")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[tracker]\npading = 2", "did you mean 'padding'"),
        ("[trackers]\n", "did you mean 'tracker'"),
        ("tracker = 3", "must be a table"),
        ("[tracker\n", "not valid TOML"),
        ("[tracker]\npadding = 1979-05-27", "padding"),
        ("[tracker]\npadding = " + "9" * 5000, "a number has too many digits"),
        ("[tracker]\npadding = 0x" + "f" * 5000, "a number has too many digits"),
        ("[tracker]\npadding = " + "[" * 2000, "nested too deeply"),
        (f'[tracker]\n"{"x" * 999}\\u001b[31m" = 1', "is no setting"),
        (f'"{"x" * 999}\\u001b[31m" = 1', "has no section"),
        (f'[tracker]\npadding = "{"x" * 999}\\u001b[31m"', "is not allowed"),
        (f'tracker = "{"x" * 999}\\u001b[31m"', "must be a table"),
    ],
)
def test_bad_files_are_named(tmp_path, text, words):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(RecipeError) as caught:
        load_recipe(path)
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 800


def test_missing_recipes_are_named(tmp_path):
    with pytest.raises(RecipeError, match="did you mean 'csv_only'"):
        load_recipe("csvonly")
    with pytest.raises(RecipeError, match="cannot be read"):
        load_recipe(tmp_path / "none.toml")


def test_hash_follows_the_values_not_the_way_they_were_set():
    assert load_recipe("fast", ["outputs.mcap=false"]).sha256 != Recipe().sha256
    assert load_recipe("fast", ["outputs.mcap=true"]).sha256 == Recipe().sha256
