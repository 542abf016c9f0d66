"""What the disk refuses, said so that somebody can do something about it."""

import errno
import os
import pickle
from contextlib import nullcontext
from pathlib import Path

import pytest

from situp_annotate.errors import DiskError, OutputError
from situp_annotate.formats.disk import is_there, make_folder, remove, sync, sync_tree, writing_to

PLACE = Path("out/clip")


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        (errno.ENOSPC, "free some space"),
        (errno.EDQUOT, "free some space"),
        (errno.EROFS, "make it writable"),
        (errno.EACCES, "make it writable"),
        (errno.EPERM, "make it writable"),
        (errno.ENOTDIR, "choose another place"),
        (errno.EIO, "see that the folder is there"),
        (errno.ESTALE, "see that the folder is there"),
        (errno.ENOTCONN, "see that the folder is there"),
        (errno.ENOENT, "see that the folder is there"),
    ],
)
def test_what_the_disk_refuses_comes_with_advice(code, advice):
    with pytest.raises(DiskError) as caught, writing_to(PLACE):
        raise OSError(code, os.strerror(code), "out/.clip.partial/labels.csv")
    message = str(caught.value)
    assert message.startswith(f"{PLACE}: cannot write here: {os.strerror(code)}; ")
    assert advice in message
    assert "partial" not in message
    assert str(pickle.loads(pickle.dumps(caught.value))) == message


@pytest.mark.parametrize("code", [errno.ENAMETOOLONG, errno.EISDIR, errno.EMFILE, errno.EFBIG])
def test_what_one_file_is_refused_is_not_the_disks(code):
    message = "out/clip: cannot write here: "
    with pytest.raises(OutputError, match=message) as caught, writing_to(PLACE):
        raise OSError(code, os.strerror(code))
    assert not isinstance(caught.value, DiskError)


def test_errors_without_a_number_are_told_too():
    message = r"cannot write here: encoder error -2\."
    with pytest.raises(OutputError, match=message), writing_to(PLACE):
        raise OSError("encoder error -2")


def test_other_errors_pass():
    with pytest.raises(ZeroDivisionError), writing_to(PLACE):
        raise ZeroDivisionError


def test_names_that_cannot_be_shown_are_refused():
    with pytest.raises(OutputError, match=r"'out/\\udcff': this name is not valid UTF-8"):
        is_there(Path("out/\udcff"))


def test_something_is_there_or_not_or_nobody_can_tell(tmp_path):
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "dangling").symlink_to("nowhere")
    for name, expected in {"file": True, ".": True, "none": False, "dangling": False}.items():
        assert is_there(tmp_path / name) is expected
    for name in ("file/in", "loop", "loop/in", "x" * 300):
        with pytest.raises(OutputError, match="cannot write here"):
            is_there(tmp_path / name)


@pytest.fixture
def synced(monkeypatch):
    """Inodes of what was synced."""
    seen = []
    monkeypatch.setattr(os, "fsync", lambda file: seen.append(os.fstat(file).st_ino))
    return seen


def test_all_of_a_tree_is_synced_the_inner_first(tmp_path, synced):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "c.txt").touch()
    (tmp_path / "d.txt").touch()
    sync_tree(tmp_path)
    order = {inode: place for place, inode in enumerate(synced)}
    paths = [tmp_path, *tmp_path.rglob("*")]
    assert {path.stat().st_ino for path in paths} == order.keys()
    for path in paths[1:]:
        assert order[path.stat().st_ino] < order[path.parent.stat().st_ino]


def test_folders_that_are_made_are_there_to_stay(tmp_path, synced):
    make_folder(tmp_path / "a" / "b" / "c")
    make_folder(tmp_path / "a" / "b" / "c")
    assert (tmp_path / "a" / "b" / "c").is_dir()
    above = [tmp_path, tmp_path / "a", tmp_path / "a" / "b"]
    assert synced == [path.stat().st_ino for path in above]


@pytest.mark.parametrize("code", [errno.EINVAL, errno.EBADF, errno.EIO])
@pytest.mark.parametrize("is_folder", [True, False])
def test_only_folders_may_be_such_that_cannot_be_synced(tmp_path, monkeypatch, code, is_folder):
    def refuse(file):
        raise OSError(code, os.strerror(code))

    (tmp_path / "file").touch()
    monkeypatch.setattr(os, "fsync", refuse)
    is_well = is_folder and code != errno.EIO
    with nullcontext() if is_well else pytest.raises(OSError, match=os.strerror(code)):
        sync(tmp_path if is_folder else tmp_path / "file")


def test_files_folders_and_links_are_removed_but_not_what_links_point_to(tmp_path):
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "file").touch()
    (tmp_path / "link").symlink_to("kept")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "link").symlink_to(tmp_path / "kept")
    (tmp_path / "file").touch()
    for name in ("link", "folder", "file", "none"):
        remove(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]
    assert (tmp_path / "kept" / "file").exists()
