"""What a video's container and codec mean for the tools that have to open it."""

from collections.abc import Iterator
from pathlib import Path

from situp_annotate.inspection.report import Grade, Remark, count
from situp_annotate.inspection.stream import StreamSurvey
from situp_annotate.types import VideoInfo
from situp_annotate.video.probe import Probe

__all__ = ["storage_remarks"]

_BROWSER_CODECS = frozenset({"av1", "h264", "vp8", "vp9"})
_BROWSER_CONTAINERS = frozenset({"matroska", "mov", "mp4", "webm"})
_BROWSER_PIXELS = frozenset({"yuv420p", "yuvj420p"})
_SUFFIXES = {
    **dict.fromkeys((".mp4", ".m4v", ".mov", ".3gp"), "mov"),
    **dict.fromkeys((".mkv", ".webm"), "matroska"),
    **dict.fromkeys((".ts", ".mts", ".m2ts"), "mpegts"),
    **dict.fromkeys((".asf", ".wmv"), "asf"),
    ".avi": "avi",
    ".flv": "flv",
}
_LONG_GROUP = 300
"""Pictures; encoders put a keyframe every 250 at least unless told otherwise."""


def storage_remarks(
    path: Path, probe: Probe, survey: StreamSurvey, info: VideoInfo
) -> Iterator[Remark]:
    """Yield what is odd about how a video is stored."""
    yield from _hidden_pictures(probe, survey)
    if survey.others:
        yield Remark(
            Grade.WARNING,
            "streams",
            f"There are {len(survey.others) + 1} streams of moving pictures. The one of "
            f"{info.width} × {info.height} is read, as OpenCV chooses; the others "
            f"({', '.join(survey.others)}) are not. Another tool may choose another: split the "
            "file into one video each.",
        )
    if survey.reordered:
        yield Remark(
            Grade.NOTE,
            "b_frames",
            "It has B-frames: pictures are stored in another order than they are shown. Frame "
            "numbers are not affected; an MCAP with the picture needs it encoded anew, since "
            "viewers take no B-frames.",
        )
    if survey.longest_group > _LONG_GROUP:
        yield Remark(
            Grade.NOTE,
            "long_group",
            f"Up to {count(survey.longest_group, 'picture')} from keyframe to keyframe: to jump "
            "into the middle, browsers and CVAT decode as many first, and feel slow. ffmpeg -i IN "
            "-g 30 OUT.mp4 makes a copy to click around in.",
        )
    yield from _browsers(probe, survey)
    yield from _suffix(path, survey)


def _hidden_pictures(probe: Probe, survey: StreamSurvey) -> Iterator[Remark]:
    hidden = max(survey.hidden, (probe.frame_count_from_header or 0) - probe.coded_pictures)
    if survey.hidden:
        yield Remark(
            Grade.WARNING,
            "edit_list",
            f"An edit list hides {count(hidden, 'coded picture')}: the file was cut without "
            "encoding. They are not counted here, nor by OpenCV, CVAT and players; the header "
            "counts them, as does a tool that ignores edit lists, or a copy in another container, "
            f"and frame numbers there differ by up to {hidden}. Encode the cut anew to be safe.",
        )
    if survey.before_keyframe:
        yield Remark(
            Grade.WARNING,
            "no_keyframe_at_start",
            f"The first {count(survey.before_keyframe, 'picture')} cannot be decoded: the keyframe "
            "they are built on is not in the file. Frame 0 is the first picture that decodes, and "
            "a tool that counts the others is ahead.",
        )


def _browsers(probe: Probe, survey: StreamSurvey) -> Iterator[Remark]:
    reason = None
    if probe.codec not in _BROWSER_CODECS:
        reason = f"{probe.codec} is a codec that browsers cannot play, or not all of them"
    elif probe.codec == "h264" and probe.pixel_format not in _BROWSER_PIXELS:
        reason = f"browsers cannot play H.264 in {probe.pixel_format}"
    elif _BROWSER_CONTAINERS.isdisjoint(survey.container.split(",")):
        reason = f"browsers cannot play video in {survey.container_title}"
    if reason is not None:
        yield Remark(
            Grade.NOTE,
            "browser",
            f"No video for browsers: {reason}. Label Studio and other tools that leave decoding to "
            "the browser show nothing; CVAT decodes it itself, and the overlay plays everywhere. "
            "For those tools: ffmpeg -i IN -c:v libx264 -pix_fmt yuv420p -fps_mode passthrough "
            "OUT.mp4.",
        )


def _suffix(path: Path, survey: StreamSurvey) -> Iterator[Remark]:
    named = _SUFFIXES.get(path.suffix.lower())
    if named is not None and named not in survey.container.split(","):
        yield Remark(
            Grade.NOTE,
            "suffix",
            f"It is named {path.suffix}, but is {survey.container_title} inside. This tool goes by "
            "the content; others may go by the name and refuse it.",
        )
