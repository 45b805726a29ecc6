import subprocess


def test_an_installer_refuses_a_file_that_is_not_what_was_deployed(bundled, tmp_path):
    folder = bundled / "pi1"
    (folder / "swarm" / "swarm.toml").write_text("another")
    identity = tmp_path / "id"  # the check of root comes first
    identity.mkdir()
    (identity / "id").write_text("#!/bin/sh\necho 0\n")
    (identity / "id").chmod(0o755)
    done = subprocess.run(
        [folder / "install.sh"], capture_output=True, text=True, check=False, env={"PATH": f"{identity}:/usr/bin:/bin"}
    )
    assert done.returncode == 2
    assert "install: a file is not what was deployed" in done.stderr
