"""What FFmpeg may take a file for: formats in which all of a video is in the file itself.

By other formats a file makes FFmpeg open others: playlists and scripts name files and addresses
on the network, a name such as ``img%03d.png`` stands for a thousand files.
"""

__all__ = ["FILE_ONLY", "FILE_ONLY_FOR_OPENCV"]

_FORMATS = (
    # what cameras, editors and browsers write
    *("asf", "avi", "dv", "flv", "gif", "matroska", "mov", "mpeg", "mpegts", "mxf", "ogg", "rm"),
    # streams without a container
    *("av1", "cavsvideo", "dirac", "dnxhd", "h261", "h263", "h264", "hevc", "m4v", "mjpeg"),
    *("mjpeg_2000", "mpegvideo", "obu", "vc1", "vvc", "yuv4mpegpipe"),
    # broadcast, surveillance, high-speed cameras, and what researchers use
    *("apng", "cine", "dhav", "gxf", "ifv", "ivf", "lxf", "mpegtsraw", "mxg", "nut", "pva", "ser"),
    *("smjpeg", "ty", "wtv"),
)
"""FFmpeg's names; of formats that have several, one is enough."""

FILE_ONLY = {"protocol_whitelist": "file", "format_whitelist": ",".join(_FORMATS)}
"""Options of FFmpeg's demuxers."""

FILE_ONLY_FOR_OPENCV = "|".join(f"{name};{value}" for name, value in FILE_ONLY.items())
"""The same as OpenCV reads them from its environment."""
