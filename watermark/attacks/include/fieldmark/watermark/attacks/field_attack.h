#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/nerf/radiance_field.h>

#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// One kind of damage to a field's numbers; parse_field_attack() lists what each does.
enum class FieldAttackKind {
  weights_noise,
  float16,
  integers,
  integer_blocks,
  prune,
  greyscale,
  hue,
  brightness,
  contrast,
  average,
  sign_flip,
  copy
};

/// What somebody who holds a field's file does to its numbers to remove the mark, or to put it elsewhere.
struct FieldAttack {
  /// One damage and how much of it.
  struct Step {
    FieldAttackKind kind;  ///< what is done
    double amount;         ///< severity, in the unit that parse_field_attack() gives for the kind; 0: none
  };
  std::string name;         ///< as it was given
  std::vector<Step> steps;  ///< from left to right
  /// Whether a step is of this kind.
  bool has(FieldAttackKind kind) const;
};

/// Reads a name, or names separated by commas. "Each tensor" is each of a FIELD's float tensors, the rows
/// that its file keeps; what is occupied stays.
///   weights_noise_A  w + A rms(tensor) n, n normal, 0 to 10
///   float16          rounded to half precision, ties to even; beyond its range the largest half
///   intB             B of 2 to 8 bits: s round(w / s), s = max |tensor| / (2^(B-1) - 1), one s a tensor
///   intB-blocks      the same with one s for each 32 numbers that follow each other
///   prune_A          of each tensor the fraction A of least size becomes 0, 0 to 1
///   greyscale        the last colour layer's three sums become 0.299 r + 0.587 g + 0.114 b of themselves
///   hue_A            those sums turned about their grey axis by A degrees, -360 to 360
///   brightness_A     those sums plus ln A: odds c / (1 - c) of every colour times A, 0.01 to 100
///   contrast_A       those sums times A, 0 to 10
/// and with other fields of the same sizes (FieldAttackInputs):
///   average_A        w + A (other - w), 0 to 1: two messages of one owner mixed
///   sign_flip_A      w + A (unmarked - w), 0 to 4: at 1 the mark is gone, at 2 every sign of it is reversed.
///                    No carrier is needed but the unmarked field is: an informed attacker
///   copy_A           w + A (marked - unmarked), -4 to 4: a mark's change of the numbers put onto this field
/// @throws ValueError, which lists all of these, on any other name and on amounts outside the ranges
FieldAttack parse_field_attack(std::string_view name);

/// The other fields that some attacks need.
struct FieldAttackInputs {
  const nerf::RadianceField* other = nullptr;     ///< of average
  const nerf::RadianceField* unmarked = nullptr;  ///< of sign_flip and copy
  const nerf::RadianceField* marked = nullptr;    ///< of copy
};

/// Applies the steps in order. Cameras, bounds, background and occupancy stay.
/// @param rng  where noise comes from: step, tensor and number decide, so any thread count gives the same
/// bits
/// @throws ValueError if a field that a step needs is missing, or its tensors have other names or shapes
nerf::RadianceField apply_field_attack(const FieldAttack& attack, const nerf::RadianceField& field,
                                       const CounterRng& rng, const FieldAttackInputs& inputs = {});

}  // namespace fieldmark::watermark
