"""A merge comes and goes in a workspace while its size is looked at."""

import shutil
import threading

from watched import Watched


def test_what_goes_while_it_is_looked_at_is_passed_over(tmp_path):
    done = threading.Event()

    def come_and_go():
        while not done.is_set():
            for k in range(5):
                (tmp_path / f"merge-{k}" / "parts").mkdir(parents=True)
                (tmp_path / f"merge-{k}" / "parts" / "tile-0").write_bytes(bytes(1000))
            for k in range(5):
                shutil.rmtree(tmp_path / f"merge-{k}")

    merging, watched = threading.Thread(target=come_and_go), Watched(tmp_path)
    merging.start()
    try:
        for number in range(2000):
            watched.told(str(number), 0)
    finally:
        done.set()
        merging.join()
    assert 1 <= watched.blocks <= 5
    assert 0 < watched.most_mb <= 5 * 1000 / 1e6
