"""The review report of a batch, made from what became of its videos."""

from collections.abc import Sequence

from situp_annotate.outcomes import TrackSummary, VideoFailure, VideoReport
from situp_annotate.report import FailedRow, TrackRow, VideoRow, index_html

__all__ = ["overview_html"]


def _track_row(track: TrackSummary) -> TrackRow:
    return TrackRow(
        id=track.id,
        label=track.label,
        first_frame=track.first_frame,
        last_frame=track.last_frame,
        boxes=track.human_boxes + track.propagated_boxes,
        drawn=track.human_boxes,
        tracked=track.tracked_boxes,
        occluded=track.occluded_frames,
        lost=track.lost_frames,
        mean_confidence=track.mean_confidence,
        suggestions=len(track.review),
        gain=sum(each.gain for each in track.review),
        profile=track.profile,
    )


def _video_row(report: VideoReport) -> VideoRow:
    skipped = (each.reason for each in report.skipped)
    found = (each.message for each in report.findings)
    return VideoRow(
        id=report.id,
        path=str(report.video.path),
        frames=report.frames,
        tracks=tuple(map(_track_row, report.tracks)),
        notes=(*skipped, *found),
        files=report.outputs,
    )


def overview_html(
    outcomes: Sequence[VideoReport | VideoFailure], *, interrupted: bool = False
) -> str:
    """Text of ``report.html`` in the output folder.

    Parameters
    ----------
    outcomes : sequence of VideoReport or VideoFailure
        What became of the videos.
    interrupted : bool
        Whether there would have been more of them.
    """
    return index_html(
        [_video_row(each) for each in outcomes if isinstance(each, VideoReport)],
        [
            FailedRow(each.id, each.path, each.kind, each.message)
            for each in outcomes
            if isinstance(each, VideoFailure)
        ],
        interrupted=interrupted,
    )
