"""Fixtures that every test may use."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder of evaluation data that is not part of the project; named by SITUP_SHARED."""
    folder = os.environ.get("SITUP_SHARED")
    if not folder:
        pytest.skip("SITUP_SHARED is not set: evaluation data are not at hand")
    return Path(folder)
