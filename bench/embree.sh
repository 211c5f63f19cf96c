#!/bin/sh
# Races luz-geometry's rays against Embree 4 on the same rays (`cargo bench -p luz-geometry --bench rays`).
# Embree is the library inside the Python wheel `embreex` (pip install embreex), or the one that LUZ_EMBREE_LIB names.
# Further words go to cargo; PYTHON names the interpreter whose packages are searched.
set -eu
cd "$(dirname "$0")/.."

if [ -z "${LUZ_EMBREE_LIB:-}" ]; then
    # The wheel keeps its libraries beside the package, under names that carry a hash.
    LUZ_EMBREE_LIB=$("${PYTHON:-python3}" - <<'PYTHON'
import importlib.util, pathlib, sys

spec = importlib.util.find_spec("embreex")
if spec is None:
    sys.exit("no Embree: pip install embreex, or set LUZ_EMBREE_LIB to a libembree4.so")
package = pathlib.Path(spec.origin).parent
found = [
    path
    for folder in (package.with_name("embreex.libs"), package, package / ".dylibs")
    for path in sorted(folder.glob("libembree4*"))
]
if not found:
    sys.exit(f"no libembree4 beside {package}: set LUZ_EMBREE_LIB")
print(found[0])
PYTHON
    )
fi
export LUZ_EMBREE_LIB
echo "Embree: $LUZ_EMBREE_LIB"
exec cargo bench -p luz-geometry --bench rays "$@"
