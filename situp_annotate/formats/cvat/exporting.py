"""Export to "CVAT for video 1.1": XML with keyframes that CVAT interpolates between.

CVAT keeps only boxes marked as keyframes, so that every box written is one a person may have to
look at: they are as few as the labels allow. The label of every track must be known to the CVAT
task, or it refuses the file; attributes that the label does not have there are passed over.

Boxes are written whole where they reach out of the picture. CVAT takes them so, and cuts one to
the picture only when a person changes it.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, SubElement, indent

from situp_annotate.formats.cvat.attributes import change_frames, changes, text_at
from situp_annotate.formats.export_options import ExportOptions
from situp_annotate.formats.keyframed import keyframes_of
from situp_annotate.formats.labelled import LabelledVideo
from situp_annotate.formats.xml_text import xml_text
from situp_annotate.types import BoundingBox, Keyframe, Track

__all__ = ["write_cvat"]

_DECIMALS = 2
"""To which CVAT writes coordinates."""

_LEAST_SIZE = 10**-_DECIMALS
"""A box never shrinks to nothing in writing: readers refuse those."""


def _add(parent: Element, tag: str, text: object = "") -> Element:
    element = SubElement(parent, tag)
    element.text = xml_text(str(text)) or None
    return element


# ---- what the file says of the video ---------------------------------------------------------


def _add_label(labels: Element, name: str, tracks: Sequence[Track]) -> None:
    """Declare a label, and the attributes that its tracks have."""
    label = _add(labels, "label")
    _add(label, "name", name)
    _add(label, "type", "rectangle")
    attributes = _add(label, "attributes")
    for key in dict.fromkeys(key for track in tracks for key in track.attributes):
        attribute = _add(attributes, "attribute")
        _add(attribute, "name", key)
        _add(attribute, "mutable", any(changes(track.attributes.get(key)) for track in tracks))
        _add(attribute, "input_type", "text")
        _add(attribute, "default_value")
        _add(attribute, "values")


def _add_meta(root: Element, video: LabelledVideo, tracks: Sequence[Track]) -> None:
    task = _add(_add(root, "meta"), "task")
    _add(task, "name", video.id)
    _add(task, "size", video.frame_count)
    _add(task, "mode", "interpolation")
    _add(task, "start_frame", 0)
    _add(task, "stop_frame", max(video.frame_count - 1, 0))
    labels = _add(task, "labels")
    for name in dict.fromkeys(track.label for track in tracks):
        _add_label(labels, name, [track for track in tracks if track.label == name])
    size = _add(task, "original_size")
    _add(size, "width", video.info.width)
    _add(size, "height", video.info.height)
    _add(task, "source", video.info.path.name)


# ---- tracks ----------------------------------------------------------------------------------


def _corners(box: BoundingBox) -> dict[str, str]:
    left, top = round(box.x, _DECIMALS), round(box.y, _DECIMALS)
    edges = {
        "xtl": left,
        "ytl": top,
        "xbr": max(round(box.right, _DECIMALS), left + _LEAST_SIZE),
        "ybr": max(round(box.bottom, _DECIMALS), top + _LEAST_SIZE),
    }
    return {name: f"{edge + 0.0:.{_DECIMALS}f}" for name, edge in edges.items()}  # never -0.00


def _add_track(root: Element, track: Track, keyframes: Sequence[Keyframe]) -> None:
    element = _add(root, "track")
    element.attrib = {
        "id": str(track.id - 1),  # CVAT's count from 0
        "label": xml_text(track.label),
        "source": "semi-auto",
    }
    corners: dict[str, str] = {}
    for keyframe in keyframes:
        if keyframe.box:
            corners = _corners(keyframe.box)
        # An outside box is where the last one was: CVAT moves the boxes before it towards it.
        box = _add(element, "box")
        box.attrib = {
            "frame": str(keyframe.frame),
            "keyframe": "1",
            "outside": str(int(keyframe.box is None)),
            "occluded": str(int(keyframe.occluded)),
            **corners,
            "z_order": "0",
        }
        # CVAT takes what stays the same from the last box.
        for key, value in track.attributes.items():
            attribute = _add(box, "attribute", text_at(value, keyframe.frame))
            attribute.set("name", xml_text(key))


def _annotations(video: LabelledVideo, options: ExportOptions) -> Element:
    keyframes = {
        labelled.track.id: keyframes_of(
            labelled,
            frame_count=video.frame_count,
            iou=options.iou,
            states=options.states,
            decimals=_DECIMALS,
            keep=change_frames(labelled.track.attributes),
        )
        for labelled in video.tracks
    }
    # CVAT breaks on a track without boxes.
    tracks = [labelled.track for labelled in video.tracks if keyframes[labelled.track.id]]
    root = Element("annotations")
    _add(root, "version", "1.1")
    _add_meta(root, video, tracks)
    for track in tracks:
        _add_track(root, track, keyframes[track.id])
    return root


def write_cvat(videos: Iterable[LabelledVideo], folder: Path, options: ExportOptions) -> None:
    """Write ``<id>.xml`` for each video."""
    for video in videos:
        root = _annotations(video, options)
        indent(root)
        with (folder / f"{video.id}.xml").open("wb") as file:
            ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
            file.write(b"\n")
