"""``report.html`` of a video: what to look at, and the place in the overlay to look at it."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from situp_annotate.formats.appearance import track_color
from situp_annotate.formats.overlay.stretches import Excerpt
from situp_annotate.formats.review import ranked
from situp_annotate.propagation import Labels, Suggestion, TrackLabels
from situp_annotate.report.axis import place_of, step_runs, ticks_of
from situp_annotate.report.cards import Card, Shown
from situp_annotate.report.rendering import render
from situp_annotate.report.strips import figures_of, samples_of, strip_of
from situp_annotate.report.thumbnails import THUMBNAIL_SIZE, plan_thumbnails, thumbnail
from situp_annotate.types import NS_PER_S, Frame, State, Track, TrackPoint
from situp_annotate.video import ForwardWalk

__all__ = ["ReportSink"]

_OVERLAY = "overlay.mp4"
_COLUMNS = (60, 1000)
"""Parts of a strip: fewest and most."""
_ALL_COLUMNS = 60_000
"""Of all strips together, as long as none gets too few."""
_ALL_RUNS = 4_000
"""Stretches of states on all strips together, likewise."""
_FEWEST_RUNS = 12
_MOST_TRACKS = 400
_MOST_SUGGESTIONS = 500


def _neediest(
    tracks: Sequence[TrackLabels], suggestions: Sequence[Suggestion]
) -> list[TrackLabels]:
    """The tracks to show, those with the greatest gain first."""
    gains = dict.fromkeys((each.track.id for each in tracks), 0.0)
    for each in suggestions:
        gains[each.track_id] += each.gain
    ordered = sorted(tracks, key=lambda each: (-gains[each.track.id], each.track.id))
    return ordered[:_MOST_TRACKS]


class ReportSink:
    """Writes a video's ``report.html``.

    It decodes nothing by itself: pictures are cut out of the frames as they come, and only small
    ones are kept. A page stays below 3 MB: of more than 400 tracks, those that need a look most
    are shown, and strips are the coarser the more there are. Only an irregular frame rate adds to
    it without end, some six bytes a frame.

    Parameters
    ----------
    path : Path
        File to write.
    video_id : str
        Id of the video's job.
    walk : ForwardWalk
        Through the video: what is known of it.
    labels : Labels
        What propagation has made of it.
    suggestions : sequence of Suggestion
        For all tracks, in any order.
    files : sequence of str
        Names of the other outputs, in the same folder.
    stretches : sequence of range, optional
        Frames that the overlay shows, if not all, as `doubtful_stretches` finds them.
    """

    def __init__(
        self,
        path: Path,
        *,
        video_id: str,
        walk: ForwardWalk,
        labels: Labels,
        suggestions: Sequence[Suggestion],
        files: Sequence[str],
        stretches: Sequence[range] | None = None,
    ) -> None:
        self._path = path
        self._video_id = video_id
        self._walk = walk
        self._labels = labels
        self._files = files
        self._stretches = stretches
        self._suggestion_count = len(suggestions)
        self._tracks = _neediest(labels.tracks, suggestions)
        shown = {each.track.id for each in self._tracks}
        best = [each for each in ranked(suggestions) if each.track_id in shown]
        self._suggestions = best[:_MOST_SUGGESTIONS]
        self._plan = plan_thumbnails(self._tracks, self._suggestions)
        self._planned = sum(map(len, self._plan.values()))
        self._points: dict[tuple[int, int], TrackPoint] = {}
        self._pictures: dict[tuple[int, int], str] = {}
        self._suggested = {(each.track_id, each.frame) for each in self._suggestions}

    @property
    def wants_pictures(self) -> bool:
        """Whether there is anything to show."""
        return bool(self._plan)

    def write(self, frame: Frame, points: Sequence[TrackPoint]) -> None:
        """Keep what the page shows of this frame."""
        wanted = self._plan.get(frame.index, ())
        for point in points:
            key = (point.track_id, frame.index)
            if point.track_id in wanted:
                self._pictures[key] = thumbnail(frame.image, point, of=self._planned)
            if point.track_id in wanted or key in self._suggested:
                self._points[key] = point

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if exc_type is None:
            self._path.write_text(self._html(), encoding="utf-8")

    def _html(self) -> str:
        cards = [self._card(labels) for labels in self._tracks]
        walk, times_ns = self._walk, self._walk.times_ns
        return render(
            "video.html",
            {
                "video_id": self._video_id,
                "info": walk.info,
                "frame_count": self._labels.frame_count,
                "seconds": (times_ns[-1] - times_ns[0]) / NS_PER_S if times_ns else 0.0,
                "track_count": len(self._labels.tracks),
                "cards": cards,
                "states": tuple(State),
                "ticks": ticks_of(times_ns),
                "suggestion_count": self._suggestion_count,
                "suggestions_shown": len(self._suggestions),
                "skipped": self._labels.skipped,
                "findings": walk.findings,
                "files": self._files,
                "overlay": _OVERLAY if _OVERLAY in self._files else None,
                "thumbnail_size": THUMBNAIL_SIZE,
                "data": self._data(cards),
            },
        )

    def _data(self, cards: Sequence[Card]) -> dict[str, Any]:
        """What the script needs to know."""
        return {
            "frames": self._labels.frame_count,
            "times": step_runs(self._walk.times_ns),
            "overlay": self._excerpt_data(),
            "tracks": {
                card.track.id: {
                    "percent": card.strip.percent,
                    "runs": [(run.first, run.last, run.state) for run in card.strip.runs],
                    "keyframes": [frame for frame, _, _ in card.keyframes],
                }
                for card in cards
            },
        }

    def _excerpt_data(self) -> dict[str, Any] | None:
        """Which frames the overlay shows, and when; None where it shows all at their own time."""
        if self._stretches is None:
            return None
        stretches = self._stretches or (range(1),)
        excerpt = Excerpt(stretches, self._walk.info)
        times = (excerpt.time_of(frame) for frame in self._walk.frames())
        return {
            "times": step_runs([time_ns for time_ns in times if time_ns is not None]),
            "stretches": [(each.start, each.stop - 1) for each in stretches],
        }

    def _card(self, labels: TrackLabels) -> Card:
        track, frame_count = labels.track, self._labels.frame_count
        samples = samples_of(labels, frame_count)
        tracks = len(self._tracks)
        fewest, most = _COLUMNS
        strip = strip_of(
            samples,
            columns=min(max(_ALL_COLUMNS // tracks, fewest), most),
            most_runs=max(_ALL_RUNS // tracks, _FEWEST_RUNS),
        )
        suggestions = {
            each.frame: self._shown(each.track_id, each.frame, rank, each)
            for rank, each in enumerate(self._suggestions, start=1)
            if each.track_id == track.id
        }
        steps = (frame for frame, ids in self._plan.items() if track.id in ids)
        return Card(
            track,
            "#{:02x}{:02x}{:02x}".format(*track_color(track.id)),
            figures_of(samples),
            strip,
            self._keyframes(track),
            tuple(suggestions.values()),
            tuple(self._shown(track.id, n) for n in sorted(steps) if n not in suggestions),
        )

    def _keyframes(self, track: Track) -> tuple[tuple[int, float, bool], ...]:
        """Frame and place of each keyframe that was used, and whether the object leaves there."""
        skipped = {(each.track_id, each.frame) for each in self._labels.skipped}
        return tuple(
            (each.frame, place_of(each.frame, self._labels.frame_count), each.box is None)
            for each in track.keyframes
            if (track.id, each.frame) not in skipped
        )

    def _shown(
        self,
        track_id: int,
        frame: int,
        rank: int | None = None,
        suggestion: Suggestion | None = None,
    ) -> Shown:
        return Shown(
            point=self._points[track_id, frame],
            frame=frame,
            seconds=self._walk.times_ns[frame] / NS_PER_S,
            place=place_of(frame, self._labels.frame_count),
            picture=self._pictures.get((track_id, frame)),
            rank=rank,
            suggestion=suggestion,
        )
