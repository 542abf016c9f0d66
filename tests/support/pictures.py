"""Decode coded pictures the way viewers do: one at a time, each giving its frame at once."""

from collections.abc import Iterable

import av
from av.codec.context import Flags

from situp_annotate.types import Image
from situp_annotate.video.pyav_stream import upright_image

__all__ = ["decode_each"]


def decode_each(packets: Iterable[bytes], codec: str) -> list[Image]:
    """Decode coded pictures; fails where one does not give exactly one frame before the next."""
    context = av.CodecContext.create(codec, "r")
    assert isinstance(context, av.VideoCodecContext)
    context.thread_count = 1
    context.flags |= Flags.low_delay
    images = []
    for number, data in enumerate(packets):
        frames = context.decode(av.Packet(data))
        assert len(frames) == 1, f"packet {number} gave {len(frames)} frames at once"
        images.append(upright_image(frames[0], grey=False, rotation_degrees=0))
    assert context.decode(None) == []
    return images
