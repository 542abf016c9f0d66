"""``situp-annotate inspect``: what it prints, for people and for machines, and its exit codes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.media import write_video

from situp_annotate.cli import cli
from situp_annotate.inspection import FileReport, Grade, Remark

FACTS = (("frames", "3"), ("frame rate", "as fast as " + "ever so " * 30 + "possible"))
LONG = "Something is odd, " + "which takes many words to say, " * 5 + "that is all."


def inspect(*arguments):
    return CliRunner().invoke(cli, ["inspect", *map(str, arguments)])


@pytest.fixture
def reports(monkeypatch):
    """What is said of each file name."""
    known = {}
    asked = []

    def inspect_path(path, *, quick, on_progress):
        asked.append((path.name, quick))
        on_progress(1, 2)
        remarks = tuple(Remark(grade, grade.value, LONG) for grade in known[path.name])
        return FileReport(path, "video", "a video", FACTS, remarks)

    monkeypatch.setattr("situp_annotate.inspection.inspect_path", inspect_path)
    known["asked"] = asked
    return known


@pytest.mark.parametrize(
    ("grades", "code"),
    [
        ([], 0),
        ([Grade.FINE], 0),
        ([Grade.NOTE], 0),
        ([Grade.WARNING, Grade.NOTE], 0),
        ([Grade.NOTE, Grade.PROBLEM], 1),
    ],
)
def test_only_a_problem_is_an_error(reports, grades, code):
    reports["a"] = grades
    outcome = inspect("a")
    assert outcome.exit_code == code
    worst = next(grade for grade in reversed(Grade) if grade in [*grades, Grade.FINE])
    assert outcome.stdout.startswith(f"a: a video: {worst.value}\n")
    assert outcome.stderr == ""


def test_lines_are_wrapped_below_their_beginning(reports):
    reports["a"] = [Grade.NOTE]
    lines = inspect("a").stdout.splitlines()
    assert lines[1] == "  frames      3"
    assert all(len(line) <= 100 for line in lines)
    rate = next(place for place, line in enumerate(lines) if line.startswith("  frame rate  as"))
    assert lines[rate + 1].startswith(" " * 14 + "ever")
    note = next(place for place, line in enumerate(lines) if line.startswith("  note:    Some"))
    assert lines[note + 1].startswith(" " * 11)
    assert lines[note + 1][11] != " "


def test_several_files_end_with_a_verdict(reports):
    reports.update(a=[], b=[Grade.PROBLEM], c=[Grade.WARNING], d=[])
    outcome = inspect("a", "b", "c", "d", "--quick")
    assert outcome.stdout.endswith("\n\n4 files: 2 fine, 1 warning, 1 problem.\n")
    assert reports["asked"] == [("a", True), ("b", True), ("c", True), ("d", True)]


def test_for_machines(reports):
    reports.update(a=[Grade.NOTE, Grade.WARNING], b=[Grade.PROBLEM])
    outcome = inspect("--json", "a", "b")
    first, second = json.loads(outcome.stdout)
    assert first == {
        "path": "a",
        "kind": "video",
        "title": "a video",
        "grade": "warning",
        "facts": dict(FACTS),
        "remarks": [
            {"grade": "warning", "kind": "warning", "message": LONG},
            {"grade": "note", "kind": "note", "message": LONG},
        ],
    }
    assert second["grade"] == "problem"
    assert outcome.exit_code == 1


def test_real_files(tmp_path):
    write_video(tmp_path / "a.mp4", count=5)
    (tmp_path / "rows.txt").write_text("0,1,1,1,5,5,1\n")
    outcome = inspect(tmp_path / "a.mp4", tmp_path / "rows.txt", tmp_path / "none")
    assert "H.264 (High) video, 64 × 48, 5 frames: fine" in outcome.stdout
    assert "  problem: Frame 0: 1 row (line 1)." in outcome.stdout
    assert "  problem: Nothing there that can be read" in outcome.stdout
    assert outcome.stdout.endswith("3 files: 1 fine, 2 problem.\n")
    assert outcome.exit_code == 1


def test_names_and_contents_that_are_no_text(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff\n\x1b[31m.txt")
    path.write_text("\x1b[2Jnothing\a")
    for arguments in ((path,), (path, "--json")):
        outcome = inspect(*arguments)
        assert outcome.exit_code == 1
        assert "\x1b" not in outcome.stdout
        assert outcome.exception is None or isinstance(outcome.exception, SystemExit)


def test_no_file_is_wrong_use():
    assert inspect().exit_code == 2


@pytest.mark.skipif(sys.platform != "linux", reason="file names are Unicode elsewhere")
def test_a_name_that_is_not_utf_8(tmp_path):
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/n\xff.mp4"))
    write_video(tmp_path / "video.mp4", count=5).rename(path)
    command = [sys.executable, "-m", "situp_annotate", "inspect", os.fsencode(path)]
    outcome = subprocess.run(command, capture_output=True, check=False)  # it was a segfault
    assert (outcome.returncode, outcome.stderr) == (1, b"")
    assert b"the name is not valid UTF-8" in outcome.stdout
