"""The command line as a whole: help, version, imports, and how it ends."""

import os
import re
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

from situp_annotate import errors
from situp_annotate.cli import cli
from situp_annotate.cli._group import SitupGroup

HEAVY = ["numpy", "cv2", "av", "pydantic", "numba", "scipy", "mcap", "PIL", "tqdm", "google"]


def run_in_process(*arguments, **options):
    script = "from situp_annotate.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", script, *arguments], text=True, check=False, timeout=60, **options
    )


def test_importing_the_command_line_imports_nothing_heavy():
    script = (
        f"import sys, situp_annotate.cli\nprint([name for name in {HEAVY} if name in sys.modules])"
    )
    outcome = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    assert outcome.stdout.strip() == "[]"


@pytest.mark.parametrize("name", [None, *cli.commands])
def test_every_command_and_option_says_what_it_does(name):
    command = cli if name is None else cli.commands[name]
    assert command.help
    assert name is None or command.short_help
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, parameter.name
        else:
            # Arguments have no help of their own: the command's text names them.
            assert parameter.make_metavar(click.Context(command)).rstrip(".") in command.help
    outcome = CliRunner().invoke(cli, ["--help"] if name is None else [name, "--help"])
    assert outcome.exit_code == 0
    assert f"Usage: {'cli' if name is None else f'cli {name}'}" in outcome.output
    assert "\b" not in outcome.output


def test_the_group_s_help_lists_every_exit_code():
    codes = {
        error.exit_code
        for error in vars(errors).values()
        if isinstance(error, type) and issubclass(error, errors.SitupError)
    }
    told = {int(code) for code in re.findall(r"^ +(\d+) {2,}\w", cli.help, re.MULTILINE)}
    assert told == {*codes, errors.EXIT_OK, errors.EXIT_INTERRUPTED, click.UsageError.exit_code}


def test_commands_stand_in_the_order_of_work():
    names = cli.list_commands(click.Context(cli))
    assert names[:3] == ["init", "import", "check"]
    assert names[-1] == "schema"


def test_version():
    outcome = CliRunner().invoke(cli, ["--version"], prog_name="situp-annotate")
    assert outcome.exit_code == 0
    assert outcome.output.startswith("situp-annotate, version ")


def test_wrong_use_exits_with_2():
    assert CliRunner().invoke(cli, ["no-such-command"]).exit_code == 2
    assert CliRunner().invoke(cli, ["check"]).exit_code == 2


@pytest.mark.parametrize(
    ("raised", "code", "stderr"),
    [
        (errors.ManifestError("m.json: $: one."), 3, "Error: m.json: $: one.\n"),
        (
            errors.ManifestError("m.json: one.\nm.json: two."),
            3,
            "Error:\nm.json: one.\nm.json: two.\n",
        ),
        (errors.RecipeError("No."), 4, "Error: No.\n"),
        (errors.OutputError("No."), 5, "Error: No.\n"),
        (errors.VideoMissingError("No."), 1, "Error: No.\n"),
        (KeyboardInterrupt(), 130, "Interrupted.\n"),
    ],
)
def test_errors_become_messages_and_exit_codes(raised, code, stderr):
    @click.command()
    def fail():
        raise raised

    outcome = CliRunner().invoke(SitupGroup(commands={"fail": fail}), ["fail"])
    assert (outcome.exit_code, outcome.stderr, outcome.stdout) == (code, stderr, "")


def test_an_unexpected_error_keeps_its_traceback():
    @click.command()
    def fail():
        raise ZeroDivisionError

    outcome = CliRunner().invoke(SitupGroup(commands={"fail": fail}), ["fail"])
    assert isinstance(outcome.exception, ZeroDivisionError)


def test_main_exits_with_the_error_s_code(tmp_path):
    outcome = run_in_process("check", str(tmp_path / "none.json"), capture_output=True)
    assert outcome.returncode == 3
    assert outcome.stdout == ""
    assert outcome.stderr.startswith(f"Error: {tmp_path / 'none.json'}: there is no such file")


def test_a_reader_that_goes_away_is_no_error_message():
    reading, writing = os.pipe()
    os.close(reading)
    try:
        outcome = run_in_process("schema", stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert outcome.stderr == ""
