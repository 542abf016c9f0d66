"""Write the labels of one video to every file that a recipe asks for."""

from collections.abc import Generator, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from situp_annotate.errors import VideoError
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.formats.review import review_csv
from situp_annotate.outcomes import TrackSummary
from situp_annotate.outputs import REVIEW_FILE, Annotation, open_sinks
from situp_annotate.propagation import Labels, suggest
from situp_annotate.recipe import Recipe
from situp_annotate.report import profile
from situp_annotate.results import MANIFEST_FILE, SUMMARY_FILE, labelled_video
from situp_annotate.stages import FrameProgress, Stopwatch
from situp_annotate.types import Frame, TrackPoint, VideoJob
from situp_annotate.video import ForwardWalk, open_video
from situp_annotate.video.prefetch import reading_ahead

__all__ = ["Written", "write_labels"]


@dataclass(frozen=True, slots=True)
class Written:
    """What was written.

    Attributes
    ----------
    outputs : tuple of str
        Names of the files, the summary that is still to come among them, and of the folders that
        exports are in.
    tracks : tuple of TrackSummary
        What became of each track, by id.
    """

    outputs: tuple[str, ...]
    tracks: tuple[TrackSummary, ...]


def _decoded(
    job: VideoJob, recipe: Recipe, watch: Stopwatch, progress: FrameProgress, threads: int
) -> Generator[Frame]:
    """The frames with their pictures, decoded once more."""
    with watch.stage("open"):
        source = open_video(job.path, incomplete=recipe.decoding.incomplete, limits=recipe.limits)
    with source, reading_ahead(source, threads) as frames:
        for frame in watch.timed("decode", frames):
            yield frame
            progress.step()


def _labelled(
    frames: Iterator[Frame], labels: Labels, path: Path
) -> Iterator[tuple[Frame, tuple[TrackPoint, ...]]]:
    """Frames with their labels."""
    for points in labels:
        frame = next(frames, None)
        if frame is None:
            raise VideoError(
                f"{path}: reading it again gave fewer than the {labels.frame_count} frames that "
                "there were; do not change a video while it is annotated."
            )
        yield frame, points
    next(frames, None)  # so that the source goes over its end, too


def _summaries(labels: Labels, size_hw: tuple[int, int]) -> dict[int, TrackSummary]:
    """What is known of each track before its boxes are counted, by id."""
    return {
        each.track.id: TrackSummary(
            each.track.id,
            each.track.label,
            each.track.attributes,
            profile=profile(each, labels.frame_count),
            review=suggest(each, size_hw),
        )
        for each in labels.tracks
    }


def _write_frames(
    folder: Path,
    annotation: Annotation,
    summaries: dict[int, TrackSummary],
    watch: Stopwatch,
    progress: FrameProgress,
    threads: int,
) -> None:
    """Write what is written frame by frame, and count the boxes of each track."""
    job, walk, labels = annotation.job, annotation.walk, annotation.labels
    with ExitStack() as stack:
        sinks = open_sinks(folder, annotation, stack, threads=threads)
        pictures = any(sink.wants_pictures for sink in sinks.values())
        progress.expect(labels.frame_count if pictures else 0)
        frames = walk.frames()
        if pictures:
            decoded = _decoded(job, annotation.recipe, watch, progress, threads)
            frames = stack.enter_context(closing(decoded))
        for frame, points in _labelled(frames, labels, job.path):
            for name, sink in sinks.items():
                with watch.stage(name):
                    sink.write(frame, points)
            for point in points:
                summary = summaries[point.track_id]
                summaries[point.track_id] = summary.with_point(frame.index, point)
        with watch.stage("finish"):
            stack.close()


def _export(folder: Path, annotation: Annotation) -> None:
    """Write the exports that the recipe asks for, as `situp-annotate export` does later."""
    names, walk = annotation.recipe.outputs.exports, annotation.walk
    if not names:
        return
    video = labelled_video(folder, annotation.job, walk.info, len(walk.times_ns))
    for name in names:
        (folder / name).mkdir()
        EXPORTERS[name]([video], folder / name, annotation.recipe.export)


def write_labels(
    folder: Path,
    job: VideoJob,
    recipe: Recipe,
    labels: Labels,
    walk: ForwardWalk,
    *,
    sha256: str,
    watch: Stopwatch,
    progress: FrameProgress,
    threads: int = 1,
) -> Written:
    """Write all outputs of a video except the summary.

    Parameters
    ----------
    folder : Path
        Where to; empty.
    job, recipe : VideoJob, Recipe
        What was to be done.
    labels : Labels
        What propagation has made of it.
    walk : ForwardWalk
        Through the same video.
    sha256 : str
        Hash of the video.
    watch, progress : Stopwatch, FrameProgress
        Take note.
    threads : int
        With more than one, decoding and encoding overlap with the rest; the files are the same.

    Raises
    ------
    VideoError
        If the video has to be decoded again and that fails.
    OSError
        If the disk refuses.
    """
    with watch.stage("review"):
        summaries = _summaries(labels, (walk.info.height, walk.info.width))
    suggestions = tuple(each for track in summaries.values() for each in track.review)
    annotation = Annotation(job, recipe, labels, suggestions, walk, sha256)
    _write_frames(folder, annotation, summaries, watch, progress, threads)
    names = {track.id: track.label for track in job.tracks}
    texts = {
        REVIEW_FILE: review_csv(suggestions, names, walk.times_ns),
        MANIFEST_FILE: dump_manifest([job], folder),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    with watch.stage("export"):
        _export(folder, annotation)
    written = (SUMMARY_FILE, *(path.name for path in folder.iterdir()))
    return Written(tuple(sorted(written)), tuple(summaries.values()))
