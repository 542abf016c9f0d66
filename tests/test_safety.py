"""What the package's source may not hold: code that runs what a file says, or goes elsewhere."""

import ast
from pathlib import Path

import pytest

import situp_annotate

PACKAGE = Path(situp_annotate.__file__).parent

ALLOWED = {"batch/state.py: socket": "only to tell the computer's own name"}
"""Exceptions: file and what is found there, and why it may be."""

MODULES = (
    *("pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "yaml"),
    *("subprocess", "pty", "socket", "ssl", "requests", "urllib3", "httpx", "aiohttp"),
    *("urllib.request", "http.client", "ftplib", "smtplib"),
)
"""What builds objects that a file describes, starts programs, or has to do with a network."""

CALLS = ("eval", "exec", "compile", "__import__", "os.system", "os.popen", "os.exec", "os.spawn")
METHODS = ("extractall", "extract", "mktemp")
XML_WRITERS = ("Element", "ElementTree", "ParseError", "SubElement", "indent", "quoteattr")
"""All that is taken from the standard library; what reads XML comes from defusedxml."""


def _imported(node):
    """Whole names of what a statement imports."""
    if isinstance(node, ast.ImportFrom):
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return [alias.name for alias in node.names] if isinstance(node, ast.Import) else []


def _is_bad_import(name):
    if name.split(".")[0] in ("xml", "lxml"):
        return name.count(".") < 3 or name.rpartition(".")[2] not in XML_WRITERS
    return any(f"{name}.".startswith(f"{module}.") for module in MODULES)


def _is_bad_call(name):
    return name in CALLS or name.startswith(CALLS[-2:]) or name.rpartition(".")[2] in METHODS


def _switched_on(call, name):
    """Whether an argument of this name is anything but plainly false."""
    values = [word.value for word in call.keywords if word.arg == name]
    return any(not isinstance(value, ast.Constant) or value.value for value in values)


def found_in(source):
    """Everything in a module that it may not hold."""
    for node in ast.walk(ast.parse(source)):
        yield from filter(_is_bad_import, _imported(node))
        if isinstance(node, ast.Call):
            yield from filter(_is_bad_call, [ast.unparse(node.func)])
            yield from (name for name in ("shell", "allow_pickle") if _switched_on(node, name))


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: path.name)
def test_no_module_runs_what_a_file_says(path):
    place = path.relative_to(PACKAGE).as_posix()
    found = {f"{place}: {name}" for name in found_in(path.read_text(encoding="utf-8"))}
    assert found <= ALLOWED.keys()


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from pickle import loads",
        "from urllib.request import urlopen",
        "import urllib.request as r",
        "from urllib import request",
        "import subprocess",
        "eval(x)",
        "os.system('ls')",
        "os.execv('ls', [])",
        "run('ls', shell=True)",
        "run('ls', shell=flag)",
        "np.load(path, allow_pickle=True)",
        "import yaml",
        "archive.extractall()",
        "from xml.etree.ElementTree import parse",
        "from xml.etree import ElementTree as E",
        "import xml.etree.ElementTree",
        "from xml.dom import minidom",
    ],
)
def test_the_search_finds_what_it_looks_for(source):
    assert list(found_in(source))


@pytest.mark.parametrize(
    "source",
    [
        "import json",
        "from urllib.parse import quote",
        "re.compile('x')",
        "np.load(path, allow_pickle=False)",
        "from xml.etree.ElementTree import Element, ParseError",
        "from defusedxml.ElementTree import iterparse",
    ],
)
def test_the_search_finds_nothing_else(source):
    assert not list(found_in(source))
