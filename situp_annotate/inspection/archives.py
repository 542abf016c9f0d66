"""What a zip archive holds."""

import lzma
import zipfile
import zlib
from pathlib import Path

from situp_annotate.inspection.cvat import inspect_cvat
from situp_annotate.inspection.mot_sequence import GT_MEMBER, inspect_mot_zip
from situp_annotate.inspection.report import FileReport, count, problem_report

__all__ = ["inspect_zip"]

_CVAT_MEMBER = "annotations.xml"
_MAX_UNPACKED = 2 * 2**30
_BROKEN = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, OSError)


def inspect_zip(path: Path) -> FileReport:
    """Look at a zip archive; of its members only those that are known are unpacked."""
    try:
        with zipfile.ZipFile(path) as archive:
            return _inspect(path, archive)
    except RuntimeError:
        message = "The archive is locked by a password; unpack it first."
        return problem_report(path, "zip", "a locked zip archive", message)
    except (*_BROKEN, ValueError) as error:
        message = f"The archive is broken, or cut off in copying ({error}); copy or pack it anew."
        return problem_report(path, "zip", "a broken zip archive", message)


def _inspect(path: Path, archive: zipfile.ZipFile) -> FileReport:
    members = [info for info in archive.infolist() if not info.is_dir()]
    for info in sorted(members, key=lambda info: info.filename.count("/")):
        name = info.filename
        if not name.endswith((GT_MEMBER, _CVAT_MEMBER)):
            continue
        if info.file_size > _MAX_UNPACKED:
            message = f"{name[:200]} in it is larger than 2 GiB when unpacked; unpack it first."
            return problem_report(path, "zip", "a zip archive", message)
        if name.endswith(GT_MEMBER):
            return inspect_mot_zip(path, archive, name)
        with archive.open(info) as member:
            report = inspect_cvat(path, member)
        if report is not None:
            return report
    listing = ", ".join(info.filename for info in members[:8])[:400] or "nothing"
    message = (
        f"It holds {count(len(members), 'file')} ({listing}), but neither gt/gt.txt (MOT 1.1 of "
        "CVAT) nor annotations.xml (CVAT for video). If labels are in it, unpack it and inspect "
        "them."
    )
    return problem_report(path, "unknown", "a zip archive", message)
