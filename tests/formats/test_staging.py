"""Folders and files that appear whole or not at all."""

import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest

from situp_annotate.errors import OutputError
from situp_annotate.formats.staging import (
    discard_staging,
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
