from pathlib import Path

import cv2

from grasping_invisible.training.result_charts import draw_chart
from grasping_invisible.training.result_tables import result_tables
from grasping_invisible.training.stored_results import read_results


def test_the_same_results_give_the_same_picture_and_others_another(tmp_path: Path, results_file, result_of):
    def drawn(name: str, wins: int) -> bytes:
        runs = [result_of(f"exploration-0{scene}", seed, seed < wins, 2) for scene in range(4) for seed in range(5)]
        file = results_file("exploration", "ours", runs, bundle=name)
        (table,) = result_tables(read_results(file))
        draw_chart(table, tmp_path / f"{name}.png")
        return (tmp_path / f"{name}.png").read_bytes()

    first = drawn("a", 4)
    assert first == drawn("b", 4)
    assert first != drawn("c", 1)
    picture = cv2.imread(str(tmp_path / "a.png"))
    assert picture is not None
    ours = (picture == (0x2E, 0x10, 0xC8)).all(axis=2)  # BGR
    assert ours.mean() > 0.05  # bars in our colour
