import pytest

from grasping_invisible.runtime.errors import BadInput
from grasping_invisible.training.result_tables import markdown, result_tables
from grasping_invisible.training.stored_results import read_results

SCENES = [f"coordination-0{index}" for index in range(2)]


@pytest.fixture
def stored(results_file, result_of):
    """Reads back results of methods on the coordination suite, given their successes of ten runs a scene."""

    def build(**methods):
        files = [
            results_file(
                "coordination",
                method.replace("_", "-"),
                [result_of(scene, seed, seed < wins, 3) for scene in SCENES for seed in range(10)],
            )
            for method, wins in methods.items()
        ]
        return [item for file in files for item in read_results(file)]

    return build


def test_rows_stand_in_the_papers_order_beside_its_figures(stored):
    (table,) = result_tables(stored(ours=9, rand=2, mechanical_search=5))
    assert [row.name for row in table.rows] == ["rand", "ours", "mechanical-search"]
    assert table.scenes == SCENES
    assert table.limits == dict.fromkeys(SCENES, 5)
    text = markdown([table])
    assert "| RAND | 20 | 20.0 % (8.1 % to 41.6 %) | 3.00 (3.00 to 3.00) | 0.00 | 18.3 % | 4.77 ± 0.60 |" in text
    assert "| Coordinator | 20 | 90.0 %" in text
    assert "| 87.5 % | 3.51 ± 0.90 |" in text
    assert "| coordination-00 | 20%, 3.00 | 90%, 3.00 | 50%, 3.00 |" in text
    assert "| coordination | rand | 20 | 0 to 9 | 4 of 4 | `bbbbbbbbbbbb` |" in text
    assert markdown(result_tables(stored(ours=9, rand=2, mechanical_search=5)[::-1])) == text


def test_seeds_are_told_in_ranges_and_what_truth_does_not_confirm_is_told(results_file, result_of):
    runs = [result_of("exploration-00", seed, seed != 4, 2, found_truth=seed != 5) for seed in (0, 1, 2, 4, 5, 1000)]
    text = markdown(result_tables(read_results(results_file("exploration", "ours", runs))))
    assert "| exploration | ours | 6 | 0 to 2, 4 to 5, 1000 | 4 of 5 | `bbbbbbbbbbbb` |" in text


def test_a_bar_in_a_name_ends_no_cell(results_file, result_of):
    file = results_file("coordination", "ours", [result_of("a|b", 0, True, 2)], name="x|y")
    text = markdown(result_tables(read_results(file)))
    assert "| x\\|y | 1 |" in text
    assert "| success, motions | x\\|y |" in text
    assert "| a\\|b | 100%, 2.00 |" in text
    assert "| coordination | x\\|y | 1 |" in text


def test_a_name_that_is_the_same_as_ours_is_ours(stored):
    (table,) = result_tables(stored(coordinator=9))
    assert [row.name for row in table.rows] == ["ours"]


def test_a_bundles_own_name_has_a_table_of_its_own(stored, results_file, result_of):
    runs = [result_of(scene, seed, True, 2) for scene in SCENES for seed in range(10)]
    twins = [
        read_results(results_file("coordination", "ours", runs, name=name, bundle=bundle))
        for name, bundle in (("color+depth+mask", "c"), ("depth+mask", "d"))
    ]
    tables = result_tables([*stored(ours=9, rand=2), *twins[0], *twins[1]])
    assert [[row.name for row in table.rows] for table in tables] == [
        ["rand", "ours"],
        ["depth+mask", "color+depth+mask"],
    ]
    assert len(result_tables([*stored(ours=9), *twins[1]])) == 1  # nothing to stand beside


def test_a_row_is_of_one_bundle_and_counts_no_run_twice(stored, results_file, result_of):
    ours = stored(ours=9)
    with pytest.raises(BadInput, match=r"holds? a run of ours on coordination twice"):
        result_tables([*ours, *ours])
    other = read_results(results_file("coordination", "ours", [result_of(SCENES[0], 99, True, 2)], bundle="c"))
    with pytest.raises(BadInput, match=r"several bundles \(bbbbbbbbbbbb, cccccccccccc\)"):
        result_tables([*ours, *other])


def test_a_row_is_of_one_method(results_file, result_of):
    """`ours` has other names."""
    stored = []
    for seed, method in enumerate(("ours", "coordinator", "rand")):
        stored += read_results(results_file("coordination", method, [result_of("a", seed, True, 2)], name="x"))
    (table,) = result_tables(stored[:2])
    assert [row.overall.runs for row in table.rows] == [2]
    with pytest.raises(BadInput, match=r"x on coordination .* several methods \(coordinator, ours, rand\)"):
        result_tables(stored)


@pytest.mark.parametrize("other", ["ours", "rand"])
def test_a_table_is_of_one_task(results_file, result_of, other):
    before = read_results(results_file("coordination", "ours", [result_of("a", 0, True, 2)], task_sha256="a" * 64))
    after = read_results(results_file("coordination", other, [result_of("a", 1, True, 2)], task_sha256="b" * 64))
    said = "the results on coordination hold runs of 'a' from before and after it changed"
    with pytest.raises(BadInput, match=said):
        result_tables([*before, *after])


def test_results_of_another_suite_make_no_table(results_file, result_of):
    with pytest.raises(BadInput, match="coordination, exploration, invisible"):
        result_tables(read_results(results_file("mine", "ours", [result_of("a", 0, True, 2)])))
