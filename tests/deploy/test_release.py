"""scripts/release: refuses what is no release, and makes all of its files but the upload."""

import hashlib
import json
import os
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]


@pytest.fixture
def clone(tmp_path):
    """Return a function that runs a program in a clone of the repository."""
    subprocess.run(["git", "clone", "--quiet", ROOT, tmp_path / "tree"], check=True)
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
    changes.write_text(changes.read_text().replace("## 0.1.0, unreleased", "## 0.1.0, 2026-12-01"))
    assert run("git", "commit", "--quiet", "--all", "--message", "0.1.0", "--allow-empty").returncode == 0
    run("git", "tag", "v0.2.0")
    assert "tag = v0.2.0: must be v0.1.0" in run("scripts/release").stderr
    run("git", "tag", "--delete", "v0.2.0")
    run("git", "tag", "v0.1.0")
    (tree / "note").write_text("")
    assert "not committed" in run("scripts/release").stderr
    (tree / "note").unlink()
    done = run("scripts/release")
    assert done.returncode == 0, done.stderr
    out = tree / "dist/release"
    listed = dict(reversed(line.split()) for line in (out / "SHA256SUMS").read_text().splitlines())
    assert set(listed) == {"flockwire-0.1.0.tar.gz", "flockwire-0.1.0-py3-none-any.whl", "flockwire-0.1.0.cdx.json"}
    assert all(hashlib.sha256((out / name).read_bytes()).hexdigest() == digest for name, digest in listed.items())
    sbom = json.loads((out / "flockwire-0.1.0.cdx.json").read_text())
    assert sbom["bomFormat"] == "CycloneDX"
    assert {"eclipse-zenoh", "pydantic", "matplotlib"} <= {one["name"] for one in sbom["components"]}
    assert "pytest" not in {one["name"] for one in sbom["components"]}
