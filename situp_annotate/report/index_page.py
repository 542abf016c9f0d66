"""``report.html`` of a batch: every video and its tracks, what needs a look most on top."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from situp_annotate.report.rendering import render
from situp_annotate.report.strips import lowest_profile, profile_path

__all__ = ["FailedRow", "TrackRow", "VideoRow", "index_html"]

_MOST_TRACK_ROWS = 12_000
_PAGE = "report.html"


@dataclass(frozen=True, slots=True)
class TrackRow:
    """What the page says of a track.

    Attributes
    ----------
    id : int
        The track's id in its video.
    label : str
        Name of the object's class.
    first_frame, last_frame : int or None
        First and last frame with a box; None without any.
    boxes, drawn, tracked, occluded, lost : int
        Frames with a box; of these, those where a person drew it or the tracker found it, and
        those where the object is hidden or nobody knows where it is.
    mean_confidence : float or None
        Over the boxes that no person drew; None without any.
    suggestions : int
        Frames worth a look.
    gain : float
        How many frames more are expected to be right with a box at each of them.
    profile : str
        See :func:`situp_annotate.report.strips.profile`.
    """

    id: int
    label: str
    first_frame: int | None
    last_frame: int | None
    boxes: int
    drawn: int
    tracked: int
    occluded: int
    lost: int
    mean_confidence: float | None
    suggestions: int
    gain: float
    profile: str


@dataclass(frozen=True)
class VideoRow:
    """What the page says of a video that was annotated.

    Attributes
    ----------
    id : str
        Names the folder beside the page that holds the files.
    path : str
        The video.
    frames : int
        Decoded and labelled.
    tracks : tuple of TrackRow
        By id.
    notes : tuple of str
        What was noticed about it: finished sentences.
    files : tuple of str
        Names of the files in its folder.
    """

    id: str
    path: str
    frames: int
    tracks: tuple[TrackRow, ...]
    notes: tuple[str, ...]
    files: tuple[str, ...]

    def total(self, name: str) -> Any:  # noqa: ANN401 - int or float, as the attribute is
        """Sum of an attribute of the tracks."""
        return sum(getattr(track, name) for track in self.tracks)

    @property
    def page(self) -> str | None:
        """The video's own page, if there is one."""
        return _PAGE if _PAGE in self.files else None

    @property
    def other_files(self) -> tuple[str, ...]:
        """The files besides its page."""
        return tuple(name for name in self.files if name != _PAGE)

    @cached_property
    def profile(self) -> str:
        """Lowest confidence of any track over time."""
        return lowest_profile([track.profile for track in self.tracks])

    @property
    def curve(self) -> str:
        """The profile as SVG path data."""
        return profile_path(self.profile)

    @property
    def mean_confidence(self) -> float | None:
        """Over all boxes that no person drew; None without any."""
        weighted = [
            (track.mean_confidence, track.boxes - track.drawn)
            for track in self.tracks
            if track.mean_confidence is not None
        ]
        count = sum(weight for _, weight in weighted)
        return sum(mean * weight for mean, weight in weighted) / count if count else None


@dataclass(frozen=True, slots=True)
class FailedRow:
    """What the page says of a video that failed.

    Attributes
    ----------
    id, path : str
        The video.
    kind : str
        A short stable word.
    message : str
        The reason: a finished sentence.
    """

    id: str
    path: str
    kind: str
    message: str


def index_html(
    videos: Sequence[VideoRow], failures: Sequence[FailedRow], *, interrupted: bool = False
) -> str:
    """Text of the page.

    Parameters
    ----------
    videos : sequence of VideoRow
        The videos that were annotated, in any order.
    failures : sequence of FailedRow
        Those that failed.
    interrupted : bool
        Whether there would have been more.

    Notes
    -----
    Rows of videos are HTML. Rows of tracks, which are many and hidden at first, are data that the
    script makes rows from; with more than 12 000 tracks only those of each video that need a look
    most are among them, so that the page stays below 3 MB.
    """
    ordered = sorted(videos, key=lambda video: (-video.total("gain"), video.id))
    per_video = max(_MOST_TRACK_ROWS // max(len(videos), 1), 1)
    return render(
        "index.html",
        {
            "videos": ordered,
            "failures": failures,
            "interrupted": interrupted,
            "totals": {
                "boxes": sum(video.total("boxes") for video in videos),
                "suggestions": sum(video.total("suggestions") for video in videos),
                "to_review": sum(video.total("suggestions") > 0 for video in videos),
            },
            "labels": sorted({track.label for video in videos for track in video.tracks}),
            "data": {"videos": [_data(video, per_video) for video in ordered]},
        },
    )


def _rounded(number: float | None, digits: int) -> float | None:
    return None if number is None else round(number, digits)


def _data(video: VideoRow, most_tracks: int) -> dict[str, Any]:
    """What the script needs to know of a video; columns are named in ``index.js``."""
    tracks = sorted(video.tracks, key=lambda track: (-track.gain, track.id))
    return {
        "id": video.id,
        "labels": sorted({track.label for track in tracks}),
        "values": [
            round(video.total("gain"), 1),
            video.total("suggestions"),
            video.profile,
            _rounded(video.mean_confidence, 3),
            video.frames,
            len(tracks),
            *(video.total(name) for name in ("boxes", "drawn", "tracked", "occluded", "lost")),
            len(video.notes),
        ],
        "tracks": [
            [
                track.id,
                track.label,
                round(track.gain, 1),
                track.suggestions,
                track.profile,
                _rounded(track.mean_confidence, 3),
                [track.first_frame, track.last_frame],
                *(track.boxes, track.drawn, track.tracked, track.occluded, track.lost),
            ]
            for track in tracks[:most_tracks]
        ],
    }
