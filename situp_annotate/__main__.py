"""``python -m situp_annotate``: the same as the command ``situp-annotate``."""

from situp_annotate.cli import main

main()
