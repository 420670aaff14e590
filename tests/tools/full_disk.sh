#!/usr/bin/env bash
# Every command that writes, where nothing can be written: exit code 1, a line that names the file, no file left behind.
# A limit on the size of files takes the place of a full disk: no root is needed for it.
#   full_disk.sh FIELDMARK FIELD
set -euo pipefail
fieldmark=$(realpath "$1") field=$(realpath "$2")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# refuses NAME ARGUMENTS...: NAME is what the message must name.
refuses() {
  local name=$1 code=0 before after message
  shift
  before=$(find . -type f | sort)
  message=$(
    ulimit -f 0
    trap '' XFSZ
    "$fieldmark" "$@" 2>&1 >/dev/null | cat
    exit "${PIPESTATUS[0]}"
  ) || code=$?
  after=$(find . -type f | sort)
  if [ "$code" -ne 1 ]; then
    echo "FAILED: $*: exit code $code, not 1: $message" >&2
    exit 1
  fi
  if ! tail -n 1 <<<"$message" | grep -qF "$name"; then
    echo "FAILED: $*: the message does not name $name: $message" >&2
    exit 1
  fi
  if [ "$before" != "$after" ]; then
    echo "FAILED: $*: left behind: $(comm -13 <(echo "$before") <(echo "$after"))" >&2
    exit 1
  fi
}

small=(--steps 2 --views 8 --measured-views 1 --reader-size 32 --bits 4 --cells 6)
"$fieldmark" scene --out scene --kind sphere --size 16 --views 16 >/dev/null 2>&1
cp "$field" field.fm
"$fieldmark" embed --field field.fm --out owner.fm "${small[@]}" >/dev/null 2>&1
"$fieldmark" render --field field.fm --out views --count 1 --size 32 >/dev/null 2>&1

refuses other scene --out other --kind sphere --size 16 --views 2
refuses other.fm train --data scene --out other.fm --steps 2
refuses other.key key --out other.key
refuses other.fm embed --field field.fm --out other.fm "${small[@]}"
refuses other.fm bake --owner owner.fm --message a --out other.fm --steps 2
refuses other render --field field.fm --out other --count 1 --size 32
refuses other distort views --distort blur_1 --out other
refuses result.json eval --field field.fm --data scene --json result.json
refuses result.md eval --field field.fm --data scene --report result.md
refuses other.fm attack-field field.fm --attack float16 --out other.fm
refuses evidence verify --owner owner.fm --message a views --detection blind --wrong-keys 10 --evidence evidence
refuses readings.json extract --owner owner.fm views --detection blind --readings readings.json
refuses result.json extract --owner owner.fm views --detection blind --json result.json
refuses result.json verify --owner owner.fm --message a views --detection blind --json result.json
refuses result.json null --owner owner.fm views --keys 2 --detection blind --json result.json
refuses cameras.png data check scene --cameras cameras.png
refuses result.json compare views views --json result.json
refuses work/ reproduce --scene scene --table bits --system ours --budget 1 --views 2 --cells cells --work work
echo "18 writers on a full disk: refused, named, nothing left"
