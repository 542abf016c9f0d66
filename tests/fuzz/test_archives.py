"""Archives that lie about what is in them, and files that are none."""

import os
import struct
import warnings
import zipfile

import pytest
from support.labelled import import_hints
from support.readers import READERS, zipped

from situp_annotate.errors import SitupError
from situp_annotate.formats import zipped as zipped_module
from situp_annotate.formats.importing import IMPORTERS
from situp_annotate.inspection import Grade, inspect_path

HINTS = import_hints(frame_count=20)
MEMBERS = {"cvat": "annotations.xml", "mot": "gt/gt.txt"}
TEXTS = {"cvat": READERS["cvat"].texts[0], "mot": READERS["mot-zip"].texts[0]}


@pytest.fixture(params=MEMBERS)
def name(request):
    return request.param


def archive_of(name, text=None, **others):
    content = (TEXTS[name] if text is None else text).encode()
    return zipped({MEMBERS[name]: content, **others})


def write(folder, content):
    path = folder / "task.zip"
    path.write_bytes(content)
    return path


def refuse(path, name, match):
    """The import and the inspection say so; they are not asked whether they recognize it."""
    with pytest.raises(SitupError, match=rf"task\.zip.*{match}"):
        IMPORTERS[name].read(path, HINTS)
    report = inspect_path(path)
    assert report.grade is Grade.PROBLEM


def patched(archive, offset, layout, value):
    """Change a field of the first member in the list of files."""
    content = bytearray(archive)
    struct.pack_into(layout, content, content.index(b"PK\1\2") + offset, value)
    return bytes(content)


FLAGS, METHOD, CRC, SIZE = (8, "<H"), (10, "<H"), (16, "<I"), (24, "<I")


def test_a_member_that_is_said_to_be_huge_is_not_unpacked(tmp_path, name):
    path = write(tmp_path, patched(archive_of(name), *SIZE, 2**32 - 2))
    refuse(path, name, "this has 4096 MiB, more than the 256")


def test_a_member_is_never_read_past_its_size(tmp_path, name, monkeypatch):
    monkeypatch.setattr(zipped_module, "MAX_LABEL_BYTES", 2**20)
    bomb = archive_of(name, TEXTS[name] + "\n" * 2**21)
    refuse(write(tmp_path, bomb), name, "this has 2 MiB, more than the 1")
    refuse(write(tmp_path, patched(bomb, *SIZE, 2**20)), name, "this archive is broken")


def test_what_lies_beside_the_member_is_held_to_the_same_size(tmp_path, monkeypatch):
    monkeypatch.setattr(zipped_module, "MAX_LABEL_BYTES", 2**20)
    content = archive_of("mot", **{"gt/labels.txt": b"car\n" * 2**20})
    with pytest.raises(SitupError, match=r"gt/labels\.txt: this has 4 MiB"):
        IMPORTERS["mot"].read(write(tmp_path, content), HINTS)


@pytest.mark.parametrize(
    ("field", "value", "match"),
    [
        (CRC, 1, "broken"),
        (FLAGS, 1, "locked by a password"),
        (METHOD, zipfile.ZIP_LZMA, "packed in a way that is not read"),
        (METHOD, zipfile.ZIP_BZIP2, "packed in a way that is not read"),
        (METHOD, 99, "packed in a way that is not read"),
    ],
)
def test_a_member_that_cannot_be_unpacked_is_refused(tmp_path, name, field, value, match):
    refuse(write(tmp_path, patched(archive_of(name), *field, value)), name, match)


def test_nothing_is_put_on_the_disk(tmp_path, name):
    content = archive_of(
        name, **{"../up": b"x", "/etc/absolute": b"x", "C:\\drive": b"x", "folder/": b""}
    )
    (tmp_path / "inner").mkdir()
    path = write(tmp_path / "inner", content)
    assert IMPORTERS[name].read(path, HINTS)
    inspect_path(path)
    assert [each.name for each in tmp_path.rglob("*")] == ["inner", "task.zip"]


def test_what_stands_around_a_member_is_taken_from_the_archive_only(tmp_path):
    (tmp_path / "seqinfo.ini").write_text("nothing of use")
    (tmp_path / "labels.txt").write_text("nothing")
    path = write(tmp_path, archive_of("mot"))
    labels = {track.label for track in IMPORTERS["mot"].read(path, HINTS)[0].tracks}
    assert labels == {"pedestrian", "car"}


def test_of_two_members_of_a_name_the_last_counts(tmp_path, name):
    path = tmp_path / "task.zip"
    with zipfile.ZipFile(path, "w") as archive, warnings.catch_warnings(action="ignore"):
        archive.writestr(MEMBERS[name], "nonsense")
        archive.writestr(MEMBERS[name], TEXTS[name])
    assert IMPORTERS[name].read(path, HINTS)


def test_a_folder_in_the_place_of_the_member_is_refused(tmp_path, name):
    refuse(write(tmp_path, zipped({f"{MEMBERS[name]}/": b""})), name, "there is no")


def test_names_with_many_slashes_cost_nothing(tmp_path, name):
    """``zipfile.Path`` makes a folder of each, some gigabytes of names."""
    slashes = {f"{number}/" + "a/" * 30_000: b"" for number in range(50)}
    assert IMPORTERS[name].read(write(tmp_path, archive_of(name, **slashes)), HINTS)


@pytest.mark.parametrize(
    "content",
    [
        b"PK\3\4",
        b"PK\5\6" + bytes(18),
        b"PK\5\6" + b"\xff" * 18,
        patched(zipped({"caf\xe9": b""}), 46, "<B", 0xFF),
        patched(zipped({"x": b""}), 28, "<H", 0),
        patched(zipped({"x": b""}), 42, "<I", 2**32 - 1),
        zipped({"x": b""})[:-1],
        zipped({}),
    ],
    ids=["cut", "empty", "ends", "not UTF-8", "no name", "offset", "shortened", "no members"],
)
def test_damaged_lists_of_files_are_refused(tmp_path, name, content):
    path = write(tmp_path, content)
    assert not IMPORTERS[name].recognizes(path, content[:100])
    refuse(path, name, "")


def test_a_name_that_is_no_text_where_the_member_begins_is_refused(tmp_path, name):
    """Found by Atheris: the list of files is sound, the member's own header is not."""
    header = bytearray(archive_of(name))
    header[30] = 0xFF  # the first letter of its name
    header[7] |= 8  # which is UTF-8
    flagged = patched(bytes(header), *FLAGS, 0x800)
    refuse(write(tmp_path, flagged), name, "this archive is broken")


@pytest.mark.parametrize("name", IMPORTERS)
def test_what_is_no_file_is_refused_at_once(tmp_path, name):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(SitupError, match="pipe: this is a pipe, a socket or a device"):
        IMPORTERS[name].read(pipe, HINTS)
    with pytest.raises(SitupError, match="Is a directory"):
        IMPORTERS[name].read(tmp_path, HINTS)


@pytest.mark.parametrize("name", IMPORTERS)
def test_a_file_that_is_too_large_is_refused(tmp_path, name, monkeypatch):
    monkeypatch.setattr(zipped_module, "MAX_LABEL_BYTES", 2**20)
    path = tmp_path / "large"
    path.write_bytes(bytes(3 * 2**20))
    with pytest.raises(SitupError, match="large: this has 3 MiB, more than the 1"):
        IMPORTERS[name].read(path, HINTS)
