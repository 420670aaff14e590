#!/usr/bin/env bash
# Doxygen finds nothing to complain about in the public headers and the guides, and does complain of a header without
# texts and with a broken reference.
#   documentation.sh DOXYGEN DOXYFILE
set -euo pipefail
doxygen=$1 doxyfile=$2
cd "$(dirname "$doxyfile")"  # Doxygen looks for what links name from the folder it runs in, too

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/bad.h" <<'END'
/// A namespace.
namespace bad {
void silent();
/// Like \ref nothing_of_this_name.
void astray();
/// A class.
class Mute {
 public:
  int what() const;
};
}  // namespace bad
END
if { cat "$doxyfile"; echo "INPUT = $folder"; echo "OUTPUT_DIRECTORY = $folder"; } |
    "$doxygen" - >"$folder/said" 2>&1; then
  echo "a header without texts passed:"
  cat "$folder/said"
  exit 1
fi
for want in 'silent() (function) of namespace bad is not documented' \
            'what() const (function) of class bad::Mute is not documented' \
            "unable to resolve reference to 'nothing_of_this_name'"; do
  if ! grep -qF "$want" "$folder/said"; then
    echo "expected '$want' among the warnings, found:"
    cat "$folder/said"
    exit 1
  fi
done

"$doxygen" "$doxyfile"
