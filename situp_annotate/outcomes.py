"""What became of a video and its tracks: values that travel from a worker to its parent."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from fractions import Fraction
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from situp_annotate.errors import SitupError
from situp_annotate.propagation import Skip, Suggestion
from situp_annotate.types import Finding, Provenance, State, TrackPoint, VideoInfo, VideoJob

__all__ = ["CacheUse", "TrackSummary", "VideoFailure", "VideoReport", "entry_sha256"]


def entry_sha256(job: VideoJob) -> str:
    """Hash of what a person drew in a video: in hexadecimal, without the video itself."""
    tracks = json.dumps([asdict(track) for track in job.tracks])
    alike = json.loads(tracks, parse_int=float)  # 8 and 8.0 are the same place
    return hashlib.sha256(json.dumps(alike, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class TrackSummary:
    """What became of one track.

    Attributes
    ----------
    id : int
        The track's id.
    label : str
        Its label.
    attributes : dict
        Its attributes, as in the manifest.
    human_boxes, tracked_boxes, interpolated_boxes : int
        Frames labelled by the person, by the tracker, and between or beyond what it found.
    occluded_frames, lost_frames : int
        Frames in which the object is hidden, and in which nobody knows where it is.
    first_frame, last_frame : int or None
        First and last frame with a box; None without any.
    mean_confidence : float or None
        Over the boxes that no person drew, in [0, 1]; None without any.
    profile : str
        Lowest confidence in each of at most 40 equal parts of the video, in tenths from 0 to 9;
        "." where there is no box.
    review : tuple of Suggestion
        Frames in which a box is expected to help most, best first.
    """

    id: int
    label: str
    attributes: dict[str, Any] = field(default_factory=dict)
    human_boxes: int = 0
    tracked_boxes: int = 0
    interpolated_boxes: int = 0
    occluded_frames: int = 0
    lost_frames: int = 0
    first_frame: int | None = None
    last_frame: int | None = None
    mean_confidence: float | None = None
    profile: str = ""
    review: tuple[Suggestion, ...] = ()

    @property
    def propagated_boxes(self) -> int:
        """Boxes that no person drew."""
        return self.tracked_boxes + self.interpolated_boxes

    def with_point(self, frame: int, point: TrackPoint) -> "TrackSummary":
        """The summary after one more box."""
        mean = self.mean_confidence
        if point.provenance is not Provenance.HUMAN:
            mean = mean or 0.0
            mean += (point.confidence - mean) / (self.propagated_boxes + 1)
        return replace(
            self,
            human_boxes=self.human_boxes + (point.provenance is Provenance.HUMAN),
            tracked_boxes=self.tracked_boxes + (point.provenance is Provenance.TRACKED),
            interpolated_boxes=self.interpolated_boxes
            + (point.provenance is Provenance.INTERPOLATED),
            occluded_frames=self.occluded_frames + (point.state is State.OCCLUDED),
            lost_frames=self.lost_frames + (point.state is State.LOST),
            first_frame=frame if self.first_frame is None else self.first_frame,
            last_frame=frame,
            mean_confidence=mean,
        )


@dataclass(frozen=True, slots=True)
class CacheUse:
    """How much of the tracking was done before.

    Attributes
    ----------
    passes : int
        Walks of the tracker from a keyframe that the labels are made from.
    reused : int
        Those of them that an earlier run had made.
    """

    passes: int = 0
    reused: int = 0


@dataclass(frozen=True, slots=True)
class VideoReport:
    """What was done with one video: the content of its ``summary.json``.

    Attributes
    ----------
    id : str
        The job's id; names the output folder.
    video : VideoInfo
        What is known of the video.
    sha256 : str
        Hash of its content.
    entry_sha256 : str
        Hash of what a person drew in it; see :func:`entry_sha256`.
    frames : int
        Decoded and labelled.
    tracks : tuple of TrackSummary
        By track id.
    skipped : tuple of Skip
        Keyframes that could not be used, and why.
    findings : tuple of Finding
        What was noticed about the video while decoding it.
    outputs : tuple of str
        Names of the files written.
    cache : CacheUse
        How much of the tracking was done before.
    seconds : dict of str to float
        Time spent in each stage, and ``total``; empty if that is not known any more.
    """

    id: str
    video: VideoInfo
    sha256: str
    entry_sha256: str
    frames: int
    tracks: tuple[TrackSummary, ...]
    skipped: tuple[Skip, ...]
    findings: tuple[Finding, ...]
    outputs: tuple[str, ...]
    cache: CacheUse = field(default_factory=CacheUse)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def circumstances(self) -> dict[str, Any]:
        """What another run with the same outcome would not have in common with this one."""
        seconds = {stage: round(value, 3) for stage, value in self.seconds.items()}
        return {"cache": asdict(self.cache), "seconds": seconds}

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON data, but for the circumstances."""
        plain = asdict(self)
        del plain["cache"], plain["seconds"]
        plain["video"] |= {
            "path": str(self.video.path),
            "frame_rate": str(self.video.frame_rate),
            "pixel_aspect_ratio": str(self.video.pixel_aspect_ratio),
        }
        return {"status": "ok", **plain}

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> "VideoReport":
        """The report that this plain data was made from; other keys are passed over.

        Raises
        ------
        ValueError
            If it is no such data.
        """
        try:
            numbers = ("frame_rate", "pixel_aspect_ratio")
            video = {**plain["video"], **{name: Fraction(plain["video"][name]) for name in numbers}}
            return _adapter().validate_python({**plain, "video": video})
        except (KeyError, TypeError, ZeroDivisionError) as error:
            raise ValueError(f"this is no report of a video: {error}") from error


@cache
def _adapter() -> TypeAdapter[VideoReport]:
    return TypeAdapter(VideoReport)


@dataclass(frozen=True, slots=True)
class VideoFailure:
    """Why one video has no outputs.

    Attributes
    ----------
    id : str
        The job's id.
    path : str
        The video.
    kind : str
        A short stable word for machines, such as ``"missing"``; see :mod:`situp_annotate.errors`.
    message : str
        A finished sentence for people.
    """

    id: str
    path: str
    kind: str
    message: str

    @classmethod
    def of(cls, job: VideoJob, error: SitupError) -> "VideoFailure":
        """The failure that an error amounts to."""
        return cls(job.id, str(job.path), error.kind, str(error))

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON data."""
        return {"status": "failed", **asdict(self)}
