"""scripts/release: refuses what is no release, and makes all of its files but the upload."""

import hashlib
import json
import os
import re
import subprocess
import tomllib
from pathlib import Path

import pytest

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
VERSION = PROJECT["project"]["version"]


@pytest.fixture
def clone(tmp_path):
    """Return a function that runs a program in a clone of the repository."""
    subprocess.run(["git", "clone", "--quiet", "--no-tags", ROOT, tmp_path / "tree"], check=True)
    paths = os.pathsep.join([str(ROOT / ".uv/bin"), os.environ["PATH"]])
    named = {f"GIT_{who}_{what}": "a@b" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}

    def run(*line):
        environment = {**os.environ, **named, "PATH": paths}
        return subprocess.run(line, cwd=tmp_path / "tree", env=environment, capture_output=True, text=True, check=False)

    return tmp_path / "tree", run


def test_a_tag_becomes_a_release_with_its_sums_and_its_dependencies(clone):
    tree, run = clone
    (tree / "scripts/release").write_text((ROOT / "scripts/release").read_text())
    assert "HEAD has no tag" in run("scripts/release").stderr
    changes = tree / "CHANGELOG.md"
    changes.write_text(re.sub("^## .*$", f"## {VERSION}, 2026-12-01", changes.read_text(), count=1, flags=re.MULTILINE))
    assert run("git", "commit", "--quiet", "--all", "--message", VERSION, "--allow-empty").returncode == 0
    run("git", "tag", "v0.0.0")
    assert f"tag = v0.0.0: must be v{VERSION}" in run("scripts/release").stderr
    run("git", "tag", "--delete", "v0.0.0")
    run("git", "tag", f"v{VERSION}")
    (tree / "note").write_text("")
    assert "not committed" in run("scripts/release").stderr
    (tree / "note").unlink()
    done = run("scripts/release")
    assert done.returncode == 0, done.stderr
    out = tree / "dist/release"
    listed = dict(reversed(line.split()) for line in (out / "SHA256SUMS").read_text().splitlines())
    assert set(listed) == {f"flockwire-{VERSION}{end}" for end in (".tar.gz", "-py3-none-any.whl", ".cdx.json")}
    assert all(hashlib.sha256((out / name).read_bytes()).hexdigest() == digest for name, digest in listed.items())
    sbom = json.loads((out / f"flockwire-{VERSION}.cdx.json").read_text())
    assert sbom["bomFormat"] == "CycloneDX"
    assert {"eclipse-zenoh", "pydantic", "matplotlib"} <= {one["name"] for one in sbom["components"]}
    assert "pytest" not in {one["name"] for one in sbom["components"]}


def test_compiled_wheels_are_for_the_pythons_that_the_package_names():
    named = [line.rpartition(" ")[2] for line in PROJECT["project"]["classifiers"] if ":: Python :: 3." in line]
    assert PROJECT["tool"]["cibuildwheel"]["build"] == [f"cp{one.replace('.', '')}-manylinux*" for one in named]
