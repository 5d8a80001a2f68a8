#!/bin/sh
# Runs the kernel tests, and calls of every kernel with arrays that do not fit, under AddressSanitizer and UndefinedBehaviorSanitizer.
#
#   PYTHON=.venv/bin/python tests/kernels/sanitize.sh [pytest arguments]
#
# The kernels are built into build/sanitize, beside a copy of the package that imports them; the working tree stays as
# it is. Needs the build group of pyproject.toml (cmake, ninja, nanobind) and a g++ with its sanitizer libraries.
set -eu

root=$(cd "$(dirname "$0")/../.." && pwd)
python=${PYTHON:-$root/.venv/bin/python}
build=$root/build/sanitize
case $python in /*) ;; *) python=$PWD/$python ;; esac
tools=$(dirname "$python")
mkdir -p "$build"

"$tools/cmake" -S "$root/pipeline/kernels" -B "$build/objects" -G Ninja -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_MAKE_PROGRAM="$tools/ninja" -DPython_EXECUTABLE="$python" -DRINGLET_SANITIZE=ON >"$build.log" 2>&1 ||
    { cat "$build.log" >&2; exit 1; }
"$tools/cmake" --build "$build/objects" --target _portable

rm -rf "$build/tree"
mkdir -p "$build/tree"
(cd "$root" && find pipeline \( -name '*.py' -o -name '*.json' \) -exec cp --parents {} "$build/tree" \;)
cp "$build/objects"/_portable*.so "$build/tree/pipeline/kernels/"

# Python itself leaks on purpose; libasan must come before every other library, and finds __cxa_throw in libstdc++
cd "$build/tree"
export LD_PRELOAD="$(${CXX:-g++} -print-file-name=libasan.so) $(${CXX:-g++} -print-file-name=libstdc++.so)"
export ASAN_OPTIONS=detect_leaks=0:abort_on_error=1 UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
export RINGLET_KERNELS=portable OMP_NUM_THREADS=2
exec "$python" -c '
import sys
import pytest

# The copy, not an editable install of the working tree
sys.meta_path[:] = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
sys.path.insert(0, sys.argv[1])
sys.path.append(sys.argv[2])  # tests that tests import
sys.exit(pytest.main(sys.argv[3:]))
' "$build/tree" "$root" "$root/tests/kernels" "$root/tests/hostile/test_boundary.py" --rootdir "$root" -c "$root/pyproject.toml" -p no:cacheprovider "$@"
