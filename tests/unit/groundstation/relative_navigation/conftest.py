"""Randomness of these tests."""

import numpy as np
import pytest


@pytest.fixture
def rng(request):
    """A generator of its own for every test, the same each time."""
    return np.random.default_rng(sum(map(ord, request.node.name)))
