"""Whether two output folders hold the same, and nothing that was left half done."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

UNCOMPARED = ("logs", ".run")
UNFINISHED = (".partial", ".old", ".tmp")
CIRCUMSTANCES = ("started_at", "elapsed_s", "workers", "seconds", "cache")
"""What ``batch.json`` says that another run with the same outcome would not."""


def entries_in(output: Path) -> dict[str, Path]:
    """The files and folders that are to be compared, by their names."""
    names = {path.relative_to(output): path for path in output.rglob("*")}
    return {str(name): path for name, path in names.items() if name.parts[0] not in UNCOMPARED}


def mcap_content(path: Path) -> list[Any]:
    """Everything that an MCAP file says, in its order."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        messages = [
            (schema and (schema.name, schema.data), channel.topic, channel.metadata, message)
            for schema, channel, message in reader.iter_messages()
        ]
        return [messages, [*reader.iter_metadata()], [*reader.iter_attachments()]]


def without_circumstances(batch: Path) -> Any:  # noqa: ANN401
    """What ``batch.json`` says, but for what differs from run to run."""

    def kept(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        return {key: value for key, value in pairs if key not in CIRCUMSTANCES}

    return json.loads(batch.read_bytes(), object_pairs_hook=kept)


def arrays_in(path: Path) -> dict[str, tuple[str, tuple[int, ...], bytes]]:
    """Arrays of a file of the cache."""
    with np.load(path) as arrays:
        return {
            name: (str(arrays[name].dtype), arrays[name].shape, arrays[name].tobytes())
            for name in arrays.files
        }


def is_same(wanted: Path, found: Path) -> bool:
    """Whether two files say the same, or two are folders."""
    if wanted.is_dir() or found.is_dir():
        return wanted.is_dir() and found.is_dir()
    if wanted.read_bytes() == found.read_bytes():
        return True
    if wanted.suffix == ".mcap":
        return mcap_content(wanted) == mcap_content(found)
    if wanted.suffix == ".npz":
        return arrays_in(wanted) == arrays_in(found)
    if wanted.name == "batch.json":
        return bool(without_circumstances(wanted) == without_circumstances(found))
    return False


def differences(wanted: Path, found: Path) -> list[str]:
    """What is not the same in two output folders."""
    before, after = entries_in(wanted), entries_in(found)
    lines = [f"{name} is missing" for name in before.keys() - after.keys()]
    lines += [f"{name} is too much" for name in after.keys() - before.keys()]
    shared = before.keys() & after.keys()
    lines += [f"{name} differs" for name in shared if not is_same(before[name], after[name])]
    return sorted(lines)


def halves(wanted: list[Path], found: Path) -> list[str]:
    """Which of the videos' folders that can be seen are as in none of the wanted outputs."""
    videos = {path.parent.name for path in wanted[0].glob("*/summary.json")}
    return [
        f"{name} is not whole: {differences(wanted[0] / name, found / name)}"
        for name in sorted(videos)
        if (found / name).exists()
        and all(differences(output / name, found / name) for output in wanted)
    ]


def left_behind(output: Path, temporary: Path) -> list[str]:
    """Files that nobody needs any more."""
    stray = [path for path in output.rglob("*") if path.suffix in UNFINISHED]
    return [f"{path} was left behind" for path in (*stray, *temporary.iterdir())]
