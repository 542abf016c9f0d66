"""XML that would have a parser unpack, read or fetch something: none of it happens."""

import socket

import pytest
from support.labelled import import_hints
from support.readers import zipped

from situp_annotate.errors import SitupError
from situp_annotate.formats.cvat.importing import read_cvat
from situp_annotate.formats.cvat.xml import MAX_SILENCE
from situp_annotate.inspection import Grade, inspect_path

SECRET = "do not tell"
TRACK = (
    "<track id='0' label='{}'><box frame='0' keyframe='1' xtl='1' ytl='1' xbr='2' ybr='2'/></track>"
)
BODY = f"<annotations>{TRACK}</annotations>"


def document(declarations, label="&a;"):
    return f"<!DOCTYPE annotations {declarations}>{BODY.format(label)}"


def laughs():
    steps = [f"<!ENTITY l{n} '{f'&l{n - 1};' * 10}'>" for n in range(1, 10)]
    return document(f"[<!ENTITY l0 'lol'>{''.join(steps)}]", "&l9;")


ATTACKS = {
    "billion laughs": laughs(),
    "quadratic blow-up": document(f"[<!ENTITY a '{'x' * 50_000}'>]", "&a;" * 50_000),
    "a harmless entity": document("[<!ENTITY a 'car'>]"),
    "a document type alone": document("", "car"),
    "entity from a file": document("[<!ENTITY a SYSTEM 'file://{secret}'>]"),
    "entity from a relative file": document("[<!ENTITY a SYSTEM 'secret.txt'>]"),
    "entity from the network": document("[<!ENTITY a SYSTEM 'http://127.0.0.1:{port}/a'>]"),
    "document type from the network": document("SYSTEM 'http://127.0.0.1:{port}/a.dtd'", "car"),
    "public document type": document("PUBLIC '-//x//y' 'http://127.0.0.1:{port}/a.dtd'", "car"),
    "parameter entity": document(
        "[<!ENTITY % p SYSTEM 'http://127.0.0.1:{port}/p.dtd'> %p;]", "car"
    ),
    "parameter entity that defines another": document(
        "[<!ENTITY % p \"<!ENTITY a SYSTEM 'file://{secret}'>\"> %p;]"
    ),
    "default attributes": document(
        "[<!ATTLIST track label CDATA 'x'><!ENTITY a SYSTEM 'file://{secret}'>]"
    ),
    "entity of a picture": document(
        "[<!NOTATION n SYSTEM 'http://127.0.0.1:{port}/n'><!ENTITY a SYSTEM 'a' NDATA n>]", "car"
    ),
}


@pytest.fixture
def server():
    """Nobody may come here."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(0)
        yield listening
        with pytest.raises(BlockingIOError):
            listening.accept()


@pytest.fixture(params=["plain", "zipped"])
def write(request, tmp_path, server):
    secret = tmp_path / "secret.txt"
    secret.write_text(SECRET)

    def write(text):
        text = text.replace("{secret}", str(secret))
        text = text.replace("{port}", str(server.getsockname()[1]))
        path = tmp_path / f"annotations.{request.param}"
        content = text.encode()
        plain = request.param == "plain"
        path.write_bytes(content if plain else zipped({"annotations.xml": content}))
        return path

    return write


@pytest.mark.parametrize("text", ATTACKS.values(), ids=ATTACKS)
def test_document_types_and_entities_are_refused(write, text):
    path = write(text)
    with pytest.raises(SitupError, match="this is not XML as CVAT writes it") as caught:
        read_cvat(path, import_hints())
    report = inspect_path(path)
    assert report.grade is Grade.PROBLEM
    assert SECRET not in f"{caught.value} {report}"


@pytest.mark.parametrize(
    "text",
    [
        "<?xml-stylesheet href='http://127.0.0.1:{port}/a.xsl'?>" + BODY.format("car"),
        BODY.format("car").replace(
            "<annotations>",
            "<annotations xmlns:xi='http://www.w3.org/2001/XInclude'>"
            "<xi:include href='http://127.0.0.1:{port}/a' parse='text'/>"
            "<xi:include href='file://{secret}' parse='text'/>",
        ),
        BODY.format("car").replace(
            "<annotations>",
            "<annotations xmlns:xsi='http://www.w3.org/2001/XMLSchema-instance'"
            " xsi:noNamespaceSchemaLocation='http://127.0.0.1:{port}/a.xsd'>",
        ),
    ],
    ids=["style sheet", "inclusion", "schema"],
)
def test_what_is_named_elsewhere_is_not_fetched(write, text):
    (seeds,) = read_cvat(write(text), import_hints())
    assert [track.label for track in seeds.tracks] == ["car"]
    assert SECRET not in str(inspect_path(write(text)))


LONG = "x" * (MAX_SILENCE + 2**18)


@pytest.mark.parametrize(
    "text",
    [
        BODY.format(LONG),
        f"<annotations><!--{LONG}--></annotations>",
        f"<annotations>{LONG}</annotations>",
        f"<annotations><{LONG}/></annotations>",
    ],
    ids=["attribute", "comment", "text", "name"],
)
def test_what_has_no_tag_for_too_long_is_refused(write, text):
    path = write(text)
    with pytest.raises(SitupError, match="2 MiB without a tag"):
        read_cvat(path, import_hints())
    assert "2 MiB without a tag" in inspect_path(path).remarks[0].message


def test_elements_without_end_in_each_other_are_refused(write):
    path = write("<annotations>" + "<track>" * 500_000)
    with pytest.raises(SitupError, match="nested too deeply"):
        read_cvat(path, import_hints())
    assert inspect_path(path).grade is Grade.PROBLEM
