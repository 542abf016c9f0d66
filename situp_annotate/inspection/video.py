"""What a video file is, and what about it may bite."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.inspection.counting import counting_remarks
from situp_annotate.inspection.decoding import Decoded, error_remark, finding_remarks, walk_frames
from situp_annotate.inspection.picture import picture_remarks
from situp_annotate.inspection.progress import OnProgress
from situp_annotate.inspection.report import FileReport, Remark, count
from situp_annotate.inspection.storage import storage_remarks
from situp_annotate.inspection.stream import StreamSurvey, survey_stream
from situp_annotate.inspection.timing import Steps, measure_steps, timing_remarks
from situp_annotate.types import NS_PER_S, Finding, VideoInfo
from situp_annotate.video import open_video
from situp_annotate.video.probe import Probe, probe_video

__all__ = ["inspect_video"]


@dataclass(frozen=True, slots=True)
class _Sight:
    """All that was seen of a video; nothing is decoded if that was to be quick."""

    path: Path
    probe: Probe
    survey: StreamSurvey
    steps: Steps | None
    info: VideoInfo
    opening: tuple[Finding, ...]
    decoded: Decoded | None


def inspect_video(
    path: Path, *, quick: bool = False, on_progress: OnProgress | None = None
) -> FileReport:
    """Look at a video file.

    Parameters
    ----------
    path : Path
        A file.
    quick : bool
        Whether to leave it at headers, packets and the first picture; else all is decoded.
    on_progress : callable, optional
        Is told several times a second how many frames are decoded.

    Raises
    ------
    VideoError
        If the file is no video, or has no frame that decodes.
    """
    probe = probe_video(path.absolute())
    survey = survey_stream(path.absolute())
    with open_video(path) as source:
        sight = _Sight(
            path,
            probe,
            survey,
            measure_steps(probe, survey),
            source.info,
            source.findings,
            None if quick else walk_frames(source, probe.coded_pictures, on_progress),
        )
    frames = probe.coded_pictures if sight.decoded is None else sight.decoded.frames
    size = f"{sight.info.width} × {sight.info.height}"
    title = f"{survey.codec_title} video, {size}, {count(frames, 'frame')}"
    return FileReport(path, "video", title, tuple(_facts(sight)), tuple(_remarks(sight)))


def _remarks(sight: _Sight) -> Iterator[Remark]:
    probe, survey, steps, decoded = sight.probe, sight.survey, sight.steps, sight.decoded
    if decoded is not None and decoded.error is not None:
        yield error_remark(sight.path, decoded.error)
    yield from counting_remarks(probe, survey, steps, decoded)
    yield from finding_remarks(sight.opening if decoded is None else decoded.findings, probe)
    yield from timing_remarks(probe, survey, steps)
    yield from picture_remarks(sight.info, survey.picture)
    yield from storage_remarks(sight.path, probe, survey, sight.info)


def _facts(sight: _Sight) -> Iterator[tuple[str, str]]:
    probe, survey, info, decoded = sight.probe, sight.survey, sight.info, sight.decoded
    yield "container", survey.container_title
    yield "codec", f"{survey.codec_title}, {probe.pixel_format}, decoded by {info.decoder}"
    yield "picture", f"{info.width} × {info.height}{_turn(info)}"
    promised = probe.frame_count_from_header
    header = "none" if promised is None else str(promised)
    counted = "not decoded" if decoded is None else f"{decoded.frames} decoded"
    yield "frames", f"{counted}, {probe.coded_pictures} coded, {header} by the header"
    yield "frame rate", _rate(probe, sight.steps)
    yield "time base", f"{survey.time_base} s, starting at {survey.start_ns / NS_PER_S:.6g} s"
    if probe.end_ns is not None:
        yield "length", f"{probe.end_ns / NS_PER_S:.3f} s"
    yield "keyframes", f"{survey.keyframes}, at most {survey.longest_group} pictures apart"
    reordered = "yes" if survey.reordered else "no"
    yield "B-frames", reordered if probe.timestamps_usable else "cannot be told without times"
    yield "sound", ", ".join(survey.audio) or "none"


def _rate(probe: Probe, steps: Steps | None) -> str:
    rate = f"{float(probe.frame_rate):.6g} frames/s"
    return rate if steps is None else f"{rate}, {steps.evenness}: steps of {steps.spread}"


def _turn(info: VideoInfo) -> str:
    turn = f", turned by {info.rotation_degrees}°" if info.rotation_degrees else ""
    ratio = info.pixel_aspect_ratio
    return turn + (f", pixels {ratio.numerator}:{ratio.denominator}" if ratio != 1 else "")
