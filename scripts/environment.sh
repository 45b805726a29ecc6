# Sourced by the scripts beside it: makes the environments from uv.lock, at once if they are up to date. Needs Python 3.11
# or newer and no root; uv comes from PyPI, into .uv, where the machine has none.
#   .venv       what users run: flockwire as a wheel, compiled where there is a C compiler
#   .venv-dev   the sources as they are, with the tools of developers
#   .compiled   what users run, with the tools of developers
unset CDPATH PYTHONHOME
cd "$(dirname "${BASH_SOURCE[0]}")/.."
SOURCES=(hatch_build.py ./*/flockwire*)

# The system's Python comes first: distributions build theirs with a profile, which pyenv by default does not, and that
# makes every step of an agent a fifth to a third cheaper.
find_python() {
  for candidate in "${PYTHON:-}" /usr/bin/python3 python3 python3.13 python3.12 python3.11; do
    if [ -n "$candidate" ] && "$candidate" -Ic 'import ensurepip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null
    then
      echo "$candidate"
      return
    fi
  done
  echo "flockwire needs Python 3.11 or newer with venv (Debian: python3-venv); none was found (set PYTHON to one)" >&2
  return 1
}

# Calls an installer without the variables of others that say where, or by which rules, something is installed; those of
# mirrors, certificates and proxies stay.
run_installer() {
  local name variables=()
  for name in PYTHONPATH VIRTUAL_ENV CONDA_PREFIX PIP_{TARGET,PREFIX,ROOT,CONSTRAINT,REQUIRE_HASHES,NO_BINARY,PYTHON} \
    UV_{PROJECT,WORKING_DIR,CONFIG_FILE,PYTHON,SYSTEM_PYTHON,FROZEN,NO_SYNC,NO_EDITABLE,DEV,NO_DEV,GROUP,NO_GROUP} \
    UV_{NO_DEFAULT_GROUPS,NO_BUILD,NO_BINARY,NO_BUILD_ISOLATION,CONSTRAINT,OVERRIDE,BUILD_CONSTRAINT,REQUIRE_HASHES} \
    UV_{TARGET,PREFIX,RESOLUTION,PRERELEASE,EXCLUDE_NEWER,NO_SOURCES,NO_INSTALL_PROJECT,BREAK_SYSTEM_PACKAGES}; do
    variables+=(-u "$name")
  done
  env "${variables[@]}" PIP_USER=0 UV_PYTHON_DOWNLOADS=never "$@"
}

find_uv() { # Python to get it with
  if ! command -v uv; then
    if [ ! -x .uv/bin/uv ]; then
      run_installer "$1" -I -m venv .uv
      run_installer .uv/bin/python -I -m pip install --quiet --disable-pip-version-check --require-hashes \
        --requirement scripts/uv.txt
    fi
    echo .uv/bin/uv
  fi
}

has_compiler() { # Python
  command -v cc > /dev/null && [ -f "$("$1" -Ic 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h" ]
}

# Whether an environment, or a wheel, is newer than what it is made of; what was not compiled is made again once it can be.
is_current() { # folder, Python and the sources
  [ -f "$1/flockwire-made" ] &&
    [ -z "$(find uv.lock pyproject.toml "${@:3}" -type f ! -name '*.pyc' -newer "$1/flockwire-made")" ] &&
    { [ "$(cat "$1/flockwire-made")" != interpreted ] || ! has_compiler "$2"; }
}

build_wheel() { # folder, uv and Python; flockwire-made says what became of it
  local missing="flights are the same, but studies take several times as long" made=interpreted
  if is_current "$1" "$3" "${SOURCES[@]}"; then return; fi
  rm -rf "$1"
  touch build/began # a source that changes meanwhile is newer
  if ! has_compiler "$3"; then
    echo "flockwire: there is no C compiler, or Python has no headers (Debian: gcc, python3-dev): $missing" >&2
  elif HATCH_BUILD_HOOK_ENABLE_CUSTOM=1 run_installer "$2" build --wheel --python "$3" --out-dir "$1" > build/log 2>&1
  then
    made=compiled
  else
    made=failed
    echo "flockwire: it could not be compiled (build/log): $missing" >&2
  fi
  if [ "$made" != compiled ]; then run_installer "$2" build --quiet --wheel --python "$3" --out-dir "$1"; fi
  echo "$made" > "$1/flockwire-made"
  touch -r build/began "$1/flockwire-made"
}

sync_environment() { # run, dev or compiled
  local place=.venv python uv wheel sources=("${SOURCES[@]}") options=(--no-dev --inexact)
  case "$1" in
    dev) place=.venv-dev sources=() options=(--group docs) ;;
    compiled) place=.compiled options=(--group docs) ;;
  esac
  if is_current "$place" "$place/bin/python" "${sources[@]}"; then return; fi
  mkdir -p build
  exec 9> build/lock # two scripts share the folder build
  if command -v flock > /dev/null; then flock 9; fi
  if is_current "$place" "$place/bin/python" "${sources[@]}"; then # another one has made it
    exec 9>&- # who tests would keep the lock
    return
  fi
  if pgrep -f "^$PWD/$place/bin/" > /dev/null 2>&1; then
    echo "flockwire: the sources have changed, and processes run from $place: end them first" >&2
    return 2
  fi
  echo "flockwire: setting up $place (once; a minute or two)" >&2
  python=$(find_python)
  uv=$(find_uv "$python")
  [ -f "$place/flockwire-made" ] || rm -rf "$place"
  if [ ! -d "$place" ]; then run_installer "$python" -I -m venv "$place"; fi
  if [ "$1" != dev ]; then options+=(--no-install-project --compile-bytecode); fi
  UV_PROJECT_ENVIRONMENT=$place run_installer "$uv" sync --locked --quiet --python "$place" "${options[@]}" \
    --extra station --extra report --extra console
  if [ "$1" = dev ]; then
    echo editable > "$place/flockwire-made"
  else
    wheel=build/$("$python" -Ic 'import sys; print(sys.implementation.cache_tag)')
    build_wheel "$wheel" "$uv" "$python"
    run_installer "$uv" pip install --quiet --no-deps --compile-bytecode --reinstall --python "$place" "$wheel"/*.whl
    cp -p "$wheel/flockwire-made" "$place/flockwire-made"
  fi
  exec 9>&-
}
