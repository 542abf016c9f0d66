"""Folders and files that appear whole or not at all."""

import errno
import os
import shutil
import subprocess
import sys
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import pytest

from situp_annotate.errors import DiskError, OutputError
from situp_annotate.formats.staging import (
    discard_staging,
    hidden_beside,
    recover_staging,
    refuse_existing,
    staged_entries,
    staged_folder,
    write_whole,
)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_folder_appears_when_done(tmp_path):
    with staged_folder(tmp_path / "video", replaceable=None) as folder:
        (folder / "a.csv").write_text("a")
        assert not (tmp_path / "video").exists()
    assert names(tmp_path) == ["video"]
    assert names(tmp_path / "video") == ["a.csv"]


def test_nothing_is_left_of_a_failure(tmp_path):
    with (
        pytest.raises(ZeroDivisionError),
        staged_folder(tmp_path / "video", replaceable=None) as folder,
    ):
        (folder / "a.csv").write_text("a")
        raise ZeroDivisionError
    assert names(tmp_path) == []


def test_what_is_there_stays_unless_replacing_was_asked_for(tmp_path):
    target = tmp_path / "video"
    target.mkdir()
    (target / "a.csv").write_text("old")
    with pytest.raises(OutputError, match="--overwrite"), staged_folder(target, replaceable=None):
        pass
    assert (target / "a.csv").read_text() == "old"
    with staged_folder(target, replaceable=frozenset({"a.csv"})) as folder:
        (folder / "b.csv").write_text("new")
    assert names(tmp_path) == ["video"]
    assert names(target) == ["b.csv"]


def test_replacing_spares_what_somebody_else_put_there(tmp_path):
    target = tmp_path / "video"
    target.mkdir()
    (target / "notes.txt").write_text("mine")
    with (
        pytest.raises(OutputError, match=r"notes\.txt"),
        staged_folder(target, replaceable=frozenset({"a.csv"})),
    ):
        pass
    assert names(target) == ["notes.txt"]


def test_failed_replacement_keeps_the_old(tmp_path):
    target = tmp_path / "video"
    target.mkdir()
    (target / "a.csv").write_text("old")
    with (
        pytest.raises(ZeroDivisionError),
        staged_folder(target, replaceable=frozenset({"a.csv"})) as folder,
    ):
        (folder / "a.csv").write_text("half of the new")
        raise ZeroDivisionError
    assert (target / "a.csv").read_text() == "old"
    assert names(tmp_path) == ["video"]


def test_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").touch()
    target = tmp_path / "file" / "video"
    with (
        pytest.raises(OutputError, match="cannot write here"),
        staged_folder(target, replaceable=None),
    ):
        pass
    with pytest.raises(OutputError, match="cannot write here"):
        write_whole(target, "text")


def test_leftovers_of_a_killed_process_go(tmp_path):
    staging = tmp_path / ".video.partial"
    staging.mkdir()
    (staging / "half").touch()
    discard_staging(tmp_path / "video")
    assert names(tmp_path) == []


def test_text_is_replaced_whole(tmp_path):
    path = tmp_path / "new" / "batch.json"
    write_whole(path, "first")
    write_whole(path, "zweitens ✓")
    assert path.read_text(encoding="utf-8") == "zweitens ✓"
    assert names(path.parent) == ["batch.json"]


def test_entries_join_what_is_there_and_replace_their_namesakes(tmp_path):
    target = tmp_path / "exported"
    with staged_entries(target, overwrite=False) as folder:
        (folder / "a.xml").write_text("old")
        (folder / "set").mkdir()
        (folder / "set" / "1.txt").write_text("old")
    (target / "notes.txt").write_text("somebody's")
    with staged_entries(target, overwrite=True) as folder:
        (folder / "a.xml").write_text("new")
        (folder / "set").mkdir()
        (folder / "set" / "2.txt").write_text("new")
    assert names(target) == ["a.xml", "notes.txt", "set"]
    assert (target / "a.xml").read_text() == "new"
    assert names(target / "set") == ["2.txt"]
    assert names(tmp_path) == ["exported"]


def test_a_file_never_replaces_a_folder(tmp_path):
    (tmp_path / "exported" / "a.xml").mkdir(parents=True)
    with (
        pytest.raises(OutputError, match="cannot write here"),
        staged_entries(tmp_path / "exported", overwrite=True) as folder,
    ):
        (folder / "a.xml").write_text("new")
    assert (tmp_path / "exported" / "a.xml").is_dir()


def test_patterns_say_what_may_be_replaced(tmp_path):
    sheets = tmp_path / "sheets"
    for name, is_foreign in (("track-1.png", False), ("TRACK-1.PNG", True), ("track-1.txt", True)):
        sheets.mkdir()
        (sheets / name).touch()
        with (
            pytest.raises(OutputError, match=name) if is_foreign else nullcontext(),
            staged_folder(sheets, replaceable=frozenset({"track-*.png"})) as folder,
        ):
            (folder / "track-2.png").touch()
        assert names(sheets) == [name if is_foreign else "track-2.png"]
        shutil.rmtree(sheets)


def test_entries_are_refused_where_something_is_unless_told(tmp_path):
    target = tmp_path / "exported"
    target.mkdir()
    with staged_entries(target, overwrite=False) as folder:  # an empty folder is nothing
        (folder / "a.xml").write_text("old")
    with (
        pytest.raises(OutputError, match="--overwrite"),
        staged_entries(target, overwrite=False) as folder,
    ):
        (folder / "a.xml").write_text("new")
    assert (target / "a.xml").read_text() == "old"


def test_entries_of_a_failure_never_appear(tmp_path):
    target = tmp_path / "exported"
    with pytest.raises(ZeroDivisionError), staged_entries(target, overwrite=False) as folder:
        (folder / "a.xml").write_text("half")
        raise ZeroDivisionError
    assert names(tmp_path) == []


def test_entries_cannot_go_into_a_file(tmp_path):
    (tmp_path / "exported").write_text("a file")
    for overwrite in (False, True):
        with (
            pytest.raises(OutputError, match="exported"),
            staged_entries(tmp_path / "exported", overwrite=overwrite) as folder,
        ):
            (folder / "a.xml").write_text("new")
    assert (tmp_path / "exported").read_text() == "a file"


def test_entries_can_go_where_one_is(tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    (here / "notes.txt").write_text("mine")
    monkeypatch.chdir(here)
    with staged_entries(Path(), overwrite=True) as folder:
        (folder / "a.xml").write_text("new")
    assert names(here) == ["a.xml", "notes.txt"]
    assert names(tmp_path) == ["here"]
    with (
        pytest.raises(OutputError, match="something is there"),
        staged_entries(Path(), overwrite=False),
    ):
        pass


def test_a_folder_is_no_place_for_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OutputError, match="cannot write here"):
        write_whole(Path(), "text")
    discard_staging(Path())
    assert names(tmp_path) == []


KILLED = """
import os, sys
from pathlib import Path
from situp_annotate.formats import staging

moves = int(sys.argv[2])
rename = Path.rename

def move(path, target):
    global moves
    if moves == 0:
        os._exit(9)
    moves -= 1
    return rename(path, target)

Path.rename = move
staging.sync = lambda path: os._exit(9)  # comes after the moves
with staging.staged_folder(Path(sys.argv[1]), replaceable=frozenset({"a.csv"})) as folder:
    (folder / "a.csv").write_text("new")
"""


@pytest.mark.parametrize(
    ("moves", "left", "content"),
    [
        (0, [".video.partial", "video"], "old"),
        (1, [".video.old", ".video.partial"], "old"),
        (2, [".video.old", "video"], "new"),
    ],
)
def test_a_replacement_that_is_killed_is_undone_or_done(tmp_path, moves, left, content):
    (tmp_path / "video").mkdir()
    (tmp_path / "video" / "a.csv").write_text("old")
    command = [sys.executable, "-c", KILLED, str(tmp_path / "video"), str(moves)]
    assert subprocess.run(command, check=False).returncode == 9
    assert names(tmp_path) == left
    recover_staging(tmp_path, ["other", "video"])
    assert names(tmp_path) == ["video"]
    assert (tmp_path / "video" / "a.csv").read_text() == content


@pytest.mark.parametrize("name", ["x" * 255, "new\nline", "-v", "é"])
def test_names_of_any_kind_are_recovered(tmp_path, name):
    hidden_beside(tmp_path / name, "old").mkdir()
    hidden_beside(tmp_path / name, "partial").write_text("half a file")
    recover_staging(tmp_path, [name])
    assert names(tmp_path) == [name]


def test_recovery_touches_nothing_else(tmp_path):
    theirs = [".git", ".notes.old", ".notes.partial", "video.partial", ".video.older", ".video"]
    for name in theirs:
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").touch()
    recover_staging(tmp_path, ["video", "git"])
    assert names(tmp_path) == sorted(theirs)
    assert all(names(tmp_path / name) == ["file"] for name in theirs)


def test_recovery_looks_once_however_many_names_there_are(tmp_path, monkeypatch):
    looks = []

    def look(original, *arguments, **options):
        looks.append(arguments)
        return original(*arguments, **options)

    for call in ("stat", "lstat", "unlink", "rename", "scandir"):
        monkeypatch.setattr(os, call, partial(look, getattr(os, call)))
    recover_staging(tmp_path, [str(number) for number in range(10_000)])
    assert len(looks) < 5


def test_nothing_is_to_be_recovered_where_nothing_is(tmp_path):
    recover_staging(tmp_path / "none", ["video"])
    assert names(tmp_path) == []
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="file: cannot write here: Not a directory"):
        recover_staging(tmp_path / "file", ["video"])


def test_a_move_that_is_refused_leaves_the_old(tmp_path, monkeypatch):
    (tmp_path / "video").mkdir()
    (tmp_path / "video" / "a.csv").write_text("old")
    rename = Path.rename

    def refuse(path, target):
        if path.name == ".video.partial":
            raise OSError(errno.ENOSPC, "No space left on device")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with (
        pytest.raises(DiskError, match="video: cannot write here: No space left"),
        staged_folder(tmp_path / "video", replaceable=frozenset({"a.csv"})) as folder,
    ):
        (folder / "a.csv").write_text("new")
    assert names(tmp_path) == ["video"]
    assert (tmp_path / "video" / "a.csv").read_text() == "old"


@pytest.mark.parametrize("stage", [staged_folder, staged_entries])
def test_all_is_on_the_disk_before_any_of_it_appears(tmp_path, monkeypatch, stage):
    target = tmp_path / "new" / "video"
    before, after = set(), set()

    def note(file):
        there = target.exists() and any(target.iterdir())
        (after if there else before).add(os.fstat(file).st_ino)

    monkeypatch.setattr(os, "fsync", note)
    options = {"replaceable": None} if stage is staged_folder else {"overwrite": False}
    with stage(target, **options) as folder:
        (folder / "yolo" / "labels").mkdir(parents=True)
        (folder / "yolo" / "labels" / "0.txt").write_text("0")
        (folder / "a.csv").write_text("a")
    made = {path.stat().st_ino for path in target.rglob("*")}
    assert len(made) == 4
    assert made | {tmp_path.stat().st_ino, target.parent.stat().st_ino} <= before
    assert (target.parent if stage is staged_folder else target).stat().st_ino in after


def test_a_file_is_on_the_disk_before_it_appears(tmp_path, monkeypatch):
    path, seen = tmp_path / "new" / "batch.json", []
    monkeypatch.setattr(
        os, "fsync", lambda file: seen.append((os.fstat(file).st_ino, names(path.parent)))
    )
    write_whole(path, "text")
    assert seen == [
        (tmp_path.stat().st_ino, []),
        (path.stat().st_ino, [".batch.json.partial"]),
        (path.parent.stat().st_ino, ["batch.json"]),
    ]


def test_an_interrupted_file_leaves_nothing(tmp_path, monkeypatch):
    def interrupt(file):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "batch.json", "text")
    assert names(tmp_path) == []


def test_what_is_aside_goes_when_a_new_one_is_there(tmp_path):
    """As after a replacement that was killed, where nobody recovers."""
    for name in ("whole", "entries/labels"):
        hidden_beside(tmp_path / name, "old").mkdir(parents=True)
    with staged_folder(tmp_path / "whole", replaceable=None):
        pass
    with staged_entries(tmp_path / "entries", overwrite=True) as folder:
        (folder / "labels").mkdir()
    assert names(tmp_path) == ["entries", "whole"]
    assert names(tmp_path / "entries") == ["labels"]


def test_a_file_in_place_of_a_folder_is_never_replaced(tmp_path):
    (tmp_path / "video").write_text("mine")
    for replaceable, message in ((None, "already there"), (frozenset({"*"}), "a file is there")):
        with (
            pytest.raises(OutputError, match=message),
            staged_folder(tmp_path / "video", replaceable=replaceable),
        ):
            pass
    assert (tmp_path / "video").read_text() == "mine"
    assert names(tmp_path) == ["video"]


def test_nothing_is_refused_unless_something_stands_there(tmp_path):
    (tmp_path / "b").touch()
    (tmp_path / "c").touch()
    places = [tmp_path / name for name in "abc"]
    with pytest.raises(OutputError, match=r"/b and 1 more: this is already there"):
        refuse_existing(places, overwrite=False)
    refuse_existing(places, overwrite=True)
    refuse_existing(places[:1], overwrite=False)
    for overwrite in (False, True):
        with pytest.raises(OutputError, match="File name too long"):
            refuse_existing([tmp_path / ("x" * 256)], overwrite=overwrite)
