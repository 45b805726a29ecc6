"""What hatch_build.py compiles: whole folders, with the folders in them."""

import importlib.util
import subprocess
import sys
import sysconfig
from pathlib import Path
from shutil import which
from types import SimpleNamespace

import pytest
from build_hook import build_hook, compiled_files

ROOT = Path(__file__).parents[2]


@pytest.fixture
def hook():
    """hatch_build.py, without the builder that calls it."""
    return build_hook()


def test_all_modules_of_a_compiled_folder_are_compiled_but_those_left_alone(hook):
    compiled = {file for entry in hook.COMPILED for file in hook._files(ROOT / entry)}
    folders = [ROOT / entry for entry in hook.COMPILED if (ROOT / entry).is_dir()]
    assert folders
    missing = {file.name for folder in folders for file in folder.rglob("*.py") if file not in compiled}
    assert missing == hook.LEFT_ALONE
    assert ROOT / "core/flockwire_core/control/around/planner.py" in compiled
    assert all(file.is_file() for file in compiled)


def test_the_form_that_is_tested_is_that_of_the_environment():
    """The wheel is compiled, and nothing of the checkout is imported beside it; else all is of the checkout."""
    made = Path(sys.prefix, "flockwire-made")
    form = made.read_text().strip() if made.exists() else "editable"
    modules = (".".join(file.relative_to(ROOT).with_suffix("").parts[1:]) for file in compiled_files())
    origins = {Path(str(importlib.util.find_spec(module).origin)) for module in modules}
    assert {origin.suffix for origin in origins} == {".so" if form == "compiled" else ".py"}
    inside = ROOT.glob("*/flockwire*") if form == "editable" else [Path(sys.prefix)]
    folders = [folder.resolve() for folder in inside]
    assert all(any(origin.is_relative_to(folder) for folder in folders) for origin in origins)


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_compilers_accept_the_flags_that_pack_the_code(hook, tmp_path, compiler):
    """Python's headers may be missing, and one of the compilers."""
    headers = Path(sysconfig.get_path("include"))
    if which(compiler) is None or not (headers / "Python.h").is_file() or sys.platform != "linux":
        pytest.skip(f"needs {compiler} and Python.h, on Linux")
    mypyc = Path(pytest.importorskip("mypyc").__file__).parent / "lib-rt"
    library = SimpleNamespace(name="flockwire__mypyc", extra_compile_args=["-Werror"], extra_link_args=[])
    hook._pack([library], tmp_path / "cold.h")
    (tmp_path / "empty.c").write_text("#include <Python.h>\n#include <CPy.h>\n")
    flags = ["-Wno-unused-function", "-Wno-ignored-optimization-argument", *library.extra_compile_args]  # as mypycify
    command = [compiler, "-c", "empty.c", f"-I{headers}", f"-I{mypyc}", *flags]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
