"""What each setting of a preset is worth, and what tuning it does for sequences it has not seen.

    python benchmarks/tuning.py --sequences FOLDER --json FILE [--preset NAME] [--fresh]

FOLDER holds sequences in OTB layout. The preset is run as it is and with single settings changed,
scored by one-pass evaluation. Leave-one-sequence-out: for each sequence the candidate is taken that
is best on all the others, by mean AUC, and scored on the one left out; the mean of those is what
tuning on such sequences gives on others. Finished runs stay in a folder beside FILE.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import click
import numpy as np

from situp_annotate.evaluation.evaluation_files import Plan, evaluate_trackers

CHANGES = (
    "padding=3",
    "padding=5",
    "template_side=[0,1e9]",
    "template_side=[80,128]",
    "template_side=[128,200]",
    "support=1",
    "support=1.5",
    "label_sigma=0.1",
    "learning_rate=0.005",
    "learning_rate=0.02",
    "scale_factors=[1,0.99,1.01]",
    "scale_factors=[1,0.98,0.99,1.01,1.02]",
    "scale_criterion=max",
    "scale_criterion=psr",
    "scale_factors=[1],scale_search=filter",
    "subcell=false",
    "window=target",
    "filter=dual,learning_rate=0.004",
)
REFERENCE = "situp"

Aucs = Mapping[str, Mapping[str, float]]


def left_out(aucs: Aucs) -> tuple[dict[str, str], float]:
    """What is taken for each sequence, and the mean over all targets of what that gives.

    Parameters
    ----------
    aucs : mapping
        By candidate and target; targets are called SEQUENCE or SEQUENCE.NUMBER.
    """
    targets = list(next(iter(aucs.values())))
    taken, scores = {}, []
    for sequence in dict.fromkeys(target.partition(".")[0] for target in targets):
        own = [target for target in targets if target.partition(".")[0] == sequence]
        others = [target for target in targets if target not in own]
        taken[sequence] = max(aucs, key=lambda name: np.mean([aucs[name][t] for t in others]))
        scores += [aucs[taken[sequence]][target] for target in own]
    return taken, float(np.mean(scores))


@click.command(help=__doc__)
@click.option("--sequences", type=click.Path(exists=True, path_type=Path), required=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), required=True)
@click.option("--preset", default="accurate", show_default=True)
@click.option("--fresh", is_flag=True, help="Run anew what is there from before.")
@click.option("--workers", default=2, show_default=True, help="runs at a time")
def main(sequences: Path, json_path: Path, preset: str, workers: int, *, fresh: bool) -> None:
    """Run, print a table and write the figures."""
    names = [preset, *(f"{preset}:{change}" for change in CHANGES)]
    folder = json_path.with_suffix(".evaluation")
    evaluate_trackers(Plan(sequences, folder, [REFERENCE, *names], workers=workers, fresh=fresh))
    found = json.loads((folder / "evaluation.json").read_bytes())["trackers"]
    aucs = {
        name: {target: each["auc"] for target, each in tracker["ope"]["targets"].items()}
        for name, tracker in found.items()
    }
    print("| setting | AUC | precision | best without |\n|---|---|---|---|")
    taken, tuned = left_out({name: aucs[name] for name in names})
    for name in (REFERENCE, *names):
        overall = found[name]["ope"]["sets"]["all"]
        without = ", ".join(sequence for sequence, best in taken.items() if best == name)
        setting = name.partition(":")[2] or f"**{name}**"
        print(f"| {setting} | {overall['auc']:.3f} | {overall['precision']:.3f} | {without} |")
    reference = float(np.mean(list(aucs[REFERENCE].values())))
    bars = {"tuned_left_out_auc": tuned, "reference_auc": reference, "gain": tuned - reference}
    print(json.dumps(bars, indent=2))
    json_path.write_text(json.dumps({"bars": bars, "taken": taken, "auc": aucs}, indent=2) + "\n")


if __name__ == "__main__":
    main()
