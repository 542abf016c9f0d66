"""``situp-annotate recover``."""

import io

import pytest
from click.testing import CliRunner
from mcap.reader import make_reader
from mcap.writer import Writer

from situp_annotate.cli import cli


@pytest.fixture
def partial(tmp_path):
    """An unfinished log of 20 messages on each of two topics."""
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(library="test")
    for topic in ("/camera/video", "/camera/annotations"):
        channel = writer.register_channel(topic, "json", 0)
        for index in range(20):
            writer.add_message(channel, index * 100_000_000, b"{}", index * 100_000_000)
    writer.flush()
    path = tmp_path / "annotations.mcap.partial"
    path.write_bytes(stream.getvalue())
    return path


def invoke(*arguments):
    return CliRunner().invoke(cli, ["recover", *map(str, arguments)])


def test_says_what_was_rescued(partial):
    outcome = invoke(partial)
    assert outcome.exit_code == 0
    lines = outcome.stdout.splitlines()
    assert [line.split() for line in lines[:3]] == [
        ["topic", "messages"],
        ["/camera/annotations", "20"],
        ["/camera/video", "20"],
    ]
    assert "40 messages from 0.000 s to 1.900 s" in lines[3]
    assert "0 attachments, 0 metadata records" in lines[3]
    assert "it was not finished or is cut off" in lines[3]
    rescued = partial.with_name("annotations.recovered.mcap")
    assert lines[4] == f"They are in {rescued}."
    with rescued.open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count == 40


def test_a_sound_file_is_said_to_be_sound(partial, tmp_path):
    assert invoke(partial, "-o", tmp_path / "a.mcap").exit_code == 0
    outcome = invoke(tmp_path / "a.mcap")
    assert outcome.exit_code == 0
    assert "nothing was wrong with it" in outcome.stdout
    assert (tmp_path / "a.recovered.mcap").exists()


def test_damage_is_told_of(partial, tmp_path):
    assert invoke(partial, "-o", tmp_path / "a.mcap").exit_code == 0
    content = bytearray((tmp_path / "a.mcap").read_bytes())
    content[120] ^= 1
    (tmp_path / "a.mcap").write_bytes(content)
    outcome = invoke(tmp_path / "a.mcap")
    assert outcome.exit_code == 1
    assert "nothing to rescue" in outcome.stderr


def test_nothing_is_overwritten_unasked(partial):
    assert invoke(partial).exit_code == 0
    outcome = invoke(partial)
    assert outcome.exit_code == 5
    assert "replace it with --overwrite" in outcome.stderr
    assert invoke(partial, "--overwrite").exit_code == 0


def test_the_file_to_be_rescued_stays_though_it_is_named_as_one_in_the_making(partial):
    before = partial.read_bytes()
    rescued = partial.with_name("annotations.mcap")
    outcome = invoke(partial, "-o", rescued)
    assert outcome.exit_code == 0, outcome.stderr
    assert partial.read_bytes() == before
    with rescued.open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count == 40
    assert {path.name for path in partial.parent.iterdir()} == {partial.name, rescued.name}


def test_what_is_no_mcap_is_refused(tmp_path):
    path = tmp_path / "clip.mp4"
    path.write_bytes(b"\0\0\0\x18ftypmp42")
    outcome = invoke(path)
    assert outcome.exit_code == 1
    assert "this is no MCAP file" in outcome.stderr
