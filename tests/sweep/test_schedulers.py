"""The ready files for schedulers: their own readers take them, and what they run is the command that there is."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import yaml
from typer.main import get_command

from flight_graph.cli.app import app

FOLDER = Path(__file__).parents[2] / "examples/campaigns"


def commands():
    """(file, words) of every line in which flight is run."""
    for path in sorted(FOLDER.iterdir()):
        for words in re.findall(r"\bflight (sweep [^\n\"]*)", path.read_text(encoding="utf-8")):
            yield path.name, shlex.split(words, comments=True)


@pytest.mark.parametrize(("name", "words"), commands())
def test_the_commands_exist(name, words):
    known = {option for parameter in get_command(app).commands["sweep"].params for option in parameter.opts}
    assert {word for word in words if word.startswith("--")} <= known


def test_a_shell_takes_the_script():
    assert subprocess.run(["sh", "-n", FOLDER / "slurm.sh"]).returncode == 0


def test_the_job_of_kubernetes_is_indexed():
    job = yaml.safe_load((FOLDER / "kubernetes.yaml").read_text(encoding="utf-8"))
    assert (job["apiVersion"], job["kind"], job["spec"]["completionMode"]) == ("batch/v1", "Job", "Indexed")
    [container] = job["spec"]["template"]["spec"]["containers"]
    assert "$JOB_COMPLETION_INDEX" in container["command"][-1]
