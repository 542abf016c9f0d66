"""review.csv, row by row."""

from situp_annotate.formats.review import ranked, review_csv
from situp_annotate.propagation import Reason, Suggestion

SUGGESTIONS = [
    Suggestion(1, 30, Reason.LOST, 0.25, 7.26),
    Suggestion(1, 3, Reason.BORDER, 0.5, 0.94),
    Suggestion(2, 31, Reason.DISAGREE, 0.33333, 33.96),
    Suggestion(2, 3, Reason.CONFIDENCE, 0.75, 0.94),
]


def test_rows_are_ranked_over_all_tracks():
    times_ns = [index * 33_366_667 for index in range(40)]
    text = review_csv(SUGGESTIONS, {1: "car", 2: "dog, black"}, times_ns)
    assert text.splitlines() == [
        "rank,track_id,label,frame,time_s,reason,confidence,gain",
        '1,2,"dog, black",31,1.034,passes disagree,0.333,34.0',
        "2,1,car,30,1.001,target lost,0.250,7.3",
        "3,1,car,3,0.100,near the border,0.500,0.9",
        '4,2,"dog, black",3,0.100,confidence dips,0.750,0.9',
    ]
    assert text.endswith("\n")
    assert "\r" not in text


def test_the_order_does_not_depend_on_that_of_the_suggestions():
    assert ranked(SUGGESTIONS) == ranked(SUGGESTIONS[::-1])


def test_without_suggestions_there_is_a_header():
    assert review_csv([], {}, []).count("\n") == 1
