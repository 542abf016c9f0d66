"""Search for what breaks a reader of text from outside, led by the code that is run (Atheris).

The readers, and what has to hold of them, are those of ``support.readers``, which the tests search
too, for a few seconds. Atheris comes with the extra ``fuzz`` and needs a Python that it has a wheel
for::

    pip install -e .[test,fuzz]
    python tests/fuzz/atheris_readers.py --seconds 1500 --json fuzz.json

Each reader is searched in a process of its own, one after the other, for an equal share of the
time; it ends with what it finds first. The JSON file has, for each: inputs tried, places in the
code and features that they reached, memory, and the finding, whose input is kept in ``--findings``.
Exit codes: 0 when nothing was found, 1 otherwise.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

_INSTRUMENTED = ["situp_annotate", "zipfile", "tomllib", "configparser"]
_COMPILED = ["situp_annotate.propagation.thinning"]
"""Numba cannot compile what is instrumented."""

_TIMEOUT_S = 20
"""For one input; what takes longer counts as a hang."""

_MEMORY_MB = 1024
_MOST_BYTES = 8192
_WORDS = ["1e999", "nan", "-1", "2147483648", "9" * 40, "null", "true", "[[[[", "\\ud800", "\ufeff"]
_STATUS = re.compile(r"^#\d+\s+\w+\s+cov: (\d+) ft: (\d+)", re.MULTILINE)
_EXECUTED = re.compile(r"^stat::number_of_executed_units:\s*(\d+)", re.MULTILINE)
_MEMORY = re.compile(r"^stat::peak_rss_mb:\s*(\d+)", re.MULTILINE)


def _search(name: str, arguments: list[str]) -> None:
    """Give one reader whatever libFuzzer makes up, until the time is over; does not return."""
    import atheris

    with atheris.instrument_imports(include=_INSTRUMENTED, exclude=_COMPILED):
        from support.readers import READERS, check

    reader = READERS[name]
    with tempfile.TemporaryDirectory() as folder:
        for text in reader.texts:  # so that what is loaded or compiled when needed is there
            check(reader, Path(folder), reader.packed(text))
        atheris.Setup([sys.argv[0], *arguments], lambda data: check(reader, Path(folder), data))
        atheris.Fuzz()


def _prepare(name: str, folder: Path) -> list[str]:
    """Write what the search starts from: valid files, and the words that are in them."""
    from support.readers import READERS

    reader = READERS[name]
    corpus = folder / "corpus"
    corpus.mkdir()
    words = set(_WORDS)
    for number, text in enumerate(reader.texts):
        (corpus / str(number)).write_bytes(reader.packed(text))
        words |= set(re.findall(r"[\w.$/-]{2,40}", text))
    dictionary = folder / "dictionary"
    escaped = ("".join(f"\\x{byte:02x}" for byte in word.encode()) for word in sorted(words))
    dictionary.write_text("".join(f'"{word}"\n' for word in escaped))
    return [str(corpus), f"-dict={dictionary}"]


def _number(pattern: re.Pattern[str], text: str, group: int = 1) -> int | None:
    found = pattern.findall(text)
    if not found:
        return None
    last = found[-1]
    return int(last[group - 1] if isinstance(last, tuple) else last)


def _result(name: str, seconds: int, findings: Path) -> dict[str, object]:
    """Search one reader in a process of its own, and say what came of it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, __file__, "--search", name, *_prepare(name, Path(folder))]
        command += [f"-max_total_time={seconds}", f"-timeout={_TIMEOUT_S}"]
        command += [f"-rss_limit_mb={_MEMORY_MB}", f"-max_len={_MOST_BYTES}"]
        command += ["-print_final_stats=1", f"-artifact_prefix={findings / name}-"]
        started = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    said = done.stdout + done.stderr
    return {
        "reader": name,
        "seconds": round(time.monotonic() - started, 1),
        "executions": _number(_EXECUTED, said),
        "coverage": _number(_STATUS, said),
        "features": _number(_STATUS, said, 2),
        "peak_rss_mb": _number(_MEMORY, said),
        "finding": done.stdout[-3000:] + done.stderr[-1000:] if done.returncode else None,
    }


def main() -> None:
    """Search the readers that the command line names, or all."""
    if sys.argv[1:2] == ["--search"]:
        _search(sys.argv[2], sys.argv[3:])
    from support.readers import READERS

    parser = argparse.ArgumentParser(description="Search for what breaks a reader of text.")
    parser.add_argument("--seconds", type=int, default=600, help="for all readers together")
    parser.add_argument("--json", type=Path, required=True, help="file to write")
    parser.add_argument("--findings", type=Path, default=Path("findings"), help="folder for inputs")
    parser.add_argument("--reader", action="append", choices=[*READERS], help="only this one")
    chosen = parser.parse_args()
    names = chosen.reader or [*READERS]
    chosen.findings.mkdir(parents=True, exist_ok=True)
    results = []
    for name in names:
        results.append(_result(name, max(chosen.seconds // len(names), 1), chosen.findings))
        sys.stdout.write(f"{name}: {results[-1]['executions']} inputs\n")
        chosen.json.write_text(json.dumps(results, indent=2) + "\n")
    sys.exit(any(result["finding"] for result in results))


if __name__ == "__main__":
    main()
