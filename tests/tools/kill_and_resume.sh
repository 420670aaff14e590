#!/usr/bin/env bash
# Long runs that are interrupted and killed, then resumed, end with the bytes of an undisturbed run.
#   kill_and_resume.sh FIELDMARK FIELD
# FIELD is the one to mark: smaller and quicker to render than what `train` makes here.
set -euo pipefail
fieldmark=$(realpath "$1") field=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

fail() {
  echo "FAILED: $*" >&2
  cat ./*.log >&2
  exit 1
}

# stop SIGNAL PATTERN WHAT ARGUMENTS...: starts the command, sends the signal once its progress shows the pattern, and
# leaves the exit code in $code.
stop() {
  local signal=$1 pattern=$2 what=$3
  shift 3
  # Emptied here, not by the started process: the last run's log shows the pattern until that process opens it.
  : >"$what.log"
  "$fieldmark" "$what" "$@" >>"$what.log" 2>&1 &
  local run=$!
  until grep -q "$pattern" "$what.log"; do
    kill -0 "$run" 2>/dev/null || fail "$what ended before it was stopped"
    sleep 0.02
  done
  kill "-$signal" "$run"
  code=0
  wait "$run" || code=$?
}

# survives WHAT OUT ARGUMENTS...
survives() {
  local what=$1 out=$2
  shift 2
  "$fieldmark" "$what" --out "whole_$out" "$@" >"$what.log" 2>&1 || fail "$what, undisturbed"
  stop INT "^$what [2-9]0%" "$what" --out "$out" "$@"
  [ "$code" -eq 130 ] || fail "$what, interrupted: exit code $code, not 130"
  [ ! -e "$out" ] || fail "$what, interrupted: left $out"
  [ -s "$out.checkpoint" ] || fail "$what, interrupted: left no $out.checkpoint"
  cp "$out.checkpoint" saved
  stop KILL "^$what [5-9]0%" "$what" --out "$out" "$@" --resume --threads 1
  [ "$code" -eq 137 ] || fail "$what, killed: exit code $code, not 137"
  [ ! -e "$out" ] || fail "$what, killed: left $out"
  cmp saved "$out.checkpoint" || fail "$what, killed: the checkpoint it came from is not what it was"
  "$fieldmark" "$what" --out "$out" "$@" --resume --threads 2 >"$what.log" 2>&1 || fail "$what, resumed"
  cmp "whole_$out" "$out" || fail "$what, resumed: other bytes than the undisturbed run"
  [ ! -e "$out.checkpoint" ] || fail "$what, resumed: $out.checkpoint is still there"
}

"$fieldmark" scene --out scene --kind sphere --size 32 --views 8 >scene.log 2>&1
"$fieldmark" key --out secret.key >key.log 2>&1
survives train field.fm --data scene --steps 120 --max-megabytes 1
tiny=(--field "$field" --key secret.key --bits 4 --cells 6 --reader-size 32 --steps 40 --views 8 --measured-views 1)
survives embed owner.fm "${tiny[@]}"
survives embed keyless.fm "${tiny[@]}" --no-key
survives bake baked.fm --owner owner.fm --message a --steps 40
echo "train, embed and bake: interrupted, killed and resumed, the same bytes"
