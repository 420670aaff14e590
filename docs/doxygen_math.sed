# Formulas as GitHub writes them, $x$ and blocks of ```math, as Doxygen writes them.
/^```math$/,/^```$/ {
  s/^```math$/\\f[/
  s/^```$/\\f]/
  b
}
s/\$([^$]+)\$/\\f$\1\\f$/g
