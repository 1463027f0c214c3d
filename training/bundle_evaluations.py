"""What stored results say of a bundle, written into its manifest."""

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import msgspec

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.runtime.manifest import Evaluation, read_manifest, write_manifest
from grasping_invisible.training.evaluation_summary import rates_of
from grasping_invisible.training.stored_results import (
    StoredResult,
    check_counted_once,
    check_one_method,
    check_one_task,
)


def note_evaluations(folder: Path, stored: Iterable[StoredResult]) -> tuple[Evaluation, ...]:
    """Write into a bundle's manifest what was measured with it, in place of what was noted before.

    Results of other bundles are left aside. Raises `BadInput` where all are, a run comes twice or a scene changed in
    between, and `BundleError`.
    """
    manifest = read_manifest(folder)
    groups: dict[tuple[str, str], list[StoredResult]] = defaultdict(list)
    others: set[str] = set()
    for item in stored:
        if item.measured.bundle_sha256 == manifest.sha256:
            groups[item.measured.suite, item.measured.name].append(item)
        else:
            others.add(item.measured.bundle_sha256[:12])
    if not groups:
        raise BadInput(f"no result of bundle {manifest.sha256[:12]} ({folder}), only of {', '.join(sorted(others))}")
    evaluations = tuple(_evaluation(suite, method, groups[suite, method]) for suite, method in sorted(groups))
    write_manifest(folder, msgspec.structs.replace(manifest, evaluations=evaluations))
    return evaluations


def _evaluation(suite: str, method: str, stored: list[StoredResult]) -> Evaluation:
    check_counted_once(stored, f"{method} on {suite}")
    check_one_method(stored, f"{method} on {suite}")
    check_one_task(stored, f"the results of {method} on {suite}")
    rates = rates_of([item.result for item in stored])
    return Evaluation(
        suite=suite,
        method=method,
        runs=rates.runs,
        success_rate=rates.success_rate,
        success_interval=rates.success_interval,
        motions_mean=rates.motions_mean,
        source_commits=tuple(sorted({item.source_commit for item in stored})),
    )
