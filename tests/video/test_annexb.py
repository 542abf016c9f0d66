"""What a coded picture begins with."""

import pytest

from situp_annotate.video.annexb import PictureHead, read_head


def units(*kinds, codec="h264", start_code=b"\0\0\0\1"):
    shift = 1 if codec == "hevc" else 0
    return b"".join(start_code + bytes([kind << shift, 1, 0x80]) for kind in kinds)


@pytest.mark.parametrize(
    ("codec", "kinds", "head"),
    [
        ("h264", [7, 8, 6, 5], PictureHead(True, True)),
        ("h264", [9, 7, 8, 5, 5], PictureHead(True, True)),
        ("h264", [5], PictureHead(True, False)),
        ("h264", [8, 5], PictureHead(True, False)),
        ("h264", [1], PictureHead(False, False)),
        ("h264", [6, 1, 7, 8, 5], PictureHead(False, False)),
        ("h264", [7, 8], None),
        ("hevc", [32, 33, 34, 19], PictureHead(True, True)),
        ("hevc", [35, 32, 33, 34, 39, 21], PictureHead(True, True)),
        ("hevc", [33, 34, 20], PictureHead(True, False)),
        ("hevc", [1], PictureHead(False, False)),
        ("hevc", [40], None),
    ],
)
@pytest.mark.parametrize("start_code", [b"\0\0\1", b"\0\0\0\1"])
def test_heads(codec, kinds, head, start_code):
    assert read_head(units(*kinds, codec=codec, start_code=start_code), codec) == head


@pytest.mark.parametrize("data", [b"", b"\0\0", b"\0\0\1", b"\0\0\0\0\5", b"\0\0\0\5\x65\x88"])
def test_bytes_without_a_slice_are_no_picture(data):
    assert read_head(data, "h264") is None
