"""``situp-annotate score``: files in, table and JSON out, and what it refuses."""

import csv
import json
import sys
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.patch import box_at, patch_job, write_patch

from situp_annotate.batch import annotate_batch
from situp_annotate.cli import cli
from situp_annotate.recipe import load_recipe

SAMPLES = Path(__file__).parents[2] / "samples"
PERFECT = "1.000 1.000 1.000 1.000 1.000 1.000 0 0 0 0"


def run(*arguments):
    return CliRunner().invoke(cli, ["score", *map(str, arguments)])


def table(outcome):
    """Cells of each row, by the name of the video."""
    assert outcome.exit_code == 0, outcome.output
    lines = [line.split(maxsplit=1) for line in outcome.stdout.splitlines()]
    return {name: " ".join(rest.split()) for name, rest in lines}


def refused(outcome, message, code=1):
    assert outcome.exit_code == code, outcome.output
    assert message in outcome.stderr
    assert outcome.stdout == ""


def rows(*boxes, tail="1,-1,-1,-1"):
    """A MOT file; boxes are frame, id and left."""
    return "".join(f"{frame},{id_},{left},5,10,10,{tail}\n" for frame, id_, left in boxes)


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


GOOD = rows((1, 1, 0), (2, 1, 3))


@pytest.fixture
def folders(tmp_path):
    """Results and truth of two videos."""
    for place, tail in (("results", "1,-1,-1,-1"), ("truth", "1,1,1")):
        write(tmp_path / place / "a.txt", rows((1, 1, 0), (2, 1, 3), tail=tail))
        write(tmp_path / place / "b.txt", rows((1, 4, 0), (2, 4, 3), tail=tail))
    return tmp_path / "results", tmp_path / "truth"


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A run of two videos, of which one counts pixels from 1."""
    clip = write_patch(tmp_path_factory.mktemp("clips") / "patch.mp4")
    output = tmp_path_factory.mktemp("run") / "out"
    jobs = [patch_job(clip, *range(12)), patch_job(clip, *range(12), video_id="second")]
    recipe = load_recipe("csv_only", ["mot.pixel_origin=1"])
    annotate_batch(jobs, output, recipe, executor="serial")
    return output


@pytest.fixture
def patch_truth(tmp_path):
    boxes = [(frame + 1, 1, box_at(frame)) for frame in range(12)]
    text = "".join(f"{f},{i},{b.x},{b.y},{b.width},{b.height},1,1,1\n" for f, i, b in boxes)
    for name in ("patch", "second"):
        write(tmp_path / "truth" / name / "gt" / "gt.txt", text)
    return tmp_path / "truth"


def sample_rows(least_visibility):
    with (SAMPLES / "ground_truth.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            if float(row["visibility"]) >= least_visibility:
                box = (row[key] for key in ("x", "y", "width", "height"))
                yield f"{int(row['frame']) + 1},{row['id']},{','.join(box)},1,1,1\n"


def test_the_sample_s_truth(tmp_path):
    whole, seen = [*sample_rows(0)], [*sample_rows(1)]
    truth = write(tmp_path / "truth.txt", "".join(whole))
    result = write(tmp_path / "result.txt", "".join(seen))
    missing = len(whole) - len(seen)
    assert 0 < missing < 240
    assert table(run(truth, truth))["COMBINED"] == f"{PERFECT} 2 0 2"
    outcome = run(result, truth, "--json", tmp_path / "scores.json")
    figures = json.loads((tmp_path / "scores.json").read_text())["combined"]
    assert (figures["FN"], figures["FP"], figures["IDSW"]) == (missing, 0, 0)
    assert figures["MOTA"] == pytest.approx(1 - missing / 480)
    assert figures["DetA"] == pytest.approx(1 - missing / 480)
    assert figures["IDF1"] == pytest.approx(2 * len(seen) / (480 + len(seen)))
    assert f" {figures['HOTA']:.3f} {figures['DetA']:.3f} " in f" {table(outcome)['result']} "


def test_the_output_of_a_run(out, patch_truth):
    found = table(run(out, patch_truth, "--result-origin", 1))
    assert list(found) == ["video", "patch", "second", "COMBINED"]
    assert found["video"] == "HOTA DetA AssA LocA MOTA IDF1 FP FN IDSW Frag MT ML objects"
    assert found["second"] == f"{PERFECT} 1 0 1"
    assert found["COMBINED"] == f"{PERFECT} 2 0 2"
    # A pixel to the side and down: 23 × 23 of 24 × 24 are shared, an overlap of 529 / 623, which
    # is above 16 of 19 thresholds; where nothing is found, LocA is 1.
    shares = f"{16 / 19:.3f} " * 3 + f"{(16 * 529 / 623 + 3) / 19:.3f} 1.000 1.000"
    assert table(run(out, patch_truth))["patch"] == f"{shares} 0 0 0 0 1 0 1"
    both = table(run(out, patch_truth, "--result-origin", 1, "--truth-origin", 1))
    assert both["patch"] == table(run(out, patch_truth))["patch"]


def test_what_export_writes(out, tmp_path):
    formats = ["--format", "mot", "--format", "mot-gt", "--format", "cvat-mot"]
    done = CliRunner().invoke(cli, ["export", str(out), *formats, "--output", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert table(run(tmp_path / "mot", tmp_path / "mot-gt"))["second"] == f"{PERFECT} 1 0 1"
    archive = tmp_path / "cvat-mot" / "patch.zip"
    assert table(run(tmp_path / "mot" / "patch.txt", archive))["patch"] == f"{PERFECT} 1 0 1"


def test_one_folder_of_either(out, patch_truth):
    truth = patch_truth / "patch"
    for place in (out / "patch", out / "patch" / "mot.csv"):
        assert list(table(run(place, truth))) == ["video", "patch", "COMBINED"]


def test_truth_of_a_longer_video(out, patch_truth):
    path = patch_truth / "second" / "gt" / "gt.txt"
    path.write_text(path.read_text() + "13,1,0,0,9,9,1,1,1\n")
    refused(
        run(out, patch_truth),
        f"{path}: boxes go up to frame 13, but the video second has 12 frames, counted from 1;",
    )


def test_one_truth_for_one_result_needs_no_name(tmp_path):
    result, truth = write(tmp_path / "here.txt", GOOD), write(tmp_path / "there.txt", GOOD)
    assert list(table(run(result, truth))) == ["video", "here", "COMBINED"]


def test_what_is_left_out_is_named(folders, tmp_path):
    results, truth = folders
    write(results / "c.txt", GOOD)
    write(truth / "d.txt", GOOD)
    write(truth / "e\x1b[2J.txt", GOOD)
    outcome = run(results, truth, "--json", tmp_path / "scores.json")
    assert list(table(outcome)) == ["video", "a", "b", "COMBINED"]
    assert "Not scored, since there is no truth of it: c.\n" in outcome.stderr
    assert "Not scored, since there is no result: d, 'e\\x1b[2J'.\n" in outcome.stderr
    document = json.loads((tmp_path / "scores.json").read_text())
    assert document["without_truth"] == ["c"]
    assert document["without_result"] == ["d", "e\x1b[2J"]
    assert list(document["videos"]) == ["a", "b"]
    assert document["combined"]["truth_boxes"] == 4


def test_one_truth_for_several_results_goes_by_its_name(folders):
    results, truth = folders
    outcome = run(results, truth / "b.txt")
    assert list(table(outcome)) == ["video", "b", "COMBINED"]
    assert "there is no truth of it: a." in outcome.stderr
    (truth / "b.txt").rename(truth / "z.txt")
    refused(
        run(results, truth / "z.txt"),
        f"{results}: none of its videos (a, b) has truth in {truth / 'z.txt'} (z); give truth as "
        "NAME.txt or NAME/gt/gt.txt with the same names.",
    )


def test_a_video_without_any_truth_is_told(folders):
    results, truth = folders
    (truth / "a.txt").write_text("")
    outcome = run(results, truth)
    assert table(outcome)["a"].startswith("0.000 0.000 0.000 1.000 0.000 0.000 2 0 ")
    assert "No box of the truth counts, so that all shares are 0: a.\n" in outcome.stderr


def test_the_protocol_stands_in_the_json(folders, tmp_path):
    path = tmp_path / "new" / "scores.json"
    options = ["--class", 1, "--ignore-class", 7, "--iou", 0.6, "--truth-origin", 1]
    assert run(*folders, *options, "--json", path).exit_code == 0
    protocol = json.loads(path.read_text())["protocol"]
    assert protocol.pop("scores").startswith("TrackEval 1.")
    assert protocol == {
        "iou": 0.6,
        "hota_iou": "mean over 0.05, 0.1, 0.15 and so on to 0.95",
        "classes": [1],
        "ignored_classes": [7],
        "truth_flag_0": "left out",
        "frames": "counted from 1",
        "result_pixel_origin": 0,
        "truth_pixel_origin": 1,
        "combined": "over the boxes of all videos, as TrackEval's COMBINED_SEQ",
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,1,0,5,10,10,1,1,1\n", "line 1: '0,1,0,5,10,10,1,1,1' is not a row of MOT (frame 0)"),
        (GOOD + "2,1,3,5,10,10,1,1,1\n", "line 3: track 1 has a row in frame 2 already"),
        ("7,-1,0,5,10,10,1,1,1\n", "a box in frame 7 has the id −1, of no track"),
        ("1,1,0,5,0,10,1,1,1\n", "is not a row of MOT"),
        ("", "The truth has no box"),
        ("1,1,0,5,10,10,0,3,1\n", "each has flag 0; classes there are 3;"),
    ],
)
def test_truth_that_is_none(tmp_path, text, message):
    truth = write(tmp_path / "truth.txt", text)
    refused(run(write(tmp_path / "result.txt", GOOD), truth), message)


def test_classes_need_ground_truth(tmp_path):
    result = write(tmp_path / "result.txt", GOOD)
    refused(run(result, result, "--class", 1), f"{result}: there are rows without a class")


def test_places_with_nothing_to_score(folders, tmp_path):
    results, truth = folders
    empty = tmp_path / "empty"
    empty.mkdir()
    wanted = "nothing to score here; give a folder with NAME.txt or NAME/"
    refused(run(results, empty), f"{empty}: {wanted}gt/gt.txt.")
    refused(run(empty, truth), f"{empty}: {wanted}mot.csv, or the output of a run.")
    write(truth / "a" / "gt" / "gt.txt", GOOD)
    refused(run(results, truth), f"{truth / 'a.txt'}: {truth / 'a/gt/gt.txt'} is of the same video")


def test_runs_without_results(folders, tmp_path):
    _, truth = folders
    batch = tmp_path / "out" / "batch.json"
    write(batch, '{"videos": [{"id": "a", "status": "ok"}]}')
    refused(run(batch.parent, truth), f"{batch.parent / 'a' / 'mot.csv'}: not there; run again")
    write(batch, '{"videos": [{"id": "a", "status": "failed"}]}')
    refused(run(batch.parent, truth), f"{batch.parent}: this run has annotated no video.")
    write(batch, "{}")
    refused(run(batch.parent, truth), f"{batch}: this is not what a run writes")
    write(batch, '{"videos": [{"id": "a", "status": "ok"}]}')
    write(batch.parent / "a" / "mot.csv", GOOD)
    write(batch.parent / "a" / "summary.json", "{}")
    refused(run(batch.parent, truth), "summary.json: $: frames is missing")


def test_a_broken_archive(folders):
    results, truth = folders
    with zipfile.ZipFile(truth / "a.zip", "w") as archive:
        archive.writestr("labels.txt", "car\n")
    refused(run(results / "a.txt", truth / "a.zip"), "there is no gt/gt.txt in this archive")


def test_nothing_that_is_read_is_replaced(folders):
    _, truth = folders
    before = (truth / "a.txt").read_text()
    refused(run(*folders, "--json", truth / "a.txt"), "is one of the files to score", code=5)
    assert (truth / "a.txt").read_text() == before


def test_a_place_that_cannot_be_written(folders):
    results, _ = folders
    place = results / "a.txt" / "scores.json"
    refused(run(*folders, "--json", place), str(results / "a.txt"), code=5)


@pytest.mark.parametrize(
    "options",
    [
        ["--class", 1, "--ignore-class", 1],
        ["--iou", 0],
        ["--iou", 1.5],
        ["--truth-origin", 2],
    ],
)
def test_wrong_use(folders, options):
    assert run(*folders, *options).exit_code == 2


def test_without_trackeval(folders, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trackeval.metrics", None)
    outcome = run(*folders, "--json", tmp_path / "scores.json")
    refused(outcome, "install it with pip install 'situp-annotate[mot]'")
    assert not (tmp_path / "scores.json").exists()
