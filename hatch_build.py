"""Compiles the modules of the 100 Hz path with mypyc, where that is asked for (scripts/compile, scripts/fly).

The code is the same; compiled it takes about half the time, which studies are glad of.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TRACKED = ("completeness", "core", "field_bodies", "relative_sensor", "tracking")
MULTIROTOR = ("airframe", "fitted", "rotors", "vehicle")
COMPILED = (
    "core/flockwire_core/control",
    "core/flockwire_core/domain",
    *(
        f"core/flockwire_core/wire/{name}.py"
        for name in ("batch", "cdr", "codec", "inbox", "orders", "phase", "sighting", "status")
    ),
    "core/flockwire_core/pilot",
    *(f"core/flockwire_core/ground/{name}.py" for name in ("fleet", "order_log")),
    *(f"core/flockwire_core/process/{name}.py" for name in ("corrected_clock", "stepping", "timekeeping")),
    *(f"core/flockwire_core/runtime/{name}.py" for name in ("samples", "shell", "ticker", "topics")),
    "core/flockwire_core/clock.py",
    "core/flockwire_core/law.py",
    "agent/flockwire_agent",
    "leader/flockwire_leader",
    *(f"mocap_gateway/flockwire_mocap/{name}.py" for name in TRACKED),
    *(f"twins/flockwire_twins/kinematics/{name}.py" for name in ("airframe", "core", "drone")),
    *(f"twins/flockwire_twins/multirotor/{name}.py" for name in MULTIROTOR),
    "twins/flockwire_twins/trackers/cameras.py",
    *(f"recorder/flockwire_recorder/{name}.py" for name in ("chunked", "trace")),
    *(
        f"analysis/flockwire_analysis/{name}.py" for name in ("collecting", "columns")
    ),  # 2.25 to 0.74 us a message: 0.08 of a study flight of 0.27 s
    *(f"lab/flockwire_lab/{name}.py" for name in ("flight", "network", "process", "virtual_time")),
)
COLD = (  # mypyc's functions for errors, and for integers beyond 62 bits: the code that calls them stands apart
    *(f"CPy_{name}" for name in ("AddTraceback", "AttributeError", "TypeError", "TypeErrorTraceback")),
    *(f"CPyTagged_{name}_" for name in ("Add", "FloorDivide", "IsEq", "IsLt", "Multiply", "Remainder", "Subtract")),
    *(f"CPyTagged_{name}" for name in ("DecRef", "IncRef", "XDecRef")),
    "CPy_DecRef",
)
DENSE = ("-fvisibility=hidden", *(f"-fno-align-{what}" for what in ("functions", "jumps", "labels", "loops")))
LEFT_ALONE = {  # of whole folders: no mathematics in floats
    "__init__.py",
    "convergence.py",
    "gains.py",
}


class CustomBuildHook(BuildHookInterface[Any]):
    """Adds the extension modules to the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; called before the wheel is put together."""
        from mypyc.build import mypycify  # noqa: PLC0415  (a dependency of this hook alone)
        from setuptools import Distribution  # noqa: PLC0415

        root = Path(self.root)
        out = root / "build" / str(sys.implementation.cache_tag)
        files = [str(file) for entry in COMPILED for file in _files(root / entry)]
        modules = mypycify(
            ["--follow-imports=silent", *files], opt_level="2", multi_file=True, target_dir=str(out / "c")
        )
        if sys.platform == "linux":
            _pack(modules, out / "c/cold.h")
        distribution = Distribution({"name": "flockwire", "ext_modules": modules})
        command = distribution.get_command_obj("build_ext")
        command.parallel = True
        command.build_lib, command.build_temp = str(out / "lib"), str(out / "temp")
        distribution.run_command("build_ext")
        for module in (out / "lib").rglob("*.so"):
            build_data["force_include"][str(module)] = str(module.relative_to(out / "lib"))
        build_data["pure_python"], build_data["infer_tag"] = False, True


def _pack(modules: list[Any], header: Path) -> None:
    """Have what a step executes close together: it finds the caches cold, since other processes ran meanwhile."""
    lines = ["#include <CPy.h>", *(f"__typeof__({name}) {name} __attribute__((cold));" for name in COLD)]
    # clang refuses an attribute after the definition, which CPy_DecRef has in the header
    header.write_text("\n".join(("#ifndef __clang__", *lines, "#endif", "")))
    for module in modules:
        if module.name.endswith("__mypyc"):  # the library; each other one only asks it for a module
            module.extra_compile_args = [*module.extra_compile_args, *DENSE, f"-include{header}"]
        module.extra_link_args.append("-Wl,-z,noseparate-code")


def _files(entry: Path) -> list[Path]:
    if not entry.is_dir():
        return [entry]  # mypyc reports one that is not there
    return sorted(file for file in entry.rglob("*.py") if file.name not in LEFT_ALONE)
