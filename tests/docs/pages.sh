#!/usr/bin/env bash
# The course and the page of gradients agree with the sources:
#   - each program of examples/ has 20 to 60 lines, main() of the linear regression at most 15 within its braces;
#   - the first listing of each lesson of docs/embedding.md is in the program of the lesson, but for spaces and comments;
#   - docs/gradients.md links the source of each op of the engine, the renderer and the distortions, and no other file.
#   pages.sh [ROOT]      --test: finds that it fails on bad sources
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
if [ "${1:-}" = --test ]; then
  copy=$(mktemp -d)
  trap 'rm -rf "$copy"' EXIT
  # expect WANT SED_SCRIPT FILE: the edited copy fails, for this reason alone
  expect() {
    rm -rf "${copy:?}"/*
    (cd "$root" && cp -r --parents examples docs/*.md docs/results/numerics.md engine/include engine/src nerf/include \
      nerf/src distort/include distort/src extractor/src watermark/mark/src "$copy")
    sed -i -E "$2" "$copy/$3"
    if said=$("$0" "$copy") || [ "$(wc -l <<<"$said")" -ne 1 ] || [[ $said != *"$1"* ]]; then
      echo "expected only '$1', got: $said"
      exit 1
    fi
  }
  expect 'has 61 lines of code' 's/^int main\(\) \{$/&\n  int more;/' examples/autoencoder.cpp
  expect 'has 16 lines of code, not 8 to 15' 's/^int main\(\) \{$/&\n  int more;/' examples/linear_regression.cpp
  expect 'lesson 5: not in examples/autoencoder.cpp' 's/avg_pool\(e2\(/max_pool(e2(/' docs/embedding.md
  expect 'does not link the source of nerf/include/fieldmark/nerf/colour_affine.h' 's/colour_affine\.cpp\)/rays.cpp)/' docs/gradients.md
  expect 'nothing.cpp, which does not exist' '$s/$/ [x](..\/nothing.cpp)/' docs/gradients.md
  exit 0
fi
cd "${1:-$root}"
failed=0
fail() { echo "$*"; failed=1; }

# Lines that are neither blank nor a comment.
lines_of_code() { grep -vcE '^[[:space:]]*(//.*)?$' || true; }
within() { [ "$2" -ge "$3" ] && [ "$2" -le "$4" ] || fail "$1 has $2 lines of code, not $3 to $4"; }

programs=(examples/*.cpp)
[ ${#programs[@]} -eq 8 ] || fail "examples/ has ${#programs[@]} programs, the course eight"
for program in "${programs[@]}"; do within "$program" "$(lines_of_code <"$program")" 20 60; done
body=$(sed -n '/^int main/,/^}/p' examples/linear_regression.cpp | sed '1d;$d')
within "main() of examples/linear_regression.cpp" "$(lines_of_code <<<"$body")" 8 15

# Sets `joined`: the lines of code without comments, on one line. No process of its own, which takes longer than the work.
join() {
  local line
  joined=
  while IFS= read -r line; do joined+=${line%%//*}; done
}
listings=0
for lesson in 1 2 3 4 5 6 7; do
  program=examples/$(sed -nE "s/^\| $lesson \| \`([a-z_]+\.cpp)\`.*/\1/p" docs/embedding.md)
  [ -f "$program" ] || { fail "docs/embedding.md: no program of lesson $lesson"; continue; }
  listing=$(awk -v begin="## $lesson. " 'index($0, begin) == 1 { here = 1; next } /^## / { here = 0 }
    here && /^```$/ { exit } code { print } here && /^```cpp$/ { code = 1 }' docs/embedding.md)
  join <"$program"
  code=${joined//[[:space:]]/}
  join <<<"$listing"
  joined=${joined//  .../$'\n'}  # `...` stands for what is left out
  joined=${joined//;.../;$'\n'}
  while IFS= read -r part; do
    part=${part//[[:space:]]/}
    [ -n "$part" ] || continue
    listings=$((listings + 1))
    [[ $code == *"$part"* ]] || fail "docs/embedding.md, lesson $lesson: not in $program: $part"
  done <<<"$joined"
done
[ "$listings" -ge 7 ] || fail "docs/embedding.md: only $listings listings were compared"

# Headers of ops name what they are differentiable in; a layer or a field is made of ops.
headers=0 gradients=$(<docs/gradients.md)
for header in $(grep -rl 'Differentiable in:' {engine/include/fieldmark/engine/ops,{nerf,distort}/include}); do
  case $header in */field.h | */mlp_field.h) continue ;; esac  # interfaces: their parts are ops
  headers=$((headers + 1))
  name=${header##*/}
  [[ $gradients == *"/${name%.h}.cpp)"* ]] || fail "docs/gradients.md does not link the source of $header"
done
[ "$headers" -ge 40 ] || fail "only $headers headers of ops were found"
for link in $(grep -oE '\]\(\.\./[^)]*\)' docs/gradients.md | sed 's/^](..\///; s/)$//'); do
  [ -f "$link" ] || fail "docs/gradients.md links $link, which does not exist"
done
exit $failed
