"""The images of a swarm of containers; in .ci/run they are built beside the first flights, and flown last."""

import pytest
from containers import IMAGE, OPERATOR, image, missing, run


@pytest.mark.long
def test_both_images_are_built_and_run_nothing_as_root():
    if line := missing():
        pytest.skip(f"containers: {line}")
    image()
    for name in (IMAGE, OPERATOR):
        assert run("docker", "image", "inspect", "--format", "{{.Config.User}}", name).stdout == "10001:10001\n"
