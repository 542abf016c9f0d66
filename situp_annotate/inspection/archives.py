"""What a zip archive holds."""

import zipfile
import zlib
from pathlib import Path

from situp_annotate.errors import SitupError
from situp_annotate.formats.zipped import Member, open_archive, open_readable
from situp_annotate.inspection.cvat import inspect_cvat
from situp_annotate.inspection.mot_sequence import GT_MEMBER, inspect_mot_zip
from situp_annotate.inspection.report import FileReport, count, problem_report

__all__ = ["inspect_zip"]

_CVAT_MEMBER = "annotations.xml"
_UNREADABLE = "a zip archive, not readable"
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError)


def inspect_zip(path: Path) -> FileReport:
    """Look at a zip archive; of its members only those that are known are unpacked."""
    try:
        with open_archive(path) as archive:
            return _inspect(path, archive)
    except SitupError as error:
        message = str(error).removeprefix(f"{path}: ")
        return problem_report(path, "zip", _UNREADABLE, message)
    except _BROKEN as error:
        message = f"The archive is broken, or cut off in copying ({error}); copy or pack it anew."
        return problem_report(path, "zip", _UNREADABLE, message)


def _inspect(path: Path, archive: zipfile.ZipFile) -> FileReport:
    names = [name for name in archive.namelist() if not name.endswith("/")]
    for name in sorted(names, key=lambda name: name.count("/")):
        if name.endswith(GT_MEMBER):
            return inspect_mot_zip(path, archive, name)
        if name.endswith(_CVAT_MEMBER):
            with open_readable(Member(archive, path, name)) as member:
                report = inspect_cvat(path, member)
            if report is not None:
                return report
    listing = ", ".join(names[:8])[:400] or "nothing"
    message = (
        f"It holds {count(len(names), 'file')} ({listing}), but neither gt/gt.txt (MOT 1.1 of "
        "CVAT) nor annotations.xml (CVAT for video). If labels are in it, unpack it and inspect "
        "them."
    )
    return problem_report(path, "unknown", "a zip archive", message)
