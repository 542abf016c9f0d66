"""What it means for labels how many pictures a video has, and how many it says it has."""

from collections.abc import Iterator

from situp_annotate.inspection.decoding import Decoded
from situp_annotate.inspection.report import Grade, Remark, count
from situp_annotate.inspection.stream import StreamSurvey
from situp_annotate.inspection.timing import Steps, drift_remark, gap_remark
from situp_annotate.types import NS_PER_S
from situp_annotate.video.probe import Probe

__all__ = ["counting_remarks"]

_COVERED = 0.98


def counting_remarks(
    probe: Probe, survey: StreamSurvey, steps: Steps | None, decoded: Decoded | None
) -> Iterator[Remark]:
    """Yield what is odd about the number of pictures; by the packets if nothing is decoded."""
    if decoded is None:
        expected = list(_expected(probe))
        yield from expected
        if expected:
            return  # what is missing is said
        if steps is not None and steps.regular and steps.gaps:
            yield gap_remark(steps)
    elif decoded.error is not None:
        return  # says what is missing
    frames = probe.coded_pictures if decoded is None else decoded.frames
    promised = probe.frame_count_from_header
    if promised is not None and frames != promised and not survey.hidden:
        yield Remark(
            Grade.WARNING,
            "header_count",
            f"The header promises {count(promised, 'frame')}, there are {frames}. Tools that "
            "believe the header show frames that are not there or stop early; go by what decodes.",
        )
    if steps is not None and steps.regular and steps.drift:
        yield drift_remark(steps)


def _expected(probe: Probe) -> Iterator[Remark]:
    """What would make decoding fail, as far as packets let expect it."""
    change = probe.size_change
    if change is not None:
        height, width = change.size_hw
        yield Remark(
            Grade.PROBLEM,
            "frame_size",
            f"The picture changes its size to {width} × {height} at frame {change.frame}; boxes "
            "would mean something else from there on. Split the video there.",
        )
    if probe.promised_end_ns and probe.end_ns is not None:
        lost_ns = probe.promised_end_ns - probe.end_ns
        if lost_ns > max((1 - _COVERED) * probe.promised_end_ns, 2 * probe.usual_step_ns):
            yield Remark(
                Grade.PROBLEM,
                "incomplete",
                f"The pictures end at {probe.end_ns / NS_PER_S:.2f} s of the "
                f"{probe.promised_end_ns / NS_PER_S:.2f} s that the header promises; copy or "
                'record it anew, or set decoding.incomplete = "keep" to annotate what is there.',
            )
