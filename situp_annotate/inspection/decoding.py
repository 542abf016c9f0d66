"""Decode a video to its end, and put into remarks what comes up on the way."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.errors import VideoError
from situp_annotate.inspection.progress import OnProgress, reporting
from situp_annotate.inspection.report import Grade, Remark
from situp_annotate.types import Finding
from situp_annotate.video import FrameSource
from situp_annotate.video.probe import Probe

__all__ = ["Decoded", "error_remark", "finding_remarks", "walk_frames"]

_MAX_OF_A_KIND = 3


@dataclass(frozen=True, slots=True)
class Decoded:
    """What decoding to the end has shown.

    Attributes
    ----------
    frames : int
        Frames that could be decoded.
    findings : tuple of Finding
        What was noticed on the way.
    error : VideoError or None
        Why the video cannot be annotated; None when it can.
    """

    frames: int
    findings: tuple[Finding, ...]
    error: VideoError | None


def walk_frames(source: FrameSource, total: int | None, on_progress: OnProgress | None) -> Decoded:
    """Decode all frames; what ends them early is kept, not raised."""
    error = None
    with reporting(lambda: source.frames_decoded, total, on_progress):
        try:
            source.skip_through()
        except VideoError as raised:
            error = raised  # what came before still counts
    return Decoded(source.frames_decoded, source.findings, error)


def error_remark(path: Path, error: VideoError) -> Remark:
    """Turn the reason why a video cannot be annotated into a remark."""
    message = str(error).removeprefix(f"{path}: ").removeprefix(f"{path.absolute()}: ")
    return Remark(Grade.PROBLEM, error.kind, message[:1].upper() + message[1:])


def finding_remarks(findings: tuple[Finding, ...], probe: Probe) -> Iterator[Remark]:
    """Turn what was noticed into remarks, the first few of a kind."""
    seen: Counter[str] = Counter()
    for finding in findings:
        if finding.kind == "timestamps" and not probe.timestamps_usable:
            continue  # the remark on the whole stream says it
        seen[finding.kind] += 1
        if seen[finding.kind] <= _MAX_OF_A_KIND:
            yield _of_finding(finding)
    for kind, number in seen.items():
        if number > _MAX_OF_A_KIND:
            yield Remark(
                Grade.WARNING,
                kind,
                f"There are at least {number - _MAX_OF_A_KIND} more of this kind; `situp-annotate "
                "check` lists the first twenty.",
            )


def _of_finding(finding: Finding) -> Remark:
    if finding.kind != "decoder":
        return Remark(Grade.WARNING, finding.kind, finding.message)
    return Remark(
        Grade.NOTE,
        finding.kind,
        f"{finding.message} Labels are not affected, but a script that reads the video with "
        "cv2.VideoCapture gets no frame.",
    )
