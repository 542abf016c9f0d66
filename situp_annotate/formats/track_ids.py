"""Numbers for imported tracks, where a file gives them no usable ones."""

from collections.abc import Sequence

__all__ = ["free_track_ids"]

_MAX_ID = 2**31 - 1


def free_track_ids(wanted: Sequence[int | None]) -> list[int]:
    """Give each track of a video an id of its own, from 1.

    Parameters
    ----------
    wanted : sequence of int or None
        The ids that the file gives, if any.

    Returns
    -------
    list of int
        In the same order: the wanted id, where it can be one and no track before has it; else
        the next that nobody wants.
    """
    taken = {number for number in wanted if number is not None and 1 <= number <= _MAX_ID}
    free = (number for number in range(1, _MAX_ID) if number not in taken)
    left = set(taken)
    ids = []
    for number in wanted:
        if number in left:
            left.remove(number)
            ids.append(number)
        else:
            ids.append(next(free))
    return ids
