"""Files with a few bytes changed, cut out or put in."""

from hypothesis import strategies as st

_TROUBLE = (b"", b"\x00", b"\xff", b"-", b".", b",", b"\n", b"1e400", b"nan", b"9" * 5000)


@st.composite
def damaged(draw, content, *trouble):
    """What is left of a file that somebody's editor, disk or script got hold of."""
    result = bytearray(content)
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(result)))
        length = draw(st.integers(0, 4) | st.just(len(result)))
        put_in = st.sampled_from((*_TROUBLE, *trouble)) | st.binary(max_size=4)
        result[start : start + length] = draw(put_in)
    return bytes(result)
