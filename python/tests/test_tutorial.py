"""The code of the tutorial about a law of one's own runs as printed, and prints what the tutorial says."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

TUTORIAL = Path(__file__).parents[2] / "docs" / "src" / "tutorials" / "own-law.md"


def blocks(language: str) -> list[str]:
    """The code blocks of this language."""
    return re.findall(rf"```{language}\n(.*?)```", TUTORIAL.read_text(), re.DOTALL)


def printed(script: str, folder: Path) -> str:
    """What ``script`` prints beside the tutorial's controller."""
    run = subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_the_tutorial_about_a_law_of_ones_own_prints_what_it_says(tmp_path: Path) -> None:
    mine, one_uav, noting, delays = blocks("python")
    (tmp_path / "mine.py").write_text(mine)
    passed, slot_error_m = printed(one_uav, tmp_path).split()
    assert passed == "True" and float(slot_error_m) < 1e-6
    # The noting lines replace the last line of `step`.
    without = mine[: mine.rindex("        return")]
    (tmp_path / "noting.py").write_text(without + noting)
    script = one_uav.replace("from mine", "from noting") + 'print(*run.log.uav(3).notes["angle_rad"].shape)'
    assert printed(script, tmp_path).split()[:2] == [passed, slot_error_m]
    assert int(printed(script, tmp_path).split()[2]) > 5000
    assert [printed(delays, tmp_path)] == blocks("text")


def test_the_tutorials_mistake_is_found_in_the_runs_folder(command: str, tmp_path: Path) -> None:
    mine = blocks("python")[0].replace("def step(self, s):", "def step(self, s):\n        1 / 0")
    (tmp_path / "mine.py").write_text(mine)
    words = ["run", "paper-4.1", "--duration", "3", "--agent", f"3={sys.executable} mine.py"]
    run = subprocess.run([command, *words], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert "uav 3 gave up (exit status 1)" in run.stderr, run.stderr
    kept = tmp_path / "runs" / "latest" / "output" / "uav-3.txt"
    assert "ZeroDivisionError" in kept.read_text()
