"""``situp-annotate schema``: the JSON Schema of manifests."""

import json

import click

__all__ = ["schema"]


@click.command(short_help="Print the JSON Schema of manifests, for editors.")
def schema() -> None:
    """Print the JSON Schema of manifests, for editors.

    With it, an editor completes keys, explains them, and underlines mistakes while you type:

    \b
      situp-annotate schema > manifest.schema.json

    and, as the first key of the manifest, "$schema": "manifest.schema.json".
    """
    from situp_annotate.formats.manifest import manifest_schema

    click.echo(json.dumps(manifest_schema(), indent=2, ensure_ascii=False))
