"""Flights that several tests look at. Each is flown once, in a folder of its own."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

import ringwing


@pytest.fixture(scope="session")
def dropout(tmp_path_factory: pytest.TempPathFactory) -> ringwing.Run:
    """Six UAVs; the process of UAV 3 is killed at 4 s of 8 s, and link 1->2 loses samples for a second."""
    return ringwing.run(
        "paper-4.2",
        set={"time.duration_s": 8, "control.law": "resilient", "seed": 5},
        faults=["at 4 s kill uav 3", "at 5 s link 1->2 loss 50 % for 1 s"],
        out=tmp_path_factory.mktemp("runs"),
    )


@pytest.fixture(scope="session")
def command() -> str:
    """The command `ringwing`, for what only it can show."""
    found = shutil.which(os.environ.get("RINGWING", "ringwing"))
    if found is None:
        pytest.skip("the command ringwing is not built: set RINGWING to it")
    return found


@pytest.fixture()
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path
