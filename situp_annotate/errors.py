"""Every error that situp-annotate raises on purpose, and the exit code of each.

::

    SitupError                    1
    ├── ManifestError             3   the manifest is not valid
    ├── RecipeError               4   the recipe or a --set value is not valid
    ├── OutputError               5   the output folder cannot be written or is already there
    │   └── DiskError                 the disk refuses, whatever is written there
    ├── BoxError                  1   four numbers that are no box
    ├── TrackingError             1   the tracker was given what it cannot track
    └── VideoError                1   one video cannot be annotated
        ├── VideoMissingError         nothing stands at the path
        ├── VideoFormatError          something stands there, but no video
        ├── VideoEmptyError           a video that yields no frame
        ├── VideoIncompleteError      frames are missing at the end
        ├── VideoTooLargeError        more or larger pictures than the limits allow
        ├── FrameSizeError            the picture changes its size midway
        └── WorkerError               the process that annotated the video died
            ├── WorkerKilledError         it was killed from outside, as for want of memory
            ├── WorkerLostError           the machine that it ran on is gone
            ├── VideoTimeoutError         it took longer than it was given
            └── VideoStalledError         it came to no further frame for too long

Each error is made of one finished sentence (or, for manifests, of several lines, one a
problem): file, place, value, what is allowed, what to do. The message is the only argument, so
every error can be pickled and cross from a worker to its parent.

Exit codes: 0 all videos annotated, 1 at least one failed, 2 wrong use of the command line
(click's), 3 to 5 as above, 130 interrupted.
"""

from typing import ClassVar

__all__ = [
    "EXIT_FAILED",
    "EXIT_INTERRUPTED",
    "EXIT_OK",
    "BoxError",
    "DiskError",
    "FrameSizeError",
    "ManifestError",
    "OutputError",
    "RecipeError",
    "SitupError",
    "TrackingError",
    "VideoEmptyError",
    "VideoError",
    "VideoFormatError",
    "VideoIncompleteError",
    "VideoMissingError",
    "VideoStalledError",
    "VideoTimeoutError",
    "VideoTooLargeError",
    "WorkerError",
    "WorkerKilledError",
    "WorkerLostError",
]

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_INTERRUPTED = 130


def _shown(character: str) -> str:
    plain = character.isprintable() or character == "\n"
    return character if plain else ascii(character)[1:-1]


class SitupError(Exception):
    """Root of the tree; catch it to catch everything raised on purpose.

    Parameters
    ----------
    message : str
        A finished sentence for the user. What cannot be printed, as names of files and of objects
        may hold, is escaped: it could write anything over a terminal.

    Attributes
    ----------
    exit_code : int
        What the command line exits with when this error ends it.
    kind : str
        A short stable word for machines, written as ``failure.kind`` in ``summary.json``.
    """

    exit_code: ClassVar[int] = EXIT_FAILED
    kind: ClassVar[str] = "error"

    def __init__(self, message: str) -> None:
        super().__init__("".join(map(_shown, message)))


class ManifestError(SitupError):
    """The manifest is not valid; the message lists every problem, one a line."""

    exit_code = 3
    kind = "manifest"


class RecipeError(SitupError):
    """A recipe, or a value set on the command line, is not valid."""

    exit_code = 4
    kind = "recipe"


class OutputError(SitupError):
    """The output cannot be written, or something stands where it should go."""

    exit_code = 5
    kind = "output"


class DiskError(OutputError):
    """The disk is full, gone or may not be written: what comes next would fail like this."""

    kind = "disk"


class BoxError(SitupError):
    """Four numbers that are no box: not finite, or without area."""

    kind = "box"


class TrackingError(SitupError):
    """The tracker was given what it cannot track: no picture, no box, or the wrong order."""

    kind = "tracking"


class VideoError(SitupError):
    """One video cannot be annotated."""

    kind = "video"


class VideoMissingError(VideoError):
    """Nothing stands at the path of the video, or it cannot be read."""

    kind = "missing"


class VideoFormatError(VideoError):
    """Something stands at the path, but it is no video and no folder of pictures."""

    kind = "not_a_video"


class VideoEmptyError(VideoError):
    """The video opens, but no decoder gets a single frame out of it."""

    kind = "no_frames"


class VideoIncompleteError(VideoError):
    """The video ends before its header says it should."""

    kind = "incomplete"


class VideoTooLargeError(VideoError):
    """The video has more or larger pictures than the limits allow."""

    kind = "too_large"


class FrameSizeError(VideoError):
    """The picture changes its width or height midway."""

    kind = "frame_size"


class WorkerError(VideoError):
    """The process that annotated the video died by itself: a crash in a decoder."""

    kind = "crashed"


class WorkerKilledError(WorkerError):
    """The process that annotated the video was killed from outside, as for want of memory."""

    kind = "killed"


class WorkerLostError(WorkerError):
    """What the process did is not known any more: the machine that it ran on is gone."""

    kind = "lost"


class VideoTimeoutError(WorkerError):
    """The video took longer than it was given, and its process was stopped."""

    kind = "timed_out"


class VideoStalledError(WorkerError):
    """The work on the video came to no further frame for too long, and was stopped."""

    kind = "stalled"
