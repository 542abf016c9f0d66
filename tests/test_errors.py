"""Errors cross processes and carry their exit codes."""

import pickle

import pytest

from situp_annotate import errors

CLASSES = [getattr(errors, name) for name in errors.__all__ if name.endswith("Error")]


@pytest.mark.parametrize("kind", CLASSES)
def test_errors_can_be_pickled(kind):
    error = pickle.loads(pickle.dumps(kind("A finished sentence.")))
    assert type(error) is kind
    assert str(error) == "A finished sentence."


def test_kinds_are_distinct_and_drawn_in_the_tree():
    assert len({kind.kind for kind in CLASSES}) == len(CLASSES)
    assert all(kind.__name__ in (errors.__doc__ or "") for kind in CLASSES)


def test_exit_codes_are_as_documented():
    by_code = {kind.exit_code for kind in CLASSES}
    assert by_code == {1, 3, 4, 5}
    assert (errors.EXIT_OK, errors.EXIT_FAILED, errors.EXIT_INTERRUPTED) == (0, 1, 130)
