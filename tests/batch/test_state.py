"""Two runs into one folder, torn journals, and what shards may do at a time."""

import json
from contextlib import ExitStack

import pytest

from situp_annotate.batch.journal import Journal, last_endings, read_events
from situp_annotate.batch.state import RunState, Shard
from situp_annotate.batch.status import read_status
from situp_annotate.errors import OutputError, SitupError
from situp_annotate.progress import BatchProgress, RunningVideo

WHOLE, FIRST, SECOND, OTHER = None, Shard(1, 2), Shard(2, 2), Shard(1, 3)


@pytest.mark.parametrize(
    ("holder", "comer", "allowed"),
    [
        (WHOLE, WHOLE, False),
        (WHOLE, FIRST, False),
        (FIRST, WHOLE, False),
        (FIRST, FIRST, False),
        (FIRST, OTHER, False),
        (FIRST, SECOND, True),
    ],
)
def test_a_second_run_says_so_and_stops(tmp_path, holder, comer, allowed):
    with RunState(tmp_path, holder).locked(), ExitStack() as stack:
        if not allowed:
            stack.enter_context(pytest.raises(OutputError, match="another run is at work here"))
        with RunState(tmp_path, comer).locked():
            pass
    with RunState(tmp_path, comer).locked():  # once the other is gone
        pass


def test_the_second_run_names_the_first(tmp_path):
    state = RunState(tmp_path)
    with state.locked():
        state.save_progress(BatchProgress(0, 1, 0, 0, 0))
        with pytest.raises(OutputError, match=rf"process {state.owner['pid']} on "):
            state.locked().__enter__()


def test_a_journal_survives_what_a_kill_leaves_of_it(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path) as journal:
        journal.note("batch", videos=3)
        journal.note("done", video="a", frames=3)
        journal.note("failed", video="b", kind="missing")
        journal.note("done", video="b", frames=4)
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        kept = last_endings([path])
        assert kept.keys() <= {"a", "b"}
        with Journal(path) as journal:
            assert journal.last == kept
            journal.note("done", video="c", frames=1)
        assert last_endings([path]).keys() == {*kept, "c"}


@pytest.mark.parametrize("line", [b"\xff\xfe", b"[]", b"3", b'{"event": 3}', b'{"event": "done"}'])
def test_lines_that_are_no_events_do_no_harm(tmp_path, line):
    path = tmp_path / "journal.jsonl"
    path.write_bytes(line + b'\n{"event": "done", "video": "a"}\n')
    assert [*last_endings([path])] == ["a"]
    assert [*read_events(tmp_path / "none")] == []


def test_who_listens_hears_more_than_the_journal_keeps(tmp_path):
    heard = []
    with Journal(tmp_path / "journal", listener=heard.append) as journal:
        journal.note("started", video="a")
        journal.mention("progress", videos_done=0)
    assert [event["event"] for event in heard] == ["started", "progress"]
    assert [event["event"] for event in read_events(tmp_path / "journal")] == ["started"]


def begin(state, videos=3, to_do=2):
    journal = state.open_journal(None)
    journal.note("batch", videos=videos, to_do=to_do, workers=2, **state.owner)
    return journal


def test_status_of_a_run_that_goes_on(tmp_path):
    state = RunState(tmp_path)
    with state.locked(), begin(state) as journal:
        journal.note("failed", video="a", path="a.mp4", kind="crashed", message="!", retry=True)
        journal.note("failed", video="b", path="b.mp4", kind="missing", message="?", retry=False)
        running = RunningVideo("a", 30, 100, 1.5)
        state.save_progress(BatchProgress(2, 3, 1, 30, 120, (running,)))
        (status,) = read_status(tmp_path)
    assert (status.state, status.videos, status.done, status.failed) == ("running", 3, 2, 1)
    assert status.running == (running,)
    assert status.seconds_left >= 0
    assert [failure.id for failure in status.failures] == ["b"]


@pytest.mark.parametrize(
    ("last", "state"),
    [
        (None, "killed"),
        ({"interrupted": True}, "interrupted"),
        ({"interrupted": False}, "complete"),
    ],
)
def test_status_of_a_run_that_is_over(tmp_path, last, state):
    run = RunState(tmp_path)
    with run.locked(), begin(run, 1, 1) as journal:
        journal.note("done", video="a", frames=3)
        run.save_progress(BatchProgress(1, 1, 0, 3, 3, (RunningVideo("a", 3, 3, 1.0),)))
        if last is not None:
            journal.note("ended", **last)
    (status,) = read_status(tmp_path)
    assert (status.state, status.done, status.running) == (state, 1, ())


def test_status_of_shards_leaves_out_the_run_before_them(tmp_path):
    for shard in (None, SECOND, FIRST):
        with begin(RunState(make(tmp_path), shard)):
            pass
    assert [status.shard for status in read_status(tmp_path)] == [FIRST, SECOND]


def make(folder):
    (folder / ".run").mkdir(exist_ok=True)
    return folder


def test_where_nothing_ran_there_is_no_status(tmp_path):
    with pytest.raises(SitupError, match="no run has begun here"):
        read_status(tmp_path)


def test_progress_is_plain_json(tmp_path):
    state = RunState(make(tmp_path))
    state.save_progress(BatchProgress(1, 2, 0, 3, 4, (RunningVideo("ä", 1, 2, 3.0),)))
    assert json.loads(state.progress.read_text(encoding="utf-8"))["running"][0]["id"] == "ä"
