"""Disks that are full, locked or gone, and places with odd names: whole or not at all."""

import gc
import os
import shlex
import shutil
import threading
import traceback
import unicodedata
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.disks import small_disk
from support.media import write_video

import situp_annotate
from situp_annotate import writing
from situp_annotate.batch import annotate_batch
from situp_annotate.cli import cli
from situp_annotate.errors import DiskError, OutputError
from situp_annotate.formats import staging
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.review import review_csv
from situp_annotate.pipeline import annotate_video
from situp_annotate.recipe import load_recipe
from situp_annotate.types import BoundingBox, Keyframe, Method, Track, VideoJob
from situp_annotate.video.writer import H264Writer

PAGE = 4096
FULL = "cannot write here: No space left on device; free some space and run again"
ALL = load_recipe("situp", [f"outputs.exports={list(EXPORTERS)}"])
MANY_SMALL = load_recipe("situp", ["outputs.exports=['cvat', 'mot']", "outputs.report=false"])
PLAIN = load_recipe("situp")
FRAMES = 20

ODD_NAMES = {
    "blank": "two words",
    "composed": unicodedata.normalize("NFC", "été 東京"),
    "decomposed": unicodedata.normalize("NFD", "été 東京"),
    "dash": "-out",
    "quotes": 'it\'s "so" $HOME `x`',
    "protocol": "http:",
    "pattern": "%05d*?[a]",
    "reserved": "CON",
}
ODD_PLACES = {**ODD_NAMES, "newline": "new\nline", "longest": "x" * 255, "dots": "..."}


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return write_video(tmp_path_factory.mktemp("clips") / "clip.mp4", count=FRAMES)


def job_of(clip, video_id="clip"):
    """Three tracks, none of which needs a tracker."""

    def keyframe(frame, track_id):
        return Keyframe(frame, BoundingBox(4 * track_id + frame, 8, 20, 20))

    tracks = (
        Track(id_, "thing", (keyframe(0, id_), keyframe(FRAMES - 1, id_)), {}, Method.LINEAR)
        for id_ in (1, 2, 3)
    )
    return VideoJob(video_id, clip, tuple(tracks))


@pytest.fixture(scope="module")
def out(clip, tmp_path_factory):
    """A run of two videos on a sound disk."""
    output = tmp_path_factory.mktemp("run") / "out"
    jobs = [job_of(clip, name) for name in ("clip", "other")]
    annotate_batch(jobs, output, ALL, executor="serial")
    return output


@pytest.fixture
def disk(tmp_path):
    with small_disk(tmp_path / "disk") as disk:
        yield disk


@pytest.fixture(autouse=True)
def _no_thread_is_left():
    yield
    gc.collect()  # warns of files that were not closed
    assert not [thread for thread in threading.enumerate() if "Pool" in thread.name]


def contents(folder):
    """Everything but what says how long it took."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "summary.json"
    }


def names(folder):
    """What is there, but for the cache and others that never count."""
    return sorted(path.name for path in folder.iterdir() if path.name != ".cache")


def half_made(folder):
    return [path for suffix in ("partial", "old", "rescue") for path in folder.rglob(f"*.{suffix}")]


def pages(folder):
    return sum(-(-path.stat().st_size // PAGE) for path in folder.rglob("*") if path.is_file())


def culprit(error):
    """Which of our modules was writing when the disk refused."""
    home = Path(situp_annotate.__file__).parent
    frames = traceback.extract_tb(error.__cause__.__traceback__)
    paths = [Path(frame.filename).with_suffix("") for frame in frames]
    ours = [path.relative_to(home).as_posix() for path in paths if path.is_relative_to(home)]
    return [name for name in ours if name != "formats/sinks"][-1]


def annotate(clip, output, recipe=PLAIN, **options):
    return annotate_video(job_of(clip), output, recipe, **options)


def fail_on_full_disk(clip, disk, recipe, *, threads):
    """Run into the end of the disk; return who did."""
    output = disk.place / "out"
    before = contents(output / "other")
    with pytest.raises(DiskError) as caught:
        annotate(clip, output, recipe, threads=threads)
    assert str(caught.value).startswith(f"{output / 'clip'}: {FULL}")
    assert names(output) == ["other"]
    assert half_made(output) == []
    assert contents(output / "other") == before
    disk.leave_plenty()
    shutil.rmtree(output / ".cache", ignore_errors=True)
    return culprit(caught.value)


@pytest.mark.parametrize(
    ("recipe", "step", "expected"),
    [
        (
            MANY_SMALL,
            1,
            {"formats/labels_csv", "formats/mot/rows", "formats/mcap/file", "video/writer"}
            | {"outputs", "writing", "formats/cvat/exporting", "formats/mot/exporting", "pipeline"},
        ),
        (ALL, 6, {"report/video_page", "formats/coco/exporting", "formats/yolo"}),
    ],
)
def test_a_disk_that_is_full_anywhere_costs_nothing_but_the_video(
    clip, out, disk, tmp_path, recipe, step, expected
):
    whole = annotate(clip, tmp_path / "whole", recipe) and pages(tmp_path / "whole" / "clip")
    shutil.copytree(out / "other", disk.place / "out" / "other")
    seen = set()
    for free in range(0, whole, step):
        disk.leave_bytes(free * PAGE)
        seen.add(fail_on_full_disk(clip, disk, recipe, threads=1 + free % 2))
    assert seen >= expected
    annotate(clip, disk.place / "out", recipe)
    assert contents(disk.place / "out" / "clip") == contents(tmp_path / "whole" / "clip")


def test_a_disk_without_room_for_names_costs_nothing_but_the_video(clip, out, disk):
    shutil.copytree(out / "other", disk.place / "out" / "other")
    whole = len([*(out / "clip").rglob("*")]) + 4  # their folder, and three of the cache
    seen = set()
    for free in (*range(36), (36 + whole) // 2, whole - 1):
        disk.leave_names(free)
        seen.add(fail_on_full_disk(clip, disk, ALL, threads=1 + free % 2))
    assert seen >= {"formats/labels_csv", "formats/mcap/file", "video/writer", "report/video_page"}
    assert seen >= {"formats/disk", "formats/mot/rows", "outputs", "writing", "pipeline"}
    exports = ("cvat", "mot", "label_studio", "coco")
    assert seen >= {f"formats/{name}/exporting" for name in exports} | {"formats/yolo"}


def test_every_page_of_an_overlay_counts(disk):
    """Up to the last one, which is written when the index is put in front."""
    rng = np.random.default_rng(0)
    images = [rng.integers(0, 256, (48, 64, 3), np.uint8) for _ in range(20)]
    (disk.place / "other").write_bytes(bytes(PAGE))
    path = disk.place / "v.mp4"

    def write():
        with H264Writer(path, width=64, height=48, frame_rate=Fraction(30)) as writer:
            for index, image in enumerate(images):
                writer.write(image, index * 40_000_000)

    write()
    whole = path.stat().st_size
    path.unlink()
    for free in range(0, whole, PAGE):
        disk.leave_bytes(free)
        with pytest.raises(OSError, match="No space left"):
            write()
        path.unlink(missing_ok=True)
    disk.leave_bytes(whole)
    write()
    assert path.stat().st_size == whole


def test_a_full_disk_does_not_hide_what_failed_before(clip, disk):
    def fill_and_fail(done, total):
        if done == FRAMES + 9:
            disk.leave_bytes(0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        annotate(clip, disk.place / "out", on_progress=fill_and_fail)
    assert names(disk.place / "out") == []


def test_a_failed_replacement_keeps_the_old_outputs(clip, out, disk):
    shutil.copytree(out / "clip", disk.place / "out" / "clip")
    disk.leave_bytes(20 * PAGE)
    with pytest.raises(DiskError, match="No space left"):
        annotate(clip, disk.place / "out", ALL, overwrite=True)
    assert names(disk.place / "out") == ["clip"]
    assert contents(disk.place / "out" / "clip") == contents(out / "clip")


def test_a_cache_that_has_no_room_is_done_without(clip, disk, tmp_path, capfd):
    (disk.place / "other").write_bytes(bytes(PAGE))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / ".cache").symlink_to(disk.place)
    disk.leave_bytes(0)
    annotate(clip, tmp_path / "out")
    gc.collect()
    assert capfd.readouterr().err == ""
    assert names(disk.place / "clip") == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_of_somebody_else_is_told_of(clip, tmp_path):
    (tmp_path / "out" / "other").mkdir(parents=True)
    (tmp_path / "out").chmod(0o500)
    with pytest.raises(DiskError, match=r"out/clip: .*: Permission denied; make it writable"):
        annotate(clip, tmp_path / "out")
    assert names(tmp_path / "out") == ["other"]


def test_a_locked_disk_is_told_of(clip, out, disk):
    shutil.copytree(out / "other", disk.place / "out" / "other")
    disk.lock()
    with pytest.raises(DiskError, match=r"out/clip: .*: Read-only file system; make it writable"):
        annotate(clip, disk.place / "out")
    assert names(disk.place / "out") == ["other"]


@pytest.mark.parametrize("after", [1, FRAMES + 1, FRAMES + 9, 2 * FRAMES - 1])
@pytest.mark.parametrize("recipe", [ALL, load_recipe("overlay")], ids=["all", "overlay"])
def test_a_folder_that_vanishes_is_told_of_and_does_not_come_back(clip, tmp_path, after, recipe):
    output = tmp_path / "share" / "out"

    def vanish(done, total):
        if done == after:
            shutil.rmtree(tmp_path / "share")

    with pytest.raises(DiskError, match=r"out/clip: .*: No such file or directory; see that"):
        annotate(clip, output, recipe, on_progress=vanish)
    assert names(tmp_path) == []


def test_a_folder_that_vanishes_between_two_files_is_no_place_for_the_second(
    clip, tmp_path, monkeypatch
):
    def vanish(*arguments):
        shutil.rmtree(tmp_path / "out")
        return review_csv(*arguments)

    monkeypatch.setattr(writing, "review_csv", vanish)
    with pytest.raises(DiskError, match=r"out/clip: .*: No such file or directory; see that"):
        annotate(clip, tmp_path / "out", load_recipe("csv_only"))
    assert names(tmp_path) == []


@pytest.mark.parametrize("after", [1, FRAMES + 9, 2 * FRAMES - 1])
def test_a_disk_that_is_taken_away_is_told_of(clip, disk, after):
    def take_away(done, total):
        if done == after:
            disk.take_away()

    with pytest.raises(DiskError, match=r"out/clip: .*: No such file or directory; see that"):
        annotate(clip, disk.place / "out", on_progress=take_away)
    assert names(disk.place) == []


def test_a_file_in_the_way_is_told_of(clip, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(DiskError, match=r"file/out/clip: .*: Not a directory"):
        annotate(clip, tmp_path / "file" / "out")
    (tmp_path / "clip").write_text("mine")
    for overwrite in (False, True):
        with pytest.raises(OutputError, match=r"is already there|a file is there"):
            annotate(clip, tmp_path, overwrite=overwrite)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "file": "mine",
        "clip": "mine",
    }


@pytest.mark.parametrize("name", ODD_PLACES.values(), ids=ODD_PLACES)
def test_an_output_folder_may_have_any_name(clip, out, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    annotate(clip, name, ALL)
    assert names(Path(name)) == ["clip"]
    assert names(tmp_path) == [name]
    assert contents(tmp_path / name / "clip") == contents(out / "clip")


@pytest.mark.parametrize("name", [*ODD_NAMES.values(), "é" * 100], ids=[*ODD_NAMES, "longest"])
def test_a_video_may_have_any_id(clip, out, tmp_path, name):
    annotate_video(job_of(clip, name), tmp_path, ALL)
    assert names(tmp_path) == [name]
    ours, theirs = contents(tmp_path / name), contents(out / "clip")
    assert len(ours) == len(theirs)
    for same in ("labels.csv", "overlay.mp4", "mot.csv"):
        assert ours[same] == theirs[same]


@pytest.mark.parametrize(("name", "reason"), [("x" * 256, "File name too long"), ("\udcff", "UTF")])
def test_names_that_cannot_be_are_told_of(clip, tmp_path, name, reason):
    with pytest.raises(OutputError, match=reason) as caught:
        annotate(clip, tmp_path / name)
    assert str(caught.value).isprintable()
    assert names(tmp_path) == []


def test_nothing_is_to_be_seen_before_all_is_done(clip, tmp_path, monkeypatch):
    seen = []

    def look(*_):
        paths = (path.relative_to(tmp_path) for path in tmp_path.rglob("*"))
        hidden = {path for path in paths if any(part.startswith(".") for part in path.parts)}
        seen.append({p.relative_to(tmp_path) for p in tmp_path.rglob("*")} - hidden)

    monkeypatch.setattr(staging, "sync_tree", look)  # all is written then
    annotate(clip, tmp_path / "out", ALL, on_progress=look)
    assert len(seen) > 2 * FRAMES
    assert all(visible == {Path("out")} for visible in seen)


def call(*arguments):
    return CliRunner().invoke(cli, [*map(str, arguments)])


def files_of(command, out, clip):
    """A command and what it works on; where it writes is still to be said."""
    return {
        "export": ["export", out, "--format", "yolo", "--images", "--video", "clip"],
        "overlay": ["overlay", out, "--video", "clip"],
        "contact-sheet": ["contact-sheet", out, "--video", "clip", "--steps", "1"],
        "excerpt": ["excerpt", out, "--video", "clip"],
        "recover": ["recover", out / "clip" / "annotations.mcap"],
        "thin": ["thin", out / "clip" / "manifest.json", out, "--allow-outside"],
        "import": ["import", out / "clip" / "mot" / "clip.txt", "--videos", clip],
        "init": ["init", clip.parent],
    }[command]


SUFFIXES = {
    "export": "",
    "overlay": "",
    "contact-sheet": "",
    "excerpt": ".webp",
    "recover": ".mcap",
    "thin": ".json",
    "import": ".json",
    "init": ".json",
}


@pytest.mark.parametrize("command", SUFFIXES)
def test_commands_on_a_full_disk_leave_what_was_there(clip, out, disk, command):
    arguments = files_of(command, out, clip)
    place = disk.place / f"place{SUFFIXES[command]}"
    replace_it = "--force" if command == "init" else "--overwrite"
    assert call(*arguments, "--output", place).exit_code == 0
    before, whole = contents(disk.place), pages(disk.place)
    for free in sorted({0, 1, whole // 2, whole - 1} & {*range(whole)}):
        disk.leave_bytes(free * PAGE)
        outcome = call(*arguments, "--output", place, replace_it)
        assert outcome.exit_code == 5, outcome.output
        assert outcome.stderr.startswith(f"Error: {place}")
        assert FULL in outcome.stderr
        assert "left out" not in outcome.stderr
        assert contents(disk.place) == before
        assert half_made(disk.place) == []
        disk.leave_plenty()


@pytest.mark.parametrize("command", SUFFIXES)
def test_commands_write_to_places_of_any_name(clip, out, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    suffix = SUFFIXES[command]
    places = {name: f"{name[: 255 - len(suffix)]}{suffix}" for name in ODD_PLACES.values()}
    for place in places.values():
        outcome = call(*files_of(command, out, clip), "--output", place)
        assert outcome.exit_code == 0, outcome.output
    assert names(tmp_path) == sorted(places.values())
    assert all(contents(Path(place)) for place in places.values() if not suffix)
    assert len({Path(place).read_bytes() for place in places.values() if suffix}) <= 1


@pytest.mark.parametrize("command", SUFFIXES)
def test_commands_say_what_is_wrong_with_a_place(clip, out, tmp_path, command):
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("loop")
    places = {
        "x" * 300: "File name too long",
        "\udcff": "not valid UTF-8",
        "file/in": "Not a directory",
        "loop/in": "Too many levels",
    }
    for name, reason in places.items():
        place = tmp_path / f"{name}{SUFFIXES[command]}"
        for replace_it in ([], ["--force" if command == "init" else "--overwrite"]):
            outcome = call(*files_of(command, out, clip), "--output", place, *replace_it)
            assert outcome.exit_code == 5, outcome.output
            assert reason in outcome.stderr
    assert names(tmp_path) == ["file", "loop"]


@pytest.mark.parametrize("command", ["init", "import"])
def test_the_next_command_is_one_to_copy(clip, out, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    for name in ODD_NAMES.values():
        outcome = call(*files_of(command, out, clip), "--output", f"{name}.json")
        shown = outcome.output[outcome.output.index("situp-annotate check") :].splitlines()[0]
        assert Path(shlex.split(shown)[2]) == Path(f"{name}.json")
        assert "No such option" not in call(*shlex.split(shown)[1:]).stderr


def test_sources_may_begin_with_a_dash(clip, out, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(clip.parent, "-clips")
    shutil.copytree(out, "-out")
    assert call("init", "--output=-m.json", "--", "-clips").exit_code == 0
    for command in ("export", "overlay", "contact-sheet"):
        options = ["--format", "csv"] if command == "export" else []
        outcome = call(command, *options, "--output=-made", "--", "-out")
        assert outcome.exit_code == 0, outcome.output
    assert {"csv", "clip", "clip.mp4", "other", "other.mp4"} == {*names(Path("-made"))}
