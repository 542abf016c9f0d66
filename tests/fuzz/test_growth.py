"""Large files take time in proportion to their size.

Nothing is timed here: that a test comes to its end is what it tells. When time grew with the square
of the size, it was up to some minutes for one of these.
"""

import json

import pytest
from support.labelled import import_hints
from support.readers import zipped

from situp_annotate.errors import ManifestError, SitupError
from situp_annotate.formats.coco.importing import read_coco
from situp_annotate.formats.cvat.importing import read_cvat
from situp_annotate.formats.manifest import load_manifest
from situp_annotate.formats.mot.importing import read_mot_seeds
from situp_annotate.inspection import inspect_path

BOX = '<box frame="{}" keyframe="{}" xtl="1" ytl="2" xbr="3" ybr="4"/>'
KEYS = ", ".join(f'"key {number}": 0' for number in range(50_000))
COUNT = 15_000


def write(folder, text, name="file"):
    path = folder / name
    path.write_text(text)
    return path


def manifest_with_attributes(text):
    video = {"path": "a", "tracks": [{"id": 1, "label": "a", "frame": 0, "box": [1, 2, 3, 4]}]}
    video["tracks"][0]["attributes"] = "here"
    return json.dumps({"version": 1, "videos": [video]}).replace('"here"', f"{{{text}}}")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (f'{{"version": 1, {KEYS}, "version": 1, "videos": []}}', "given more than once"),
        (f'{{"version": 1, {KEYS}, "videos": []}}', "the keys allowed here are"),
        (manifest_with_attributes(KEYS.replace(": 0", ": NaN")), "numbers must be finite"),
    ],
    ids=["repeated key", "unknown keys", "bad attributes"],
)
def test_manifests_with_many_keys(tmp_path, text, problem):
    with pytest.raises(ManifestError, match=problem):
        load_manifest(write(tmp_path, text))


def cvat(*tracks):
    return f"<annotations>{''.join(tracks)}</annotations>"


def test_tracks_with_many_boxes_that_are_no_keyframes(tmp_path):
    boxes = "".join(BOX.format(frame, frame % 2) for frame in range(4 * COUNT))
    path = write(tmp_path, cvat(f"<track id='0' label='a'>{boxes}</track>"))
    ((track,),) = (seeds.tracks for seeds in read_cvat(path, import_hints()))
    assert len(track.keyframes) == 2 * COUNT


def test_projects_with_many_tasks(tmp_path):
    tracks = (
        f"<track id='{number}' label='a' task_id='{number}'>{BOX.format(0, 1)}</track>"
        for number in range(COUNT)
    )
    meta = "<meta>" + "<task><id>1</id></task>" * COUNT + "</meta>"
    assert len(read_cvat(write(tmp_path, cvat(meta, *tracks)), import_hints())) == COUNT


def test_coco_with_many_classes(tmp_path):
    numbers = range(COUNT)
    document = {
        "videos": [{"id": 1}],
        "images": [{"id": number, "video_id": 1, "frame_index": number} for number in numbers],
        "annotations": [
            {
                "image_id": number,
                "track_id": number + 1,
                "category_id": number,
                "bbox": [1, 2, 3, 4],
            }
            for number in numbers
        ],
        "categories": [{"id": number, "name": "a"} for number in numbers],
    }
    (seeds,) = read_coco(write(tmp_path, json.dumps(document)), import_hints())
    assert all(len(track.keyframes) == 2 for track in seeds.tracks[:-1])


def test_coco_with_many_images_that_leave_a_class_open(tmp_path):
    images = [
        {"id": number, "video_id": 1, "frame_index": number, "not_exhaustive_category_ids": [7]}
        for number in range(COUNT)
    ]
    boxes = [
        {"image_id": number, "track_id": number, "category_id": 7, "bbox": [1, 2, 3, 4]}
        for number in range(COUNT)
    ]
    document = {"videos": [{"id": 1}], "images": images, "annotations": boxes}
    document["categories"] = [{"id": 7, "name": "a"}]
    (seeds,) = read_coco(write(tmp_path, json.dumps(document)), import_hints())
    assert all(len(track.keyframes) == 1 for track in seeds.tracks)


def test_sequences_with_many_blank_lines(tmp_path):
    (tmp_path / "gt").mkdir()
    path = write(tmp_path / "gt", "1,1,1,2,3,4,1", "gt.txt")
    write(tmp_path, "\n" * 1_000_000, "seqinfo.ini")
    with pytest.raises(SitupError, match="seqLength is missing"):
        read_mot_seeds(path, import_hints())


def test_archives_with_many_labels(tmp_path):
    labels = "\n".join(map(str, range(150_000))).encode()
    content = zipped({"gt/gt.txt": b"1,1,1,2,3,4,1,1,1", "gt/labels.txt": labels})
    path = tmp_path / "task.zip"
    path.write_bytes(content)
    assert inspect_path(path).kind == "mot_zip"
