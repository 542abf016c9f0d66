"""What TrackEval says of files in MOTChallenge's layout."""

import contextlib
import io
import warnings

import numpy as np


def trackeval_scores(truth, results, sequence, *, preprocess=False):
    """HOTA, MOTA and IDF1 of a result, by TrackEval.

    Ground truth is ``truth/<sequence>/gt/gt.txt`` with ``seqinfo.ini``; the result is
    ``results/<sequence>.txt``. With `preprocess`, as MOT17 is scored: pedestrians only, and
    without what finds persons on vehicles, static persons, distractors and reflections.
    """
    import trackeval

    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")  # TrackEval's own
        quiet = {"PRINT_CONFIG": False}
        evaluator = trackeval.Evaluator(
            {**trackeval.Evaluator.get_default_eval_config(), **quiet, "PRINT_RESULTS": False,
             "OUTPUT_SUMMARY": False, "OUTPUT_DETAILED": False, "PLOT_CURVES": False,
             "BREAK_ON_ERROR": True, "USE_PARALLEL": False, "TIME_PROGRESS": False}
        )  # fmt: skip
        dataset = trackeval.datasets.MotChallenge2DBox(
            {**trackeval.datasets.MotChallenge2DBox.get_default_dataset_config(), **quiet,
             "GT_FOLDER": str(truth), "TRACKERS_FOLDER": str(results.parent),
             "TRACKERS_TO_EVAL": [results.name], "TRACKER_SUB_FOLDER": "",
             "SEQ_INFO": {sequence: None}, "SKIP_SPLIT_FOL": True, "DO_PREPROC": preprocess}
        )  # fmt: skip
        kinds = (trackeval.metrics.HOTA, trackeval.metrics.CLEAR, trackeval.metrics.Identity)
        found, _ = evaluator.evaluate([dataset], [kind() for kind in kinds])
    scores = found["MotChallenge2DBox"][results.name][sequence]["pedestrian"]
    hota = float(np.mean(scores["HOTA"]["HOTA"]))
    return hota, float(scores["CLEAR"]["MOTA"]), float(scores["Identity"]["IDF1"])
