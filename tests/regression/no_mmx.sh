#!/usr/bin/env bash
# A program uses no MMX register: compiled C++ never leaves the mode that such a register enters, in which every long
# double is NaN.
#   no_mmx.sh PROGRAM
set -euo pipefail
program=$1
command -v objdump >/dev/null || { echo "SKIPPED: no_mmx needs objdump"; exit 0; }
listing=$(mktemp)
trap 'rm -f "$listing"' EXIT
objdump --disassemble --no-show-raw-insn "$program" >"$listing"
grep -q '%xmm[0-7]' "$listing" || { echo "no_mmx: objdump lists no vector instruction of $program"; exit 1; }
found=$(awk '/^[0-9a-f]+ <.*>:$/ { name = $0 } /%mm[0-7]/ && n < 5 { n++; print name; print }' "$listing")
if [ -n "$found" ]; then
  echo "$found"
  echo "no_mmx: $program uses MMX registers: compile the functions above with -mno-mmx"
  exit 1
fi
