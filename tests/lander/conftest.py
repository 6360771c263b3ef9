"""The reference landing and its nominal descent, shared by the tests."""

import pytest

from tests.lander.reference_landing import reference_landing


@pytest.fixture(scope="session")
def reference():
    return reference_landing()


@pytest.fixture(scope="session")
def nominal(reference):
    """The nominal descent in continuous time: outcome, end state, history at 1 s."""
    return reference.fly_law()
