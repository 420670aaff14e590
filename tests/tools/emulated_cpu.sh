#!/usr/bin/env bash
# Kernels, ops and the command on CPUs that the machine at hand is not, emulated: one without AVX, which must find the
# kernels of x86-64-v2 and never meet an instruction beyond them, and one with AVX2 and without AVX-512.
#   emulated_cpu.sh FIELDMARK TEST_ENGINE TEST_NERF
set -euo pipefail
if ! command -v qemu-x86_64 >/dev/null; then
  echo "SKIPPED: an emulated CPU needs qemu-x86_64 (package qemu-user)"
  exit 0
fi
fieldmark=$(realpath "$1") engine=$(realpath "$2") nerf=$(realpath "$3")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
export OMP_NUM_THREADS=1 # emulated threads wait for each other longer than they work

fail() {
  echo "FAILED: $*" >&2
  cat ./*.log >&2
  exit 1
}

# on CPU PROGRAM ARGUMENTS...: its output goes to PROGRAM.log
on() {
  local cpu=$1 program=$2
  shift 2
  qemu-x86_64 -cpu "$cpu" "$program" "$@" >"$(basename "$program").log" 2>&1
}

# passes CPU PROGRAM FILTERS: its tests of these names pass, and every filter names some
passes() {
  on "$@" || fail "tests of $(basename "$2") on $1"
  if grep 'No test cases matched' "$(basename "$2").log"; then fail "$(basename "$2") has no such tests"; fi
}

# level CPU: the instruction set whose kernels the command uses there
level() {
  on "$1" "$fieldmark" gradcheck --only arithmetic --report "$1.md" || fail "gradcheck on $1"
  sed -n 's/^| kernels | x86-64-\(v[234]\) |$/\1/p' "$1.md"
}

old=Nehalem new=Haswell-noTSX
[ "$(level $old)" = v2 ] || fail "a CPU without AVX uses kernels of level '$(level $old)', not v2"
# Every kernel by loops, the ops whose float paths have code of their own, and training.
ops="dense: the float*,matmul: the float*,softmax: a certain*,activation: float*,pool: float*"
passes $old "$engine" "kernels/*,adam kernel*,gemm:*,isa*,$ops"
passes $old "$nerf" "kernels/*,composite*,sampler: densities*,trainer: opaque*,weighted_taps*,blur*,rotate*"
# Of the gradient checks, those of the ops with kernels: the others compose these, and take a minute here.
for op in conv dense hash composite distortion; do
  on $old "$fieldmark" gradcheck --only "$op" || fail "gradcheck of $op on $old"
done

# The command: a field as large as its own takes minutes to train there, so it is trained here and rendered there.
{ "$fieldmark" scene --out scene --kind sphere --size 16 --views 4 &&
  "$fieldmark" train --data scene --out field.fm --steps 20; } >native.log 2>&1 || fail "scene and train, not emulated"
on $old "$fieldmark" render --field field.fm --out views --count 1 --size 16 || fail "render on $old"
if FIELDMARK_ISA=v3 on $old "$fieldmark" render --field field.fm --out other --count 1 --size 16; then
  fail "FIELDMARK_ISA=v3 on $old was not refused"
fi
grep -qxF 'fieldmark: [isa] FIELDMARK_ISA asks for v3, this CPU has at most v2' fieldmark.log ||
  fail "FIELDMARK_ISA=v3 on $old: another message"

newest=$(level $new)
if [ "$newest" = v3 ]; then
  passes $new "$engine" "kernels/elementwise: every*,kernels/pool*"
  passes $new "$nerf" "kernels/march*"
else
  echo "SKIPPED: kernels of v3 on an emulated CPU needs a qemu-x86_64 with AVX2 (7.2 or newer)"
fi
echo "$old: v2; kernels, gradients, training and rendering pass, v3 is refused; $new: $newest"
