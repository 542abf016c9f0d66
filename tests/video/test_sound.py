"""Sound: every packet as it was, and at its time beside the pictures."""

from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest
from support.media import draw_index, write_image_folder, write_unknown_sound, write_video

from situp_annotate.video import open_video, sound
from situp_annotate.video.pyav_stream import read_packets
from situp_annotate.video.writer import H264Writer

COUNT = 45
RATE = 30


def write_sound(
    path, *, codec, rate=48_000, start_s=0.0, seconds=1.2, first_picture=0, layout="mono"
):
    """A video whose sound is a tone, and begins at another time than the pictures."""
    with av.open(str(path), "w") as container:
        video = container.add_stream("mpeg4" if path.suffix == ".avi" else "libx264", rate=RATE)
        video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
        video.codec_context.options = {"bf": "0"}
        sound = container.add_stream(codec, rate=rate, layout=layout)
        for index in range(COUNT):
            frame = av.VideoFrame.from_ndarray(draw_index(index), format="bgr24")
            frame.pts, frame.time_base = first_picture + index, Fraction(1, RATE)
            container.mux(video.encode(frame.reformat(format="yuv420p")))
        size = sound.codec_context.frame_size or 1024
        for first in range(0, int(seconds * rate), size):
            wave = np.sin(np.arange(first, first + size) * 2 * np.pi * 440 / rate) * 8000
            channels = np.repeat(wave.astype(np.int16), 1 if layout == "mono" else 2)[None]
            frame = av.AudioFrame.from_ndarray(channels, "s16", layout)
            frame.sample_rate = rate
            frame.pts, frame.time_base = first + round(start_s * rate), Fraction(1, rate)
            container.mux(sound.encode(frame))
        for stream in (video, sound):
            container.mux(stream.encode(None))
    return path


def write_overlay(source, path, *, background=False):
    with open_video(source) as frames:
        info = frames.info
        with H264Writer(
            path,
            width=info.width,
            height=info.height,
            frame_rate=info.frame_rate,
            sound=source,
            background=background,
        ) as writer:
            for frame in frames:
                writer.write(frame.image, frame.pts_ns)
    return path


def sound_of(path):
    """Codec, and each packet's bytes and time from the first picture."""
    with av.open(str(path)) as container:
        first = next(container.decode(video=0)).time
    with av.open(str(path)) as container:
        (stream,) = container.streams.audio
        packets = [
            (bytes(packet), float(packet.pts * packet.time_base) - first)
            for packet in container.demux(stream)
            if packet.pts is not None
        ]
        return stream.codec_context.codec.canonical_name, packets


@pytest.mark.parametrize(
    ("name", "codec"),
    [("a.mp4", "aac"), ("a.mkv", "aac"), ("a.ts", "aac"), ("a.mkv", "libmp3lame"),
     ("a.avi", "libmp3lame"), ("a.mkv", "ac3"), ("a.mkv", "libopus"), ("a.mkv", "flac"),
     ("a.mp4", "alac")],
)  # fmt: skip
def test_packets_are_copied(tmp_path, name, codec):
    source = write_sound(tmp_path / name, codec=codec)
    before, after = (
        sound_of(path) for path in (source, write_overlay(source, tmp_path / "overlay.mp4"))
    )
    assert after[0] == before[0]
    header = 7 if name.endswith(".ts") else 0  # ADTS headers are not for mp4
    assert [data for data, _ in after[1]] == [data[header:] for data, _ in before[1]]
    times = [[time for _, time in packets] for _, packets in (before, after)]
    assert times[1] == pytest.approx(times[0], abs=2e-3)
    assert len(times[0]) > 10


@pytest.mark.parametrize("suffix", [".mp4", ".mkv"])
@pytest.mark.parametrize(("start_s", "first_picture"), [(0.4, 0), (0.0, 12), (0.2, 21)])
def test_the_distance_to_the_pictures_stays(tmp_path, suffix, start_s, first_picture):
    source = write_sound(
        tmp_path / f"a{suffix}", codec="aac", start_s=start_s, first_picture=first_picture
    )
    _, before = sound_of(source)
    _, after = sound_of(write_overlay(source, tmp_path / "overlay.mp4"))
    assert [data for data, _ in after] == [data for data, _ in before]
    assert [time for _, time in after] == pytest.approx([time for _, time in before], abs=1e-3)
    assert before[0][1] == pytest.approx(start_s - first_picture / RATE, abs=0.03)
    with av.open(str(tmp_path / "overlay.mp4")) as overlay:
        assert next(overlay.decode(video=0)).pts == 0


@pytest.mark.parametrize(
    ("name", "codec", "rate"),
    [
        *[("a.avi", "pcm_s16le", 48_000), ("a.avi", "pcm_s16le", 11_025)],
        *[("a.mkv", "mp2", 48_000), ("a.avi", "mp2", 16_000), ("a.avi", "libmp3lame", 8_000)],
    ],
)
def test_what_no_mp4_holds_is_encoded_anew(tmp_path, name, codec, rate):
    source = write_sound(tmp_path / name, codec=codec, rate=rate)
    with av.open(str(write_overlay(source, tmp_path / "overlay.mp4"))) as container:
        assert container.streams.audio[0].codec_context.name == "aac"
        frames = list(container.decode(audio=0))
    wave = np.concatenate([frame.to_ndarray()[0] for frame in frames])
    assert float(frames[0].time) == pytest.approx(0, abs=0.03)
    assert wave.size / 48_000 == pytest.approx(1.2, abs=0.2)
    tone = wave[10_000:40_000] * np.hanning(30_000)
    assert np.abs(np.fft.rfft(tone)).argmax() * 48_000 / 30_000 == pytest.approx(440, abs=3)


def test_without_sound_there_is_none(tmp_path):
    for source in (write_video(tmp_path / "a.mp4"), write_image_folder(tmp_path / "pictures")):
        with av.open(str(write_overlay(source, tmp_path / "overlay.mp4"))) as container:
            assert not container.streams.audio


def test_sound_is_the_same_from_the_background(tmp_path):
    source = write_sound(tmp_path / "a.mp4", codec="aac")
    paths = [
        write_overlay(source, tmp_path / f"{background}.mp4", background=background)
        for background in (False, True)
    ]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_sound_lies_beside_its_pictures_in_the_file(tmp_path):
    source = write_sound(tmp_path / "a.mp4", codec="aac", seconds=1.5)
    with av.open(str(write_overlay(source, tmp_path / "overlay.mp4"))) as container:
        order = [(p.stream.type, p.dts * p.time_base) for p in container.demux() if p.size]
    times = [float(time) for _, time in order]
    assert all(later > time - 0.2 for time, later in pairwise(times))


# ---- sound that changes or is damaged ------------------------------------------------------


def pictures_of(path):
    with av.open(str(path)) as container:
        return sum(1 for _ in container.decode(video=0))


def heard_until(path):
    """When the last sound ends, in seconds; 0 without sound."""
    with av.open(str(path)) as container:
        if not container.streams.audio:
            return 0.0
        packets = [packet for packet in container.demux(audio=0) if packet.size]
    return float((packets[-1].pts + packets[-1].duration) * packets[-1].time_base)


def write_channel_change(path):
    """What broadcasts do: stereo, then mono, in one stream."""
    parts = [
        write_sound(path.with_suffix(f".{layout}.ts"), codec="mp2", layout=layout)
        for layout in ("stereo", "mono")
    ]
    with av.open(str(path), "w") as writer:
        copies = {}
        for number, part in enumerate(parts):
            with av.open(str(part)) as reader:
                for stream in reader.streams:
                    if stream.type not in copies:
                        copies[stream.type] = writer.add_stream_from_template(stream)
                for packet in reader.demux():
                    if packet.dts is not None:
                        shift = round(Fraction(number * COUNT, RATE) / packet.time_base)
                        packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                        packet.stream = copies[packet.stream.type]
                        writer.mux(packet)
    return path


def test_stereo_that_turns_into_mono_goes_on(tmp_path):
    source = write_channel_change(tmp_path / "a.ts")
    overlay = write_overlay(source, tmp_path / "overlay.mp4")
    assert pictures_of(overlay) == 2 * COUNT
    assert heard_until(overlay) == pytest.approx(COUNT / RATE + 1.2, abs=0.1)
    with av.open(str(overlay)) as container:
        waves = [frame.to_ndarray()[0] for frame in container.decode(audio=0)]
    assert np.abs(waves[-5]).max() > 0.1


def overwrite(path, place, data):
    content = bytearray(path.read_bytes())
    content[place : place + len(data)] = data
    path.write_bytes(content)
    return path


def odd_adts(path):
    """A transport stream with an ADTS header of several blocks in a frame, with checksums."""
    write_sound(path, codec="aac")
    content = path.read_bytes()
    with av.open(str(path)) as container:
        packets = [bytes(packet) for packet in container.demux(audio=0) if packet.size]
    header = next(data[:40] for data in packets[5:] if data[:40] in content)
    odd = bytes([header[0], header[1] & ~1, *header[2:6], header[6] | 1])
    return overwrite(path, content.index(header), odd)


def lost_private_data(path):
    """A Matroska file without what a FLAC decoder, and the index of an mp4, must know."""
    write_sound(path, codec="flac")
    content = path.read_bytes()
    return overwrite(path, content.rindex(b"\x63\xa2", 0, content.index(b"fLaC")), b"\x63\xb5")


@pytest.mark.parametrize(
    ("name", "write", "seconds"),
    [
        ("a.avi", write_unknown_sound, 0),
        ("a.ts", odd_adts, 1.2),
        ("a.mkv", lost_private_data, 0),
    ],
)
@pytest.mark.parametrize("background", [False, True])
def test_damaged_sound_costs_no_picture(tmp_path, name, write, seconds, background):
    source = write(tmp_path / name)
    overlay = write_overlay(source, tmp_path / "overlay.mp4", background=background)
    assert pictures_of(overlay) == pictures_of(source)
    assert heard_until(overlay) == pytest.approx(seconds, abs=0.1)


def test_what_a_muxer_refuses_only_in_its_turn_costs_no_picture(tmp_path, monkeypatch):
    def lasting(container, stream):
        for number, packet in enumerate(read_packets(container, stream)):
            if number in (5, 50):
                packet.duration = 2**40
            yield packet

    source = write_sound(tmp_path / "a.mkv", codec="aac")
    monkeypatch.setattr(sound, "read_packets", lasting)
    overlay = write_overlay(source, tmp_path / "overlay.mp4")
    assert pictures_of(overlay) == COUNT
    assert len(sound_of(overlay)[1]) == len(sound_of(source)[1]) - 2


@pytest.mark.parametrize("place", ["open_container", "video_stream", "read_packets", "_decoded"])
@pytest.mark.parametrize(
    "error",
    [IndexError, ValueError, ZeroDivisionError, OverflowError, TypeError,
     av.error.InvalidDataError(1, "damaged"), av.error.OSError(5, "Input/output error")],
)  # fmt: skip
def test_whatever_is_raised_in_reading_ends_the_sound(tmp_path, monkeypatch, place, error):
    def stumble(*_):
        raise error

    source = write_sound(tmp_path / "a.mkv", codec="mp2")
    monkeypatch.setattr(sound, place, stumble)
    assert pictures_of(write_overlay(source, tmp_path / "overlay.mp4")) == COUNT


def test_a_full_disk_is_no_damaged_sound(tmp_path):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("no /dev/full here")
    source = write_sound(tmp_path / "a.mkv", codec="flac")
    with pytest.raises(OSError, match="No space left on device"):
        write_overlay(source, full)
