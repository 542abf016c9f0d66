"""A contact sheet of each track of a finished run."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from PIL import Image as Pillow

from situp_annotate.finished.replaying import labelled_frames
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.overlay.contact_sheet import ContactSheet

__all__ = ["write_contact_sheets"]


def write_contact_sheets(
    video: LabelledVideo,
    folder: Path,
    *,
    steps: int,
    threads: int = 1,
    on_frame: Callable[[], None] = lambda: None,
) -> None:
    """Write a PNG for each track of a video that has a box: ``track-1.png`` and so on.

    Parameters
    ----------
    video : LabelledVideo
        What a run has found.
    folder : Path
        Where to.
    steps : int
        As of `ContactSheet`.
    threads : int
        With more than one, decodes ahead.
    on_frame : callable
        Called after each frame of the video.

    Raises
    ------
    VideoError
        As `labelled_frames` does.
    OSError
        If the disk refuses.
    """
    sheets = {
        labelled.track.id: ContactSheet(video.id, labelled, steps=steps)
        for labelled in video.tracks
        if labelled.points
    }
    with closing(labelled_frames(video, threads=threads)) as frames:
        for frame, _ in frames:
            for track_id, sheet in [*sheets.items()]:
                if frame.index in sheet.frames:
                    sheet.add(frame)
                    if frame.index == max(sheet.frames):
                        _save(sheets.pop(track_id), folder / f"track-{track_id}.png")
            on_frame()


def _save(sheet: ContactSheet, path: Path) -> None:
    picture = Pillow.fromarray(sheet.image()[..., ::-1])  # Pillow counts red, green, blue
    picture.save(path, optimize=True)
