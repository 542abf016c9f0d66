"""Find out what stands at a path, and have it looked at by whoever knows its kind."""

import stat
from pathlib import Path

from situp_annotate.errors import VideoError
from situp_annotate.inspection.archives import inspect_zip
from situp_annotate.inspection.cvat import inspect_cvat
from situp_annotate.inspection.decoding import error_remark
from situp_annotate.inspection.folder import inspect_folder
from situp_annotate.inspection.json_files import inspect_json
from situp_annotate.inspection.mcap import inspect_mcap
from situp_annotate.inspection.progress import OnProgress, reporting
from situp_annotate.inspection.report import FileReport, problem_report
from situp_annotate.inspection.sniff import HEAD_BYTES, Kind, describe_binary, sniff
from situp_annotate.inspection.text import inspect_text
from situp_annotate.inspection.video import inspect_video

__all__ = ["inspect_path"]


def inspect_path(
    path: Path, *, quick: bool = False, on_progress: OnProgress | None = None
) -> FileReport:
    """Say what a file or folder is, and whether anything about it will bite.

    Whatever stands there, the answer is a report; nothing is raised for a bad file.

    Parameters
    ----------
    path : Path
        A file or folder of any kind.
    quick : bool
        Whether to leave long files at headers, indexes and packets; else they are read and
        decoded to the end.
    on_progress : callable, optional
        Is told several times a second how far a long file is.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        return _unreadable(path, "not there", error)
    try:
        if stat.S_ISDIR(mode):
            return inspect_folder(path, quick=quick, on_progress=on_progress)
        if stat.S_ISREG(mode):
            return _inspect_file(path, quick=quick, on_progress=on_progress)
    except OSError as error:
        return _unreadable(path, "not readable", error)
    message = "This is a pipe, a socket or a device; name a file or a folder."
    return problem_report(path, "special", "no file", message)


def _unreadable(path: Path, title: str, error: OSError | ValueError) -> FileReport:
    reason = getattr(error, "strerror", None) or error
    message = f"Nothing there that can be read ({reason}); correct the path or its permissions."
    return problem_report(path, "missing", title, message, remark_kind="missing")


def _inspect_file(path: Path, *, quick: bool, on_progress: OnProgress | None) -> FileReport:
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    match sniff(head):
        case Kind.EMPTY:
            message = "The file has 0 bytes; copying or recording it has failed. Get it again."
            return problem_report(path, "empty", "an empty file", message, remark_kind="empty")
        case Kind.MCAP:
            return inspect_mcap(path, quick=quick, on_progress=on_progress)
        case Kind.ZIP:
            return inspect_zip(path)
        case Kind.PICTURE:
            return _inspect_picture(path, head, quick=quick, on_progress=on_progress)
        case Kind.JSON:
            return inspect_json(path)
        case Kind.XML:
            return _inspect_xml(path, on_progress)
        case Kind.UTF16:
            message = (
                "Text in UTF-16, as PowerShell's > writes it; no tool reads labels in that. Save "
                "it as UTF-8."
            )
            return problem_report(path, "unknown", "UTF-16 text", message, remark_kind="utf_16")
        case Kind.TEXT:
            return inspect_text(path, on_progress=on_progress)
        case Kind.BINARY:
            return _inspect_binary(path, head, quick=quick, on_progress=on_progress)


def _inspect_picture(
    path: Path, head: bytes, *, quick: bool, on_progress: OnProgress | None
) -> FileReport:
    report = _inspect_binary(path, head, quick=quick, on_progress=on_progress)
    if report.kind == "video":  # raw Motion JPEG and animated PNG begin as a single picture does
        return report
    message = "A single picture is no video; name the folder that holds the pictures."
    return problem_report(path, "picture", "a single picture", message)


def _inspect_xml(path: Path, on_progress: OnProgress | None) -> FileReport:
    with path.open("rb") as file, reporting(file.tell, path.stat().st_size, on_progress):
        report = inspect_cvat(path, file)
    if report is not None:
        return report
    message = "XML, but not CVAT's: export as “CVAT for video 1.1”."
    return problem_report(path, "unknown", "XML of an unknown kind", message)


def _inspect_binary(
    path: Path, head: bytes, *, quick: bool, on_progress: OnProgress | None
) -> FileReport:
    try:
        return inspect_video(path, quick=quick, on_progress=on_progress)
    except VideoError as error:
        remark = error_remark(path, error)
        return FileReport(path, "unknown", describe_binary(head), (), (remark,))
    # Damage makes FFmpeg's binding raise more than errors of its own.
    except Exception as error:  # noqa: BLE001
        message = (
            "The file is damaged, or made in an unusual way: FFmpeg's binding stumbles over it "
            f"({type(error).__name__}: {error}). Convert it anew: ffmpeg -i IN OUT.mp4."
        )
        return problem_report(path, "video", describe_binary(head), message, remark_kind="damaged")
