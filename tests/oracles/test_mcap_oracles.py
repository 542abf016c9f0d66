"""Our MCAP read by others: the official JavaScript reader, and Rerun."""

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from support.media import write_video
from support.patch import moving, patch_job

from situp_annotate.formats.mcap.recovery import recover_mcap
from situp_annotate.pipeline import annotate_video
from situp_annotate.recipe import load_recipe

HERE = Path(__file__).parent
PACKAGES = ("@mcap/core@2", "@mcap/support@1")
COUNT = 40
H264_CODEC = int.from_bytes(b"avc1", "big")


def missing(reason):
    """Skip; but where all oracles ought to be, fail."""
    if os.environ.get("SITUP_ORACLES"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def mcap_core(request):
    """Where npm has put the JavaScript reader; kept from run to run."""
    for program in ("node", "npm"):
        if shutil.which(program) is None:
            missing(f"{program} is not installed: the JavaScript reader cannot run")
    folder = Path(request.config.cache.mkdir("mcap_core"))
    if not (folder / "node_modules" / "@mcap" / "support").is_dir():
        (folder / "package.json").write_text('{"private": true}')
        command = ["npm", "install", "--no-audit", "--no-fund", "--no-package-lock", *PACKAGES]
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=False, timeout=280
        )
        if done.returncode:
            missing(f"npm cannot install the JavaScript reader: {done.stderr[-300:]}")
    return folder


@pytest.fixture(scope="session")
def oracle_python():
    """Return the Python of the environment that rerun-sdk is installed in."""
    python = os.environ.get("SITUP_ORACLES")
    if not python:
        pytest.skip("SITUP_ORACLES does not name a Python that has rerun-sdk")
    return python


@pytest.fixture(scope="module", params=["as in the source", "encoded anew"])
def log(request, tmp_path_factory):
    """A log made by the pipeline, of a video with and without B-frames."""
    folder = tmp_path_factory.mktemp("oracles")
    anew = request.param == "encoded anew"
    clip = write_video(folder / "patch.mp4", moving(COUNT, (240, 320)), b_frames=2 if anew else 0)
    recipe = load_recipe("csv_only", ["outputs.mcap=true"])
    annotate_video(patch_job(clip, 0), folder / "out", recipe)
    path = folder / "out" / "patch" / "annotations.mcap"
    assert request.param in metadata_of(path)["pictures"]
    return path


def metadata_of(path):
    with path.open("rb") as file:
        (record,) = make_reader(file).iter_metadata()
        return record.metadata


def messages_of(path, topic):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [(m.log_time, m.data, proto) for *_, m, proto in reader.iter_decoded_messages(topic)]


def read_with_javascript(mcap_core, path):
    command = ["node", str(HERE / "read_mcap.mjs"), str(mcap_core), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_javascript_reader_agrees(mcap_core, log):
    seen = read_with_javascript(mcap_core, log)
    topics = {
        "/camera/video": "foxglove.CompressedVideo",
        "/camera/annotations": "foxglove.ImageAnnotations",
        "/camera/tracks": "situp_annotate.TrackStates",
        "/camera/log": "foxglove.Log",
    }
    assert {name: topic["schema"] for name, topic in seen["topics"].items()} == topics
    for name, topic in seen["topics"].items():
        ours = messages_of(log, name)
        assert topic["encoding"] == "protobuf"
        assert topic["times"] == [f"{time} {time}" for time, _, _ in ours]
        assert topic["sizes"] == [len(data) for _, data, _ in ours]
        assert topic["hash"] == hashlib.sha256(b"".join(data for _, data, _ in ours)).hexdigest()
    counts = {name: len(topic["times"]) for name, topic in seen["topics"].items()}
    assert counts["/camera/video"] == counts["/camera/annotations"] == COUNT
    total = sum(counts.values())
    assert seen["streamed"] == total
    assert seen["chunks"] == seen["statistics"]["chunks"]
    assert seen["statistics"]["messages"] == total
    assert seen["statistics"]["counts"] == counts
    video = seen["topics"]["/camera/video"]["times"]
    assert seen["statistics"]["start"] == video[0].split()[0]
    assert seen["statistics"]["end"] == video[-1].split()[0]
    assert seen["attachments"]["mot.csv"] == (log.parent / "mot.csv").read_text()
    assert seen["metadata"]["situp-annotate"] == metadata_of(log)


def test_the_javascript_reader_reads_what_was_rescued(mcap_core, log, tmp_path):
    cut = tmp_path / "annotations.mcap.partial"
    cut.write_bytes(log.read_bytes()[:-1000])
    recovery = recover_mcap(cut, tmp_path / "new.mcap")
    seen = read_with_javascript(mcap_core, tmp_path / "new.mcap")
    counts = {name: len(topic["times"]) for name, topic in seen["topics"].items()}
    assert counts == recovery.messages
    assert counts["/camera/video"] == COUNT


def test_rerun_shows_the_video_and_knows_the_boxes(oracle_python, log, tmp_path):
    rrd = tmp_path / "log.rrd"
    # Without a home of its own, its first run would ask questions there.
    environment = {**os.environ, "HOME": str(tmp_path)}
    commands = (
        [oracle_python, "-m", "rerun", "mcap", "convert", str(log), "-o", str(rrd)],
        [oracle_python, str(HERE / "read_rrd.py"), str(rrd)],
    )
    for command in commands:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=200, env=environment
        )
        assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    video = messages_of(log, "/camera/video")
    samples = [[time, hashlib.sha256(proto.data).hexdigest()] for time, _, proto in video]
    assert sorted(seen["/camera/video:VideoStream:sample"]) == samples
    assert {tuple(codec) for _, codec in seen["/camera/video:VideoStream:codec"]} == {(H264_CODEC,)}
    boxes = [time for time, _ in seen["/camera/annotations:foxglove.ImageAnnotations:message"]]
    assert sorted(boxes) == [time for time, _, _ in video]
