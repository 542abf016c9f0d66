"""Manifests: the JSON file that says which videos to annotate and what a person drew in them."""

from situp_annotate.formats.manifest.loading import Manifest, dump_manifest, load_manifest
from situp_annotate.formats.manifest.schema import manifest_schema

__all__ = ["Manifest", "dump_manifest", "load_manifest", "manifest_schema"]
