"""What a TOML file is: a recipe, or something else."""

import tomllib
from dataclasses import fields
from pathlib import Path

from situp_annotate.errors import RecipeError
from situp_annotate.inspection.report import FileReport, count, problem_report
from situp_annotate.recipe import Recipe, load_recipe

__all__ = ["inspect_toml"]

_MAX_BYTES = 2**20


def inspect_toml(path: Path) -> FileReport:
    """Look at a TOML file."""
    if path.stat().st_size > _MAX_BYTES:
        message = "It is larger than 1 MiB, and so no recipe."
        return problem_report(path, "unknown", "a large TOML file", message)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        message = f"It is not valid TOML: {error}."
        return problem_report(path, "recipe", "TOML, not readable", message, remark_kind="toml")
    sections = {field.name for field in fields(Recipe)}
    if document and sections.isdisjoint(document):
        message = (
            f"TOML with {', '.join(list(document)[:8])[:200]}, but no section of a recipe "
            f"({', '.join(sorted(sections))})."
        )
        return problem_report(path, "unknown", "TOML of an unknown kind", message)
    try:
        load_recipe(path.absolute())
    except RecipeError as error:
        message = str(error).removeprefix(f"{path.absolute()}: ")
        return problem_report(path, "recipe", "recipe, not valid", message, remark_kind="recipe")
    facts = tuple(
        (name, ", ".join(f"{key} = {value}" for key, value in values.items()))
        for name, values in document.items()
    )
    settings = sum(len(values) for values in document.values())
    return FileReport(path, "recipe", f"recipe, {count(settings, 'setting')}", facts)
