# Sourced by the scripts beside it: makes ../.venv from uv.lock, at once if it is up to date. Needs Python 3.11 or
# newer and no root; uv comes from PyPI, into ../.uv, where the machine has none.
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# The system's Python comes first: distributions build theirs with a profile, which pyenv by default does not, and that
# makes every step of an agent a fifth to a third cheaper.
find_python() {
  for candidate in "${PYTHON:-}" /usr/bin/python3 python3 python3.13 python3.12 python3.11; do
    if [ -n "$candidate" ] && "$candidate" -c 'import ensurepip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null
    then
      echo "$candidate"
      return
    fi
  done
  echo "flockwire needs Python 3.11 or newer with venv (Debian: python3-venv); none was found (set PYTHON to one)" >&2
  return 1
}

find_uv() { # Python to get it with
  if ! command -v uv; then
    if [ ! -x .uv/bin/uv ]; then
      "$1" -m venv .uv
      .uv/bin/python -m pip install --quiet --disable-pip-version-check uv==0.13.9
    fi
    echo .uv/bin/uv
  fi
}

# Those who change the code run it as it is; compiling takes a C compiler and Python's headers.
may_compile() {
  [ ! -f .venv/flockwire-interpreted ] && command -v cc > /dev/null && command -v flock > /dev/null &&
    [ -f "$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("include"))')/Python.h" ]
}

sync_environment() { # groups as uv names them
  local stamp=.venv/flockwire-"$1" python uv
  if [ "$1" != run ] && [ -d .venv ]; then
    touch .venv/flockwire-interpreted # a compilation under way ends without effect
    rm -f .venv/lib/python*/site-packages/flockwire_compiled_first.*
  fi
  if [ -f "$stamp" ] && [ "$stamp" -nt uv.lock ] && [ "$stamp" -nt pyproject.toml ]; then
    return
  fi
  echo "flockwire: setting up .venv (once)" >&2
  python=$(find_python)
  uv=$(find_uv "$python")
  local options=(--locked --quiet --python "$python" --extra station --extra report --extra console)
  case "$1" in
    run) options+=(--no-dev --inexact) ;;
    docs) options+=(--group docs --inexact) ;;
    dev) rm -f .venv/flockwire-docs ;; # it removes what no group of its own needs
  esac
  UV_PYTHON_DOWNLOADS=never UV_PROJECT_ENVIRONMENT=.venv "$uv" sync "${options[@]}"
  touch "$stamp"
  if [ "$1" != run ]; then touch .venv/flockwire-interpreted; fi
}
