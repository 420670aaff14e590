#!/usr/bin/env bash
# Whether a room finds a header: compiles a source that does nothing but include it.
#   include.sh COMPILER allowed|refused HEADER -I...
set -euo pipefail
compiler=$1 expected=$2 header=$3
shift 3
code=0
message=$(echo "#include <$header>" | "$compiler" -std=c++20 -fsyntax-only -x c++ "$@" - 2>&1) || code=$?
if [ "$expected" = allowed ]; then
  [ "$code" -eq 0 ] || { echo "FAILED: $header does not compile: $message" >&2 && exit 1; }
else
  [ "$code" -ne 0 ] || { echo "FAILED: $header compiles" >&2 && exit 1; }
  # Clang and GCC differ in the quotes and the case.
  grep -qi "error: .*$header.*\(no such file\|not found\)" <<<"$message" ||
    { echo "FAILED: $header was refused for another reason: $message" >&2 && exit 1; }
fi
echo "$header: $expected"
