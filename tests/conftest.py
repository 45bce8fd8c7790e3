"""Fixtures shared by the tests."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "agg")
settings.register_profile("default", deadline=None, derandomize=True)
settings.load_profile("default")


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: every run sees the same random input."""
    return np.random.default_rng(20240517)
