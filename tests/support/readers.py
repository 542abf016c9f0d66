"""Every reader of text that comes from outside, and what has to hold whatever it is given."""

import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

from situp_annotate.errors import SitupError
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.exporting import EXPORTERS
from situp_annotate.formats.importing import IMPORTERS
from situp_annotate.formats.manifest import dump_manifest, load_manifest
from situp_annotate.inspection import inspect_path
from situp_annotate.inspection.sniff import Kind, sniff
from situp_annotate.recipe import load_recipe
from situp_annotate.results import read_run
from situp_annotate.seeding import read_class_names, recognize
from situp_annotate.types import VideoJob
from support.labelled import import_hints

__all__ = ["READERS", "SEEDS", "Reader", "check", "zipped"]

SEEDS = Path(__file__).parents[1] / "fuzz" / "seeds"
"""Files that are valid."""

_HINTS = import_hints(frame_count=20)
_MOST_CHARACTERS = 200_000
"""Of a message."""

_MOST_FRAMES = 1000
"""To be exported: what is written grows with what the summary says."""

_KINDS = (Kind.TEXT, Kind.JSON, Kind.XML, Kind.ZIP)
"""What is inspected here; the others are pictures and videos."""


@dataclass(frozen=True, slots=True)
class Reader:
    """A way for text to come in.

    Attributes
    ----------
    read : callable
        Reads what stands in a folder; may raise nothing but a SitupError.
    name : str
        Of the file in the folder that is given.
    seeds : tuple of str
        Names of files that it reads; an archive's is that of its member.
    around : mapping of str to str
        What else has to be in the folder, and the seed that it is.
    member : str or None
        Name in the archive, if the file is one.
    """

    read: Callable[[Path], object]
    name: str
    seeds: tuple[str, ...]
    around: Mapping[str, str] = field(default_factory=dict)
    member: str | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """What is valid, not packed."""
        return tuple(_seed(name).decode() for name in self.seeds)

    def packed(self, text: str | bytes) -> bytes:
        """The content of the file that has this text."""
        content = text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass")
        return content if self.member is None else zipped({self.member: content})


@cache
def _seed(name: str) -> bytes:
    return (SEEDS / name).read_bytes()


def zipped(members: Mapping[str, bytes]) -> bytes:
    """A zip archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


# ---- what they do --------------------------------------------------------------------------


def _import(name: str, file: str, folder: Path) -> None:
    """What an import gives, a manifest can hold."""
    path = folder / file
    try:
        recognize(path)
    except SitupError as error:
        _check_message(str(error), folder)
    for seeds in IMPORTERS[name].read(path, _HINTS):
        _check_message(" ".join(seeds.notes))
        job = VideoJob("clip", folder / "clip.mp4", seeds.tracks)
        manifest = folder / "imported.json"
        manifest.write_text(dump_manifest([job], folder), encoding="utf-8")
        try:
            (loaded,) = load_manifest(manifest).jobs
        except SitupError as error:
            raise AssertionError("an import gave what no manifest can hold") from error
        assert loaded.tracks == seeds.tracks


def _export(folder: Path) -> None:
    """What is read of a run can be exported."""
    for video in read_run(folder):
        if video.frame_count <= _MOST_FRAMES:
            for write in EXPORTERS.values():
                with TemporaryDirectory(dir=folder) as exported:
                    write([video], Path(exported), ExportOptions())


def check(reader: Reader, folder: Path, content: bytes) -> None:
    """Give content to a reader: it takes it, or says what is wrong with which file.

    Parameters
    ----------
    reader : Reader
        The reader.
    folder : Path
        Is there; may be given again to the same reader.
    content : bytes
        Of the file.
    """
    path = folder / reader.name
    path.parent.mkdir(parents=True, exist_ok=True)
    for name, seed in reader.around.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        if name != reader.name and not (folder / name).exists():
            (folder / name).write_bytes(_seed(seed))
    path.write_bytes(content)
    try:
        reader.read(folder)
    except SitupError as error:
        _check_message(str(error), folder)
    if sniff(content[:4096]) in _KINDS:
        report = inspect_path(path)
        assert report.title
        for remark in report.remarks:
            assert len(remark.message) < _MOST_CHARACTERS


def _check_message(message: str, folder: Path | None = None) -> None:
    """A message names the file, and can do nothing to a terminal."""
    assert folder is None or str(folder) in message
    assert len(message) < _MOST_CHARACTERS
    assert all(line.isprintable() for line in message.split("\n"))


# ---- who they are --------------------------------------------------------------------------


def _importer(
    name: str,
    file: str,
    *seeds: str,
    member: str | None = None,
    around: Mapping[str, str] | None = None,
    changed: str | None = None,
) -> Reader:
    return Reader(partial(_import, name, file), changed or file, seeds, around or {}, member)


_SEQUENCE = {
    "gt/gt.txt": "mot_truth.txt",
    "gt/labels.txt": "labels.txt",
    "seqinfo.ini": "seqinfo.ini",
}
_RUN = {
    f"{name}": f"run/{name}"
    for name in ("batch.json", "clip/summary.json", "clip/manifest.json", "clip/labels.csv")
}

READERS = {
    "manifest": Reader(
        lambda folder: load_manifest(folder / "manifest.json"), "manifest.json", ("manifest.json",)
    ),
    "recipe": Reader(
        lambda folder: load_recipe(folder / "recipe.toml"), "recipe.toml", ("recipe.toml",)
    ),
    "class-names": Reader(
        lambda folder: read_class_names(folder / "names.txt"), "names.txt", ("labels.txt",)
    ),
    "cvat": _importer("cvat", "annotations.xml", "cvat.xml"),
    "cvat-zip": _importer("cvat", "task.zip", "cvat.xml", member="annotations.xml"),
    "mot": _importer("mot", "clip.txt", "mot_result.txt", "mot_truth.txt", "mot_detections.txt"),
    "mot-zip": _importer("mot", "task.zip", "mot_truth.txt", member="gt/gt.txt"),
    "label-studio": _importer("label-studio", "export.json", "label_studio.json"),
    "coco": _importer("coco", "coco.json", "coco.json", "youtube_vis.json", "bytetrack.json"),
    "otb": _importer("otb", "clip.txt", "otb.txt"),
    **{
        f"sequence-{Path(name).stem}": _importer(
            "mot", "gt/gt.txt", seed, around=_SEQUENCE, changed=name
        )
        for name, seed in _SEQUENCE.items()
    },
    **{
        f"run-{Path(name).stem}": Reader(_export, name, (seed,), _RUN)
        for name, seed in _RUN.items()
    },
}
"""By name."""
