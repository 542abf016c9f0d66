"""``overlay``, ``contact-sheet`` and ``excerpt``: what they write, say, and refuse."""

import shutil

import av
import pytest
from click.testing import CliRunner
from PIL import Image as Pillow
from support.patch import patch_job, write_patch

from situp_annotate.batch import annotate_batch
from situp_annotate.cli import cli
from situp_annotate.errors import OutputError
from situp_annotate.recipe import load_recipe
from situp_annotate.video.writer import H264Writer


def call(command, *arguments):
    return CliRunner().invoke(cli, [command, *map(str, arguments)])


def shape(path):
    """Format and number of pictures."""
    with Pillow.open(path) as picture:
        return picture.format, picture.n_frames


def files(folder):
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A run of two videos."""
    clip = write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4")
    jobs = [patch_job(clip, 0, 6), patch_job(clip, 3, video_id="second")]
    output = tmp_path_factory.mktemp("run") / "out"
    recipe = load_recipe("overlay")
    annotate_batch(jobs, output, recipe, executor="serial")
    return output


@pytest.fixture
def broken(tmp_path):
    """A run of two videos, of which one is gone since."""
    clips = [write_patch(tmp_path / f"{name}.mp4") for name in ("here", "gone")]
    jobs = [patch_job(clip, 0, video_id=clip.stem) for clip in clips]
    recipe = load_recipe("csv_only")
    annotate_batch(jobs, tmp_path / "out", recipe, executor="serial")
    clips[1].unlink()
    return tmp_path / "out"


def test_overlays_are_those_of_the_run(out, tmp_path):
    outcome = call("overlay", out, "--output", tmp_path / "o")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout.startswith("2 of 2 videos drawn in ")
    assert outcome.stdout.endswith(f" s; the overlays are in {tmp_path / 'o'}.\n")
    assert files(tmp_path / "o") == ["patch.mp4", "second.mp4"]
    for name in ("patch", "second"):
        assert (tmp_path / "o" / f"{name}.mp4").read_bytes() == (
            out / name / "overlay.mp4"
        ).read_bytes()


def test_settings_and_chosen_videos(out, tmp_path):
    arguments = ("--video", "second", "--set", "overlay.max_height=48")
    assert call("overlay", out, "-o", tmp_path / "o", *arguments).exit_code == 0
    assert files(tmp_path / "o") == ["second.mp4"]
    with av.open(str(tmp_path / "o" / "second.mp4")) as container:
        assert container.streams.video[0].height == 48


def test_a_recipe_of_ones_own(out, tmp_path):
    recipe = tmp_path / "mine.toml"
    recipe.write_text("[overlay]\nmax_height = 48\n[tracker]\npadding = 2.0\n")
    outcome = call("overlay", out, "-o", tmp_path / "o", "--recipe", recipe)
    assert outcome.exit_code == 0, outcome.output
    with av.open(str(tmp_path / "o" / "patch.mp4")) as container:
        assert container.streams.video[0].height == 48


def test_two_runs_beside_each_other(out, tmp_path):
    outcome = call("overlay", out, "--beside", out, "-o", tmp_path / "o")
    assert outcome.exit_code == 0, outcome.output
    with av.open(str(tmp_path / "o" / "patch.mp4")) as container:
        assert container.streams.video[0].width == 2 * 160 + 4


def test_a_run_that_lacks_a_video_is_told_of(out, broken, tmp_path):
    outcome = call("overlay", out, "--beside", broken, "-o", tmp_path / "o")
    assert outcome.exit_code == 1
    assert "patch is left out: " in outcome.stderr
    assert outcome.stdout.startswith("0 of 2 videos drawn")


@pytest.mark.parametrize(
    ("command", "made"),
    [("overlay", ["here.mp4"]), ("contact-sheet", ["here/track-1.png"])],
)
def test_a_video_that_is_gone_does_not_stop_the_others(broken, tmp_path, command, made):
    outcome = call(command, broken, "-o", tmp_path / "made")
    assert outcome.exit_code == 1
    assert "gone is left out: " in outcome.stderr
    assert outcome.stdout.startswith("1 of 2 videos drawn")
    assert files(tmp_path / "made") == made
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("command", "made"), [("overlay", "second.mp4"), ("contact-sheet", "second/track-1.png")]
)
def test_nothing_is_replaced_unasked(out, tmp_path, command, made):
    place = tmp_path / "made" / made
    place.parent.mkdir(parents=True)
    place.write_text("mine")
    outcome = call(command, out, "-o", tmp_path / "made")
    assert outcome.exit_code == 5
    assert "--overwrite" in outcome.stderr
    assert files(tmp_path / "made") == [made]
    assert place.read_text() == "mine"
    assert call(command, out, "-o", tmp_path / "made", "--overwrite").exit_code == 0
    assert place.read_bytes() != b"mine"


def test_contact_sheets_never_replace_a_folder_of_the_run(out, tmp_path):
    run = tmp_path / "out"
    shutil.copytree(out, run)
    before = files(run)
    outcome = call("contact-sheet", run, "-o", run, "--overwrite")
    assert outcome.exit_code == 5
    assert "which is not to be replaced" in outcome.stderr
    assert files(run) == before


@pytest.mark.parametrize(("command", "name"), [("overlay", "here.mp4"), ("excerpt", "here.gif")])
def test_a_video_of_the_run_is_never_replaced(tmp_path, command, name):
    clip = write_patch(tmp_path / "patch.mp4").rename(tmp_path / name)
    job = patch_job(clip, 0, video_id="here")
    annotate_batch([job], tmp_path / "out", load_recipe("csv_only"), executor="serial")
    before = clip.read_bytes()
    place = tmp_path if command == "overlay" else clip
    outcome = call(command, tmp_path / "out", "-o", place, "--overwrite")
    assert outcome.exit_code == 5
    assert "a video that the run has annotated" in outcome.stderr
    assert clip.read_bytes() == before


def test_a_video_that_cannot_be_encoded_does_not_stop_the_others(out, tmp_path, monkeypatch):
    def refuse(writer, image, pts_ns, original=H264Writer.write):
        if "patch" in str(writer._path):
            raise OutputError("patch.mp4: this video cannot be encoded: Invalid argument.")
        original(writer, image, pts_ns)

    monkeypatch.setattr(H264Writer, "write", refuse)
    outcome = call("overlay", out, "-o", tmp_path / "o")
    assert outcome.exit_code == 1
    assert "patch is left out: " in outcome.stderr
    assert files(tmp_path / "o") == ["second.mp4"]


def test_a_full_disk_stops_them_all(out, tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(H264Writer, "write", refuse)
    outcome = call("overlay", out, "-o", tmp_path / "o")
    assert outcome.exit_code == 5
    assert f"{tmp_path / 'o'}: cannot write here: No space left on device; free" in outcome.stderr
    assert "left out" not in outcome.stderr


@pytest.mark.parametrize("command", ["overlay", "excerpt"])
@pytest.mark.parametrize(
    ("setting", "words"),
    [("tracker.padding=3", "only settings of the overlay matter"),
     ("overlay.trails=-1", "trails = -1.0 is not allowed"),
     ("overlay.tails=1", "did you mean 'trails'")],
)  # fmt: skip
def test_bad_settings_are_refused(out, tmp_path, command, setting, words):
    outcome = call(command, out, "-o", tmp_path / "o.gif", "--set", setting)
    assert outcome.exit_code == 4
    assert words in outcome.stderr
    assert not files(tmp_path)


@pytest.mark.parametrize("command", ["overlay", "contact-sheet", "excerpt"])
def test_what_is_no_run_is_named(tmp_path, command):
    outcome = call(command, tmp_path, "-o", tmp_path / "o.gif")
    assert outcome.exit_code == 1
    assert "give the output folder of `situp-annotate run`" in outcome.stderr


def test_contact_sheets(out, tmp_path):
    outcome = call("contact-sheet", out, "-o", tmp_path / "c", "--steps", "3")
    assert outcome.exit_code == 0, outcome.output
    assert files(tmp_path / "c") == ["patch/track-1.png", "second/track-1.png"]


@pytest.mark.parametrize("suffix", ["gif", "webp", "GIF"])
def test_an_excerpt(out, tmp_path, suffix):
    path = tmp_path / f"e.{suffix}"
    outcome = call("excerpt", out, "--video", "patch", "--seconds", "0.3", "-o", path)
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout == f"patch: {path.stat().st_size / 1000:.0f} kB in {path}\n"
    assert shape(path) == (suffix.upper(), 3)
    again = call("excerpt", out, "--video", "patch", "-o", path)
    assert again.exit_code == 5
    assert call("excerpt", out, "--video", "patch", "-o", path, "--overwrite").exit_code == 0
    assert shape(path) == (suffix.upper(), 4)


def test_an_excerpt_is_of_one_video(out, tmp_path):
    outcome = call("excerpt", out, "-o", tmp_path / "e.gif")
    assert outcome.exit_code == 2
    assert "choose one with --video: patch, second" in outcome.stderr
    outcome = call("excerpt", out, "--video", "third", "-o", tmp_path / "e.gif")
    assert outcome.exit_code == 1
    assert "no annotated video has the id 'third'" in outcome.stderr


def test_the_name_says_what_an_excerpt_is(out, tmp_path):
    outcome = call("excerpt", out, "--video", "patch", "-o", tmp_path / "e.png")
    assert outcome.exit_code == 5
    assert "must end in .webp or .gif" in outcome.stderr
