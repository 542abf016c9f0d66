"""Tell kinds of files apart by their first bytes."""

from enum import Enum, auto

from mcap.writer import MCAP0_MAGIC

__all__ = ["HEAD_BYTES", "Kind", "describe_binary", "sniff"]

HEAD_BYTES = 4096

_PICTURES = (b"\x89PNG\r\n", b"\xff\xd8\xff", b"II*\0", b"MM\0*")
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_TEXT_VIDEO = b"YUV4MPEG2"
_USUAL_CONTROLS = frozenset(b"\t\n\f\r\x1b")
_OTHER_MAGIC = {
    b"\x1f\x8b": "a gzip archive",
    b"7z\xbc\xaf": "a 7-Zip archive",
    b"Rar!": "a RAR archive",
    b"\x28\xb5\x2f\xfd": "a Zstandard archive",
    b"%PDF": "a PDF",
    b"\x7fELF": "a program",
    b"MZ": "a program",
    b"SQLite format 3": "an SQLite database (a ROS 2 bag?)",
    b"#ROSBAG": "a ROS 1 bag",
    b"\x93NUMPY": "a NumPy array",
    b"\x89HDF": "an HDF5 file",
    b"RIFF": "a RIFF file",
    b"\x1a\x45\xdf\xa3": "a Matroska or WebM file",
    b"\0\0\0\1": "a raw video stream",
    b"PAR1": "a Parquet table",
}


class Kind(Enum):
    """What a file may be, by its first bytes."""

    EMPTY = auto()
    MCAP = auto()
    ZIP = auto()
    PICTURE = auto()
    JSON = auto()
    XML = auto()
    UTF16 = auto()
    TEXT = auto()
    BINARY = auto()


def sniff(head: bytes) -> Kind:
    """Tell a file's kind.

    Parameters
    ----------
    head : bytes
        Its first bytes, `HEAD_BYTES` of them or all there are.
    """
    if not head:
        return Kind.EMPTY
    if head.startswith(MCAP0_MAGIC):
        return Kind.MCAP
    if head.startswith((b"PK\3\4", b"PK\5\6")):
        return Kind.ZIP
    if head.startswith(_PICTURES) or (head[:2] == b"BM" and b"\0" in head[:16]):
        return Kind.PICTURE
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return Kind.PICTURE
    if head.startswith(_UTF16) and not head.startswith(b"\xff\xfe\xff"):
        return Kind.UTF16
    if head.startswith(_TEXT_VIDEO) or not _is_text(head):
        return Kind.BINARY
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(b"<"):
        return Kind.XML
    if text.startswith(b"{") or (text.startswith(b"[") and not _is_toml_table(text)):
        return Kind.JSON
    return Kind.TEXT


def _is_text(head: bytes) -> bool:
    odd = sum(byte < 32 and byte not in _USUAL_CONTROLS for byte in head)
    return odd == 0


def _is_toml_table(text: bytes) -> bool:
    """Whether a line such as ``[outputs]`` or ``[Sequence]`` comes first."""
    name = text.split(b"\n", 1)[0].split(b"#", 1)[0].strip(b" \t\r[]")
    return bool(name) and name.replace(b"_", b"").replace(b"-", b"").replace(b".", b"").isalpha()


def describe_binary(head: bytes) -> str:
    """Say what a file that is no readable video looks like."""
    if head[4:8] in {b"ftyp", b"moov", b"mdat", b"free", b"wide"}:
        return "an MP4 or QuickTime file"
    if len(head) > 188 and head[0] == head[188] == 0x47:
        return "an MPEG transport stream"
    for magic, name in _OTHER_MAGIC.items():
        if head.startswith(magic):
            return name
    return "a binary file of an unknown kind"
