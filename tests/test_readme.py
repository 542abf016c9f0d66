"""Every command and code block of the README runs."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from situp_annotate.formats.manifest import load_manifest
from situp_annotate.recipe import load_recipe

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
SET_UP = "python3 -m venv .venv && "


def blocks(language):
    return [text for kind, text in BLOCKS if kind == language]


@pytest.fixture
def checkout(tmp_path):
    """A folder that looks like a checkout with its virtual environment made."""
    shutil.copytree(ROOT / "samples", tmp_path / "samples")
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bin").symlink_to(Path(sys.executable).parent)
    return tmp_path


def test_every_block_is_of_a_kind_that_is_tested():
    assert {kind for kind, _ in BLOCKS} == {"sh", "json", "toml", "python", "text"}


def test_the_two_set_up_commands_are_those_that_ci_runs():
    commands = [text.strip() for text in blocks("sh") if text.startswith(SET_UP)]
    assert len(commands) == 2
    assert all("\n" not in command for command in commands)
    assert " && .venv/bin/pytest" in commands[1]


def without_installation(line):
    steps = [step for step in line.split(" && ") if "venv .venv" not in step]
    return " && ".join(step for step in steps if "bin/pip install" not in step)


SHELL = [
    "".join(f"{without_installation(line)}\n" for line in block.splitlines())
    for block in blocks("sh")
    if "bin/pytest" not in block  # that is what runs here
]


@pytest.mark.parametrize("script", SHELL)
def test_commands(checkout, script):
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script], cwd=checkout, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for line in script.splitlines():
        words = shlex.split(line, comments=True)
        if "--output" in words:
            assert (checkout / words[words.index("--output") + 1]).exists()


@pytest.mark.parametrize("code", blocks("python"))
def test_python(checkout, code):
    script = checkout / "block.py"
    script.write_text(code)
    done = subprocess.run(
        [sys.executable, script.name], cwd=checkout, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.parametrize("text", blocks("json"))
def test_manifests(tmp_path, text):
    path = tmp_path / "manifest.json"
    path.write_text(text)
    (job,) = load_manifest(path).jobs
    assert [len(track.keyframes) for track in job.tracks] == [1, 3]
    assert json.loads(text)["videos"][0]["path"] == str(job.path.relative_to(tmp_path))


@pytest.mark.parametrize("text", blocks("toml"))
def test_recipes(tmp_path, text):
    path = tmp_path / "recipe.toml"
    path.write_text(text)
    assert load_recipe(path) != load_recipe()


def test_every_command_and_option_stands_in_the_readme_or_in_help():
    from situp_annotate.cli import cli

    assert all(f"situp-annotate {name}" in README for name in cli.commands)


def test_every_kind_of_failure_is_explained():
    from situp_annotate import errors

    kinds = {
        cls.kind
        for cls in vars(errors).values()
        if isinstance(cls, type) and issubclass(cls, errors.VideoError)
    } - {errors.VideoError.kind}
    assert all(f"| `{kind}` |" in README for kind in kinds)
