"""``situp-annotate schema``."""

import json
import re

import pytest
from click.testing import CliRunner

from situp_annotate.cli import cli
from situp_annotate.formats.manifest import manifest_schema

TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "integer": int,
    "number": (int, float),
    "boolean": bool,
}


def fits(schema, value, root):
    """Whether a value fits a schema; knows the keywords of ours and fails on any other."""
    if isinstance(schema, bool):
        return schema
    checks = {
        "$ref": lambda ref: fits(root["$defs"][ref.removeprefix("#/$defs/")], value, root),
        "type": lambda name: (
            isinstance(value, TYPES[name]) and (name == "boolean" or not isinstance(value, bool))
        ),
        "const": lambda constant: value == constant,
        "minimum": lambda least: value >= least,
        "maximum": lambda most: value <= most,
        "exclusiveMinimum": lambda bound: value > bound,
        "minLength": lambda least: len(value) >= least,
        "maxLength": lambda most: len(value) <= most,
        "pattern": lambda pattern: re.search(pattern, value) is not None,
        "minItems": lambda least: len(value) >= least,
        "maxItems": lambda most: len(value) <= most,
        "items": lambda item: all(fits(item, v, root) for v in value),
        "prefixItems": lambda items: all(map(lambda i, v: fits(i, v, root), items, value)),
        "required": lambda keys: all(key in value for key in keys),
        "properties": lambda all_of: all(
            fits(rule, value[key], root) for key, rule in all_of.items() if key in value
        ),
        "additionalProperties": lambda allowed: (
            allowed or value.keys() <= schema["properties"].keys()
        ),
        "oneOf": lambda options: sum(fits(option, value, root) for option in options) == 1,
        "anyOf": lambda options: any(fits(option, value, root) for option in options),
    }
    remarks = {"$schema", "$defs", "title", "description", "examples", "default"}
    order = sorted(schema.keys() - remarks, key=lambda keyword: keyword != "type")
    return all(checks[keyword](schema[keyword]) for keyword in order)


@pytest.fixture(scope="module")
def printed():
    outcome = CliRunner().invoke(cli, ["schema"])
    assert outcome.exit_code == 0
    return json.loads(outcome.stdout)


def test_prints_the_schema(printed):
    assert printed == manifest_schema()
    assert printed["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def test_its_own_example_fits(printed):
    assert fits(printed, printed["examples"][0], printed)


BOX = [1, 2, 3.5, 4]


@pytest.mark.parametrize(
    ("change", "fitting"),
    [
        ({}, True),
        ({"frame": -1}, False),
        ({"id": 0}, False),
        ({"label": ""}, False),
        ({"label": "a\tb"}, False),
        ({"box": [1, 2, 3]}, False),
        ({"box": [1, 2, 3, 0]}, False),
        ({"box": None}, False),
        ({"lable": "x"}, False),
        ({"keyframes": [{"frame": 0, "box": BOX}]}, False),
        ({"frame": ..., "box": ...}, False),
        ({"frame": ..., "box": ..., "keyframes": []}, False),
        ({"frame": ..., "box": ..., "keyframes": [{"frame": 0, "box": BOX}]}, True),
        ({"frame": ..., "box": ..., "keyframes": [{"frame": 0, "outside": True}]}, True),
        ({"frame": ..., "box": ..., "keyframes": [{"frame": 0, "outside": False}]}, False),
        (
            {"frame": ..., "box": ..., "keyframes": [{"frame": 0, "outside": True, "box": BOX}]},
            False,
        ),
    ],
)
def test_what_fits_and_what_does_not(printed, change, fitting):
    track = {"id": 1, "label": "car", "frame": 0, "box": BOX, **change}
    track = {key: value for key, value in track.items() if value is not ...}
    document = {"version": 1, "videos": [{"path": "a.mp4", "tracks": [track]}]}
    assert fits(printed, document, printed) is fitting
