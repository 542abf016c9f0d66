"""Whatever is in a file, its reader takes it or says what is wrong with it, and nothing else.

A longer search, led by what the code does: ``atheris_readers.py``.
"""

import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.damage import damaged
from support.mangling import mangled, mangled_words, mangled_xml
from support.readers import READERS, check

_SETTINGS = {
    "deadline": None,
    "suppress_health_check": [HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
}
_SEPARATORS = {"recipe": "=,[] ", "otb": ", \t", "sequence-seqinfo": "="}


@pytest.fixture(params=READERS)
def name(request):
    return request.param


def _mangled(name, text):
    if text.startswith("<"):
        return mangled_xml(text)
    if text.startswith(("{", "[\n")):
        return mangled(json.loads(text))
    return mangled_words(text, _SEPARATORS.get(name, ","))


def test_what_is_valid_is_taken(tmp_path, name):
    reader = READERS[name]
    for text in reader.texts:
        check(reader, tmp_path, reader.packed(text))
        reader.read(tmp_path)


@given(content=st.binary(max_size=200) | st.text(max_size=50).map(str.encode))
@settings(max_examples=30, **_SETTINGS)
def test_any_bytes_are_taken_or_refused(tmp_path, name, content):
    check(READERS[name], tmp_path, content)


@given(data=st.data())
@settings(max_examples=60, **_SETTINGS)
def test_damaged_files_are_taken_or_refused(tmp_path, name, data):
    reader = READERS[name]
    sound = reader.packed(data.draw(st.sampled_from(reader.texts)))
    check(reader, tmp_path, data.draw(damaged(sound, b"<", b'"', b"&a;", b"[" * 2000, b"{}")))


@given(data=st.data())
@settings(max_examples=120, **_SETTINGS)
def test_values_that_nobody_expects_are_taken_or_refused(tmp_path, name, data):
    reader = READERS[name]
    text = data.draw(st.sampled_from(reader.texts).flatmap(lambda text: _mangled(name, text)))
    check(reader, tmp_path, reader.packed(text))
