"""The files that a recipe asks for, and the sinks that write them."""

from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.labels_csv import LabelsCsvSink
from situp_annotate.formats.manifest import dump_manifest
from situp_annotate.formats.mcap.layout import layout_json
from situp_annotate.formats.mcap.log import ANNOTATIONS_TOPIC, McapSink
from situp_annotate.formats.mcap.pictures import open_pictures
from situp_annotate.formats.mot.rows import MotSink
from situp_annotate.formats.overlay.sink import OverlaySink
from situp_annotate.formats.overlay.stretches import doubtful_stretches
from situp_annotate.formats.sinks import Sink
from situp_annotate.propagation import Labels, Suggestion
from situp_annotate.recipe import Recipe
from situp_annotate.report import ReportSink
from situp_annotate.results import LABELS_FILE, MANIFEST_FILE, REPORT_FILE, SUMMARY_FILE
from situp_annotate.types import VideoJob
from situp_annotate.video import ForwardWalk

__all__ = ["OUTPUTS", "REVIEW_FILE", "Annotation", "open_sinks"]

REVIEW_FILE = "review.csv"
"""In the folder of a video: where one more box is expected to help most."""

_MOT = "mot.csv"
_MCAP = "annotations.mcap"
_LAYOUT = "annotations.layout.json"
_OVERLAY = "overlay.mp4"
_ALWAYS = (LABELS_FILE, MANIFEST_FILE, REVIEW_FILE, SUMMARY_FILE)

OUTPUTS = frozenset({*_ALWAYS, _MOT, _MCAP, _LAYOUT, _OVERLAY, REPORT_FILE, *EXPORTERS})
"""Names of everything that a video's folder may hold."""


@dataclass(frozen=True, slots=True)
class Annotation:
    """A video and all that is known of it when its files are written.

    Attributes
    ----------
    job, recipe : VideoJob, Recipe
        What was to be done.
    labels : Labels
        What propagation has made of it.
    suggestions : tuple of Suggestion
        What is worth a look.
    walk : ForwardWalk
        Through the video.
    sha256 : str
        Hash of the video.
    """

    job: VideoJob
    recipe: Recipe
    labels: Labels
    suggestions: tuple[Suggestion, ...]
    walk: ForwardWalk
    sha256: str

    @property
    def file_names(self) -> list[str]:
        """Names of all files to be written, sorted."""
        outputs = self.recipe.outputs
        chosen = {
            _MOT: outputs.mot,
            _MCAP: outputs.mcap,
            _LAYOUT: outputs.mcap and self.recipe.mcap.pictures != "none",
            _OVERLAY: outputs.overlay,
            REPORT_FILE: outputs.report,
        }
        return sorted([*_ALWAYS, *(name for name, wanted in chosen.items() if wanted)])

    @property
    def doubtful_stretches(self) -> tuple[range, ...] | None:
        """The frames that the overlay shows; None for all."""
        return doubtful_stretches(self.labels, self.job.tracks, self.walk.info, self.recipe.overlay)


def _metadata(annotation: Annotation) -> dict[str, str]:
    """Where a log comes from."""
    job, info = annotation.job, annotation.walk.info
    return {
        "tool": "situp-annotate",
        "version": version("situp-annotate"),
        "source": job.path.name,
        "source_sha256": annotation.sha256,
        "frame_rate": str(info.frame_rate),
        "rotation_degrees": str(info.rotation_degrees),
        "manifest_sha256": job.manifest_sha256 or "",
        "recipe_sha256": annotation.recipe.sha256,
        "mot_pixel_origin": str(annotation.recipe.mot.pixel_origin),
    }


def _mcap_sink(folder: Path, annotation: Annotation) -> McapSink:
    job, recipe, walk = annotation.job, annotation.recipe, annotation.walk
    attachments: dict[str, Path | bytes] = {
        MANIFEST_FILE: dump_manifest([job], job.path.parent).encode()
    }
    if recipe.outputs.mot:
        attachments[_MOT] = folder / _MOT
    pictures = open_pictures(walk.info, walk.times_ns, recipe.mcap)
    if pictures is not None:
        layout = layout_json(pictures.topic, ANNOTATIONS_TOPIC)
        (folder / _LAYOUT).write_text(layout, encoding="utf-8", newline="\n")
    return McapSink(
        folder / _MCAP,
        info=walk.info,
        tracks=job.tracks,
        metadata=_metadata(annotation),
        attachments=attachments,
        pictures=pictures,
    )


def _overlay_sink(folder: Path, annotation: Annotation, threads: int) -> OverlaySink:
    return OverlaySink(
        folder / _OVERLAY,
        info=annotation.walk.info,
        tracks=annotation.job.tracks,
        options=annotation.recipe.overlay,
        stretches=annotation.doubtful_stretches,
        background=threads > 1,
    )


def _mot_sink(folder: Path, annotation: Annotation) -> MotSink:
    options = annotation.recipe.mot
    return MotSink(folder / _MOT, pixel_origin=options.pixel_origin, states=options.states)


def _report_sink(folder: Path, annotation: Annotation) -> ReportSink:
    return ReportSink(
        folder / REPORT_FILE,
        video_id=annotation.job.id,
        walk=annotation.walk,
        labels=annotation.labels,
        suggestions=annotation.suggestions,
        files=[name for name in annotation.file_names if name != REPORT_FILE],
        stretches=annotation.doubtful_stretches,
    )


def open_sinks(
    folder: Path, annotation: Annotation, stack: ExitStack, *, threads: int
) -> dict[str, Sink]:
    """Start every file that is written frame by frame.

    Parameters
    ----------
    folder : Path
        Where to write.
    annotation : Annotation
        What to write, and which files.
    stack : ExitStack
        Finishes the sinks, in reverse: the CSV is complete before the MCAP attaches it.
    threads : int
        With more than one, encoding overlaps with the rest; the files are the same.

    Returns
    -------
    dict of str to Sink
        By the name of the file.
    """
    outputs = annotation.recipe.outputs
    labels_csv = LabelsCsvSink(folder / LABELS_FILE, tracks=annotation.job.tracks)
    sinks: dict[str, Sink] = {LABELS_FILE: stack.enter_context(labels_csv)}
    if outputs.mcap:
        sinks[_MCAP] = stack.enter_context(_mcap_sink(folder, annotation))
    if outputs.overlay:
        sinks[_OVERLAY] = stack.enter_context(_overlay_sink(folder, annotation, threads))
    if outputs.mot:
        sinks[_MOT] = stack.enter_context(_mot_sink(folder, annotation))
    if outputs.report:
        sinks[REPORT_FILE] = stack.enter_context(_report_sink(folder, annotation))
    return sinks
