"""Colour names of colours that everybody would name alike."""

import socket

import numpy as np
import pytest

from situp_annotate.errors import TrackingError
from situp_annotate.tracking.color_names import (
    _probabilities,
    add_color_names,
    builtin_table,
    load_table,
)

TERMS = [
    "black", "blue", "brown", "grey", "green", "orange", "pink", "purple", "red", "white", "yellow",
]  # fmt: skip


@pytest.mark.parametrize(
    ("rgb", "term"),
    [((0, 0, 0), "black"), ((255, 255, 255), "white"), ((220, 20, 20), "red"),
     ((30, 160, 40), "green"), ((30, 60, 220), "blue"), ((250, 230, 20), "yellow"),
     ((255, 140, 0), "orange"), ((128, 128, 128), "grey"), ((110, 60, 20), "brown"),
     ((255, 150, 190), "pink"), ((120, 30, 160), "purple")],
)  # fmt: skip
def test_plain_colours_have_their_names(rgb, term):
    (probabilities,) = _probabilities(np.array([rgb], float))
    assert TERMS[int(probabilities.argmax())] == term
    assert probabilities.sum() == pytest.approx(1)


def test_inner_products_are_those_of_the_probabilities():
    rgb = np.array([[220, 20, 20], [30, 60, 220]], float)
    index = [int(r // 8 + 32 * (g // 8) + 1024 * (b // 8)) for r, g, b in rgb]
    centres = rgb // 8 * 8 + 4
    first, second = _probabilities(centres)
    rows = builtin_table()[index]
    assert rows[0] @ rows[1] == pytest.approx(first @ second - 1 / 11, abs=1e-5)


def test_lookup_takes_blue_green_red():
    table = np.zeros((32768, 10), np.float32)
    table[31] = 1  # pure red
    image = np.zeros((3, 2, 3), np.uint8)  # columns before rows
    image[2, 0] = (0, 0, 255)
    weights = np.full((2, 3), 0.5, np.float32)
    found = np.empty((3, 2, 10), np.float32)
    add_color_names(image, table, weights, found)
    assert (found[2, 0] == 0.5).all()
    assert found.sum() == 5


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".txt"])
def test_tables_load_from_every_kind_of_file(tmp_path, suffix):
    path = str(tmp_path / f"table{suffix}")
    table = np.tile(np.arange(10, dtype=np.float32), (32768, 1))
    {".npy": np.save, ".npz": np.savez, ".txt": np.savetxt}[suffix](path, table)
    np.testing.assert_array_equal(load_table(path), table)


def test_tables_of_probabilities_are_centred(tmp_path):
    path = str(tmp_path / "probabilities.npy")
    np.save(path, np.full((32768, 11), 1 / 11))
    np.testing.assert_allclose(load_table(path), 0, atol=1e-7)


def test_bad_tables_are_refused(tmp_path):
    path = str(tmp_path / "table.npy")
    with pytest.raises(TrackingError, match="cannot be read"):
        load_table(path)
    np.save(path, np.zeros((5, 10)))
    with pytest.raises(TrackingError, match="32768 rows"):
        load_table(path)
    np.save(path, np.full((32768, 10), "x"))
    with pytest.raises(TrackingError, match="cannot be read"):
        load_table(path)


@pytest.mark.filterwarnings("ignore:.*no data")
@pytest.mark.parametrize("suffix", [".npy", ".npz", ".txt"])
@pytest.mark.parametrize("content", [b"", b"PK\3\4", b"\x93NUMPY", b"\xff", b"import os"])
def test_what_is_no_table_is_refused(tmp_path, suffix, content):
    path = tmp_path / f"table{suffix}"
    path.write_bytes(content)
    with pytest.raises(TrackingError, match=r"table\.\w+: "):
        load_table(str(path))


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".txt", ".csv"])
def test_an_address_is_a_path_like_any_other(suffix):
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0)
        address = f"http://127.0.0.1:{server.getsockname()[1]}/table{suffix}"
        with pytest.raises(TrackingError, match="cannot be read"):
            load_table(address)
        with pytest.raises(BlockingIOError):
            server.accept()
