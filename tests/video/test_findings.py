"""Findings are kept up to a limit, then counted."""

from situp_annotate.types import Finding
from situp_annotate.video.findings import FindingLog


def test_beyond_twenty_of_a_kind_they_are_counted() -> None:
    log = FindingLog()
    for frame in range(25):
        log.add(Finding("gap", f"Gap {frame}.", frame))
    log.add(Finding("undecoded", "One.", None))
    assert [found.frame for found in log.all[:20]] == list(range(20))
    assert log.all[20].kind == "undecoded"
    assert log.all[21] == Finding("gap", "And 5 more findings of the kind 'gap'.")
    assert len(log.all) == 22


def test_fresh_ones_are_taken_once() -> None:
    log = FindingLog()
    log.add(Finding("gap", "One."))
    assert log.take_fresh() == (Finding("gap", "One."),)
    assert log.take_fresh() == ()
    assert log.all == (Finding("gap", "One."),)
