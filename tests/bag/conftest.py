import pytest

from tests.bag.sample_bags import write_bag


@pytest.fixture(scope="session")
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp("bags") / "hop")
