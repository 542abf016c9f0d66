"""Bad media and unusual media, each with what has to become of it: ``python -m support.corpus``."""

import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from situp_annotate.types import Image
from support import bombs, media, traps
from support.lures import LURES

__all__ = ["Case", "cases"]

_COUNT = 40
_RAGGED = {"ok", "incomplete", "no_frames", "not_a_video", "frame_size", "too_large", "video"}


@dataclass(frozen=True)
class Case:
    """A file or a folder, and what has to become of it.

    Attributes
    ----------
    name : str
        Of the file or folder.
    write : callable
        Writes it to a path.
    kinds : frozenset of str
        The outcomes that are right, one of them unless the damage is random: ``"ok"``, or the
        ``kind`` of an error.
    frames : tuple of int or None
        Fewest and most frames; None if there may be any number.
    size : tuple of int or None
        Width and height; None if they are not known.
    findings : frozenset of str
        Kinds of findings that there must be.
    overlay, keep : bool
        Whether to draw an overlay, too, and to keep what is incomplete.
    """

    name: str
    write: Callable[[Path], Any]
    kinds: frozenset[str] = frozenset({"ok"})
    frames: tuple[int, int] | None = None
    size: tuple[int, int] | None = None
    findings: frozenset[str] = frozenset()
    overlay: bool = False
    keep: bool = False

    def why_wrong(self, outcome: dict[str, Any]) -> str | None:
        """Say what is wrong with an outcome, as ``support.trial`` tells it; None if nothing is."""
        if outcome["kind"] not in self.kinds:
            return f"{outcome['kind']} instead of {'/'.join(sorted(self.kinds))}"
        if outcome["kind"] != "ok":
            return None
        least, most = self.frames or (1, _COUNT)
        if not least <= outcome["frames"] <= most:
            return f"{outcome['frames']} frames instead of {least} to {most}"
        if self.size is not None and tuple(outcome["size"]) != self.size:
            return f"{outcome['size']} pixels instead of {self.size}"
        missing = self.findings - set(outcome["findings"])
        return f"no finding of {missing}" if missing else None


def _good(name: str, write: Callable[[Path], Any], frames: int, **facts: Any) -> Case:
    facts = {"size": (64, 48), "findings": (), **facts}
    findings = frozenset(facts.pop("findings"))
    return Case(name, write, frames=(frames, frames), findings=findings, **facts)


def _fails(name: str, write: Callable[[Path], Any], kind: str) -> Case:
    return Case(name, write, frozenset({kind}))


# ---- damage ----------------------------------------------------------------------------------


def _noise() -> Iterator[Image]:
    """Pictures that take enough bytes for headers not to matter."""
    chance = np.random.default_rng(7)
    for _ in range(_COUNT):
        coarse = chance.integers(0, 256, (24, 32, 3), dtype=np.uint8)
        yield np.asarray(cv2.resize(coarse, (128, 96)), np.uint8)


def _whole(beside: Path, suffix: str) -> Path:
    """A sound video of forty pictures to do damage to."""
    path = beside.parent / "whole" / f"whole{suffix}"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        options = {"movflags": "faststart"} if suffix == ".mp4" else {}
        media.write_video(path, _noise(), b_frames=2, gop=10, container_options=options)
    return path


def _damaged() -> Iterator[Case]:
    for suffix in (".mp4", ".mkv", ".ts"):
        for tenths in range(1, 10):
            yield _cut_off(suffix, tenths)
        for seed in range(4):
            yield Case(
                f"flipped_bits_{seed}{suffix}",
                lambda path, seed=seed: media.flip_bits(_whole(path, path.suffix), path, seed),
                frozenset(_RAGGED),
            )
        yield Case(
            f"hole{suffix}",
            lambda path: media.punch_hole(_whole(path, path.suffix), path, 0.4, 0.6),
            frozenset(_RAGGED),
        )
    yield _fails("no_moov.mp4", _write_without_moov, "not_a_video")
    yield _fails("no_pictures.mp4", media.write_empty_video, "no_frames")
    yield _fails("empty.mp4", lambda path: path.write_bytes(b""), "not_a_video")
    yield _fails("text.mp4", lambda path: path.write_text("No video.\n" * 99), "not_a_video")
    yield _fails("sound_alone.mp4", media.write_audio_only, "not_a_video")
    yield _fails("shrinking.avi", _write_shrinking_mjpeg, "frame_size")
    yield _fails("growing.ts", media.write_size_change, "frame_size")
    yield _fails("claims_more.avi", _write_avi_claim, "incomplete")
    yield Case("absurd_rate.avi", _write_absurd_rate, frozenset({"ok", "incomplete"}))


def _cut_off(suffix: str, tenths: int) -> Case:
    return Case(
        f"cut_off_at_{tenths}0_percent{suffix}",
        lambda path: media.truncate(_whole(path, suffix), path, tenths / 10),
        # MPEG-TS does not say how long it should be.
        frozenset({"incomplete" if suffix == ".mp4" else "ok"}),
        frames=(4 * tenths - 4, 4 * tenths + 2),
        findings=frozenset({"incomplete"} if suffix == ".mkv" else ()),
        keep=suffix == ".mkv",
    )


def _write_without_moov(path: Path) -> None:
    whole = media.write_video(path.with_name("with_moov.mp4"))
    content = whole.read_bytes()
    path.write_bytes(content[: content.index(b"moov") - 4])
    whole.unlink()


def _write_shrinking_mjpeg(path: Path) -> None:
    """Motion JPEG whose pictures become smaller midway: nothing outside them says so."""
    content = bytearray(
        media.write_video(path, count=30, codec="mjpeg", pixel_format="yuvj420p").read_bytes()
    )
    start = b"\xff\xc0\x00\x11\x08"  # of a baseline frame's header: height and width follow
    places = [place for place in range(len(content)) if content.startswith(start, place)]
    for place in places[10:]:
        content[place + 5 : place + 9] = b"\x00\x20\x00\x20"
    path.write_bytes(content)


def _write_avi_claim(path: Path) -> None:
    content = bytearray(media.write_video(path).read_bytes())
    for place in (content.index(b"avih") + 24, content.index(b"strh") + 40):
        content[place : place + 4] = (10**6).to_bytes(4, "little")
    path.write_bytes(content)


def _write_absurd_rate(path: Path) -> None:
    """Four thousand million pictures a second."""
    content = bytearray(media.write_video(path, count=20).read_bytes())
    rate = content.index(b"strh") + 28
    content[rate : rate + 8] = b"\1\0\0\0\xff\xff\xff\xff"
    path.write_bytes(content)


# ---- unusual, and sound ----------------------------------------------------------------------


def _video(**options: Any) -> Callable[[Path], Path]:
    return lambda path: media.write_video(path, **{"count": 20, **options})


def _unusual() -> Iterator[Case]:
    yield _good("one_pixel.mkv", _video(size_hw=(1, 1), codec="ffv1"), 20, size=(1, 1))
    wide = {"size_hw": (64, 16384), "options": {"preset": "ultrafast"}, "count": 8}
    yield _good("16384_wide.mp4", _video(**wide), 8, size=(16384, 64))
    yield _good("10_bit.mp4", _video(pixel_format="yuv420p10le"), 20, overlay=True)
    yield _good("grey.mkv", _video(codec="ffv1", pixel_format="gray"), 20, overlay=True)
    yield _good("alpha.mkv", _video(codec="ffv1", pixel_format="yuva420p"), 20)
    interlaced = {"flags": "+ildct+ilme", "x264-params": "tff=1"}
    yield _good("interlaced.mp4", _video(options=interlaced), 20)
    pts = [index * index for index in range(20)]
    yield _good("variable_rate.mp4", _video(pts=pts, time_base=Fraction(1, 90)), 20, overlay=True)
    yield _good("negative_start.mkv", _video(pts=range(-5, 15)), 20)
    yield _good(
        "edit_list.mp4",
        lambda path: media.write_cut(_plain(path, b_frames=2), path, 0.7),
        39,
    )
    for degrees in (90, 180, 270):
        yield _good(f"turned_{degrees}.mp4", _video(rotation_degrees=degrees), 20)
    yield _good("mirrored.mp4", traps.write_mirrored, 10)
    yield _good("upside_down.mp4", lambda path: traps.write_mirrored(path, upside_down=True), 10)
    yield _good("wide_pixels.mp4", _video(pixel_aspect_ratio=Fraction(4, 3)), 20)
    odd = _video(size_hw=(47, 61), pixel_format="yuv444p")
    yield _good("odd_size.mp4", odd, 20, size=(61, 47), overlay=True)
    yield _good("two_streams.mp4", traps.write_two_streams, 10)
    yield _good("no_times.h264", _video(b_frames=2), 20, findings=["timestamps"])
    yield _good("reordered.avi", _video(codec="libx264", b_frames=2), 20, findings=["timestamps"])


def _plain(beside: Path, **options: Any) -> Path:
    path = beside.parent / "whole" / f"plain_{beside.name}"
    path.parent.mkdir(exist_ok=True)
    return media.write_video(path, **options)


def _codecs() -> Iterator[Case]:
    yield _good("av1.mp4", lambda path: media.write_av1(path, count=10), 10)
    yield _good("vp8.webm", _video(), 20)
    yield _good("vp9.webm", _video(codec="libvpx-vp9", options={"cpu-used": "8"}), 20)
    quiet = {"x265-params": "log-level=none:pools=none"}
    yield _good("hevc.mp4", _video(codec="libx265", options=quiet), 20)
    yield _good("mpeg2.mpg", _video(codec="mpeg2video", b_frames=2), 20)
    yield _good("mpeg4.avi", _video(), 20)
    yield _good("mjpeg.avi", _video(codec="mjpeg", pixel_format="yuvj420p"), 20)
    yield _good("prores.mov", _video(codec="prores_ks", pixel_format="yuv422p10le"), 20)


# ---- what is no file, or leads elsewhere -----------------------------------------------------


def _special() -> Iterator[Case]:
    yield _fails("folder_without_pictures", lambda path: path.mkdir(), "not_a_video")
    yield _fails("pipe.mp4", lambda path: os.mkfifo(path), "not_a_video")
    yield _fails("zero.mp4", lambda path: path.symlink_to("/dev/zero"), "not_a_video")
    yield _fails("loop.mp4", lambda path: path.symlink_to(path.name), "missing")
    yield _fails("broken_link.mp4", lambda path: path.symlink_to("nowhere.mp4"), "missing")
    for name, write in LURES.items():
        yield Case(
            name,
            lambda path, write=write: write(path, str(_whole(path, ".ts"))),
            frozenset({"not_a_video", "no_frames"}),
        )
    yield _fails("pattern_%03d.png", _video(container_format="mp4"), "not_a_video")
    names = ("concat:a|b.mp4", "http:..mp4", "-dash.mp4", "two words.mp4", "line\nbreak.mp4")
    for name in (*names, "日本 ünïcödé.mp4", "pipe:0", "name_%03d.mp4"):
        yield _good(name, _video(container_format="mp4"), 20)
    if sys.platform == "linux":
        yield _fails(os.fsdecode(b"\xff\xfe.mp4"), _video(container_format="mp4"), "missing")


# ---- folders of pictures ---------------------------------------------------------------------


def _folder(change: Callable[[Path], Any] | None = None, **options: Any) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        media.write_image_folder(folder, 12, **options)
        if change is not None:
            change(folder)

    return write


def _replaced(name: str, write: Callable[[Path], Any]) -> Callable[[Path], None]:
    """A folder of which one picture is something else."""

    def change(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        write(folder / name)

    return _folder(change)


def _folders() -> Iterator[Case]:
    yield _good("pictures", _folder(), 12)
    yield _good("one_pixel_pictures", _folder(size_hw=(1, 1)), 12, size=(1, 1))
    yield _fails("with_half_a_picture", _folder(_halve), "incomplete")
    text = _replaced("5.png", lambda path: path.write_text("no picture"))
    yield _fails("with_a_text", text, "incomplete")
    yield _fails("with_nothing", _replaced("5.png", lambda path: path.touch()), "incomplete")
    yield _fails("with_a_pipe", _replaced("5.png", lambda path: os.mkfifo(path)), "incomplete")
    loop = _replaced("5.png", lambda path: path.symlink_to(path.name))
    yield _fails("with_a_loop", loop, "incomplete")
    broken = _replaced("5.png", lambda path: path.symlink_to("nowhere.png"))
    yield _fails("with_a_broken_link", broken, "incomplete")
    large = _replaced("5.png", lambda path: cv2.imwrite(str(path), media.draw_index(4, (60, 80))))
    yield _fails("with_another_size", large, "frame_size")
    inner = _folder(lambda folder: (folder / "again").symlink_to(folder.name))
    yield _good("with_a_loop_of_folders", inner, 12)


def _halve(folder: Path) -> None:
    picture = folder / "5.png"
    content = picture.read_bytes()
    picture.write_bytes(content[: len(content) // 2])


# ---- too much --------------------------------------------------------------------------------


def _too_large() -> Iterator[Case]:
    for suffix in (".png", ".jpg", ".tif", ".webp", ".bmp"):
        yield _fails(f"huge_picture_{suffix[1:]}", _bombed(suffix), "too_large")
    yield _fails("huge_from_the_first.webm", bombs.write_huge_keyframe, "too_large")
    yield _fails(
        "huge_later.webm", lambda path: bombs.write_huge_keyframe(path, first=2), "too_large"
    )
    yield _fails(
        "claims_many.mp4", lambda path: bombs.write_frame_claim(path, 5_000_001), "too_large"
    )


def _bombed(suffix: str) -> Callable[[Path], None]:
    return _folder(lambda folder: bombs.write_huge_picture(folder / f"5{suffix}"), suffix=suffix)


def cases() -> list[Case]:
    """The whole corpus."""
    groups = (_damaged, _unusual, _codecs, _special, _folders, _too_large)
    return [case for group in groups for case in group()]


def _main(folder: Path) -> None:
    """Write the whole corpus; tell of each file what has to become of it, and how to try it."""
    told = {}
    for case in cases():
        case.write(folder / case.name)
        told[case.name] = {
            "expected": sorted(case.kinds),
            "overlay": case.overlay,
            "keep": case.keep,
        }
    sys.stdout.write(json.dumps(told) + "\n")


if __name__ == "__main__":
    _main(Path(sys.argv[1]))
