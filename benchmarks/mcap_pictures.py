"""What the picture in the MCAP costs where the video's own packets are passed on.

    python benchmarks/mcap_pictures.py --sequences FOLDER --json FILE

FOLDER holds sequences in OTB layout. Each becomes an H.264 clip without B-frames, whose first
target is followed from its first true box, with CSVs for output; and its labels are written to an
MCAP, from the choice of pictures to the last byte; in turns. What counts is the process's own time
(all threads), which others on the machine disturb less than the clock's; and how many bytes of
pictures are in the MCAP, over those in the clip.
"""

import json
import statistics
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path

import av
import click
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from tqdm import tqdm

from situp_annotate import annotate_video, load_recipe
from situp_annotate.compiling import compile_kernels
from situp_annotate.evaluation import OtbSequence, find_sequences
from situp_annotate.formats.mcap.log import McapSink
from situp_annotate.formats.mcap.pictures import McapOptions, open_pictures
from situp_annotate.results import read_video
from situp_annotate.types import Frame, Keyframe, Track, VideoJob
from situp_annotate.video import VideoFootage, open_video
from situp_annotate.video.x264 import set_up_encoder, ticks, yuv_frame

_RATE = Fraction(30)


@dataclass(frozen=True)
class Cost:
    """Of one sequence.

    Attributes
    ----------
    name : str
        The sequence.
    frames : int
        Of its clip.
    track_s, mcap_s : float
        Seconds of processor time to follow the target, and to write the MCAP.
    stream_bytes, picture_bytes : int
        Of all packets of the clip, and of all pictures in the MCAP.
    """

    name: str
    frames: int
    track_s: float
    mcap_s: float
    stream_bytes: int
    picture_bytes: int

    @property
    def added(self) -> float:
        """What the MCAP adds, over everything else."""
        return self.mcap_s / self.track_s

    @property
    def bytes_ratio(self) -> float:
        """Picture bytes over stream bytes."""
        return self.picture_bytes / self.stream_bytes


def encode(frames: Iterator[Frame], size_hw: tuple[int, int], path: Path) -> int:
    """Write a clip as cameras do, without B-frames; return the bytes of its packets."""
    size = 0
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=_RATE, options={"bf": "0"})
        set_up_encoder(stream.codec_context, width=size_hw[1], height=size_hw[0])
        for frame in frames:
            picture = yuv_frame(frame.image)
            picture.pts = ticks(round(frame.index * 1_000_000_000 / _RATE))
            for packet in stream.encode(picture):
                size += packet.size
                container.mux(packet)
        for packet in stream.encode(None):
            size += packet.size
            container.mux(packet)
    return size


def track(job: VideoJob, output: Path) -> float:
    """Annotate without an MCAP, and return what that took of the processors."""
    start = time.process_time()
    annotate_video(job, output, load_recipe("csv_only"), cache=False, overwrite=True)
    return time.process_time() - start


def write_mcap(job: VideoJob, folder: Path, frames: list[Frame], path: Path) -> float:
    """Write what a run has found to an MCAP, and return what that took of the processors."""
    video = read_video(folder)
    labels = [
        [
            of_track.points[frame.index]
            for of_track in video.tracks
            if frame.index in of_track.points
        ]
        for frame in frames
    ]
    start = time.process_time()
    pictures = open_pictures(video.info, [frame.pts_ns for frame in frames], McapOptions())
    if pictures is None or pictures.wants_pictures:
        raise click.ClickException(f"{job.path}: its packets are not passed on.")
    with McapSink(
        path, info=video.info, tracks=job.tracks, metadata={}, attachments={}, pictures=pictures
    ) as log:
        for frame, points in zip(frames, labels, strict=True):
            log.write(frame, points)
    return time.process_time() - start


def picture_bytes(path: Path) -> int:
    """Bytes of all pictures of an MCAP, without what its messages add."""
    with path.open("rb") as file:
        messages = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(
            "/camera/video"
        )
        return sum(len(proto.data) for *_, proto in messages)


def measure(sequence: OtbSequence, folder: Path, repeats: int) -> Cost:
    """Encode a sequence, track and log it in turns, and take the medians."""
    clip = folder / f"{sequence.name}.mp4"
    with open_video(sequence.folder) as source:
        stream_bytes = encode(source, (source.info.height, source.info.width), clip)
    with VideoFootage(clip) as footage:
        for _ in footage.forward():
            pass
        frames = list(footage.walk.frames())
    target = sequence.targets[0]
    job = VideoJob(sequence.name, clip, (Track(1, target.name, (Keyframe(0, target.first_box),)),))
    log = folder / f"{sequence.name}.mcap"
    track_s, mcap_s = [], []
    for _ in range(repeats):
        track_s.append(track(job, folder))
        mcap_s.append(write_mcap(job, folder / job.id, frames, log))
    return Cost(
        name=sequence.name,
        frames=len(frames),
        track_s=statistics.median(track_s),
        mcap_s=statistics.median(mcap_s),
        stream_bytes=stream_bytes,
        picture_bytes=picture_bytes(log),
    )


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--repeats", default=3, show_default=True, help="times of each")
def main(sequences: Path, json_path: Path, repeats: int) -> None:
    """Measure, print the table and write the figures."""
    compile_kernels()
    with tempfile.TemporaryDirectory() as name:
        costs = [
            measure(sequence, Path(name), repeats)
            for sequence in tqdm(find_sequences(sequences), unit="sequence")
        ]
    print("| sequence | frames | tracking, ms a frame | MCAP adds | picture bytes ÷ stream's |")
    print("|---" * 5 + "|")
    for each in costs:
        print(
            f"| {each.name} | {each.frames} | {1e3 * each.track_s / each.frames:.2f} "
            f"| {each.added:.1%} | {each.bytes_ratio:.4f} |"
        )
    bars = {
        "mcap_added": sum(each.mcap_s for each in costs) / sum(each.track_s for each in costs),
        "picture_bytes_off": max(abs(each.bytes_ratio - 1) for each in costs),
    }
    print(json.dumps(bars, indent=2))
    figures = {"bars": bars, "sequences": [asdict(each) for each in costs]}
    json_path.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
