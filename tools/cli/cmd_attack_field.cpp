#include <fieldmark/watermark/attacks/field_attack.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/training_attack.h"

namespace fieldmark::cli {
namespace {

using watermark::FieldAttackKind;

struct AttackFieldArguments {
  std::string field, out, attack;
  std::string other, unmarked, marked;
  TrainingAttackOptions training;
};

// A field that an attack needs besides its target.
class Input {
 public:
  Input(const std::string& path, const char* option, bool needed) {
    if (needed && path.empty()) throw UsageError(std::string("--attack: needs ") + option + " FIELD");
    if (!needed && !path.empty()) throw UsageError(std::string(option) + ": --attack does not use it");
    if (needed) field_.emplace(nerf::RadianceField::load(path));
  }
  const nerf::RadianceField* get() const { return field_ ? &*field_ : nullptr; }

 private:
  std::optional<nerf::RadianceField> field_;
};

void check_out(const AttackFieldArguments& options) {
  for (const std::string& input : {options.field, options.other, options.unmarked, options.marked})
    if (!input.empty() && std::filesystem::exists(options.out) && std::filesystem::exists(input) &&
        std::filesystem::equivalent(options.out, input))
      throw UsageError("--out: " + options.out + " would be overwritten by its own result");
  check_writable(options.out);
}

nerf::RadianceField changed_weights(const AttackFieldArguments& options, Context& context) {
  const auto attack = read_option("--attack", [&] { return watermark::parse_field_attack(options.attack); });
  const bool copy = attack.has(FieldAttackKind::copy);
  const Input other(options.other, "--other", attack.has(FieldAttackKind::average)),
      unmarked(options.unmarked, "--unmarked", copy || attack.has(FieldAttackKind::sign_flip)),
      marked(options.marked, "--marked", copy);
  return watermark::apply_field_attack(
      attack, nerf::RadianceField::load(options.field), CounterRng(context.seed()),
      {.other = other.get(), .unmarked = unmarked.get(), .marked = marked.get()});
}

// Rejects options that this attack would ignore.
void refuse_unused(CommandLine& app, const std::string& attack) {
  std::vector<std::string> used{"--steps", "--seconds"};
  const auto uses = [&](std::initializer_list<std::string> names) { used.insert(used.end(), names); };
  if (attack == "finetune") uses({"--data", "--size", "--lr"});
  if (attack == "finetune-renders") uses({"--views", "--size", "--lr"});
  if (attack == "remove") uses({"--owner", "--mark-psnr", "--views", "--lr"});
  if (attack == "retrain") uses({"--preset", "--views", "--size"});
  if (!is_training_attack(attack)) used = {"--other", "--unmarked", "--marked"};
  for (const char* name : {"--data", "--owner", "--mark-psnr", "--preset", "--size", "--views", "--lr",
                           "--steps", "--seconds", "--other", "--unmarked", "--marked"})
    if (app.option(name).count() > 0 && std::ranges::find(used, name) == used.end())
      throw UsageError(std::string(name) + ": --attack " + attack + " does not use it");
}

int run_attack_field(const AttackFieldArguments& options, Context& context) {
  check_out(options);
  Json json{{"attack", options.attack}, {"field", options.field}, {"out", options.out}};
  const InterruptGuard until_saved;  // Ctrl-C waits between the last step and the file
  const auto result = is_training_attack(options.attack)
                          ? run_training_attack(options.attack, nerf::RadianceField::load(options.field),
                                                options.training, context, json)
                          : changed_weights(options, context);
  result.save(options.out);
  json["file_bytes"] = std::filesystem::file_size(options.out);
  context.text() << options.out << ": " << options.field << " after " << options.attack << "\n";
  context.result(json);
  return kOk;
}

}  // namespace

Command add_attack_field(CommandLine& app) {
  auto o = std::make_shared<AttackFieldArguments>();
  app.add_option("field", o->field, "Field to attack, from `fieldmark bake` or `fieldmark train`")
      ->required()
      ->type_name("FIELD")
      ->default_str("");
  app.add_option("--out", o->out, "Field file to write")->required()->type_name("FIELD");
  app.add_option("--attack", o->attack,
                 "Attacks to run, left to right. On each tensor:\n"
                 "weights_noise_A  Gaussian noise of A times the tensor's rms, 0 to 10\n"
                 "float16          rounding to half precision\n"
                 "int8             rounding to 8 bits (int2 to int8: 2 to 8), one scale per tensor;\n"
                 "                 int8-blocks: one scale per 32 elements\n"
                 "prune_A          0 for the fraction A of the elements of smallest magnitude, 0 to 1\n"
                 "On colours, before their sigmoid:\n"
                 "greyscale        luma in all three channels\n"
                 "hue_A            rotation about the grey axis by A degrees, -360 to 360\n"
                 "brightness_A     odds times A, 0.01 to 100\n"
                 "contrast_A       factor A, 0 to 10\n"
                 "With other fields of the same sizes:\n"
                 "average_A        (1 - A) FIELD + A OTHER, 0 to 1\n"
                 "sign_flip_A      FIELD + A (UNMARKED - FIELD), 0 to 4; 2 reverses the mark's signs\n"
                 "copy_A           FIELD + A (MARKED - UNMARKED), -4 to 4\n"
                 "By training, one at a time:\n"
                 "finetune         continues training with the clean images of --data\n"
                 "finetune-renders continues training with renders of the field\n"
                 "remove           continues training with renders changed against --owner's extractor\n"
                 "retrain          trains a new field with renders of this one")
      ->required()
      ->type_name("NAME[,NAME...]");
  app.add_option("--other", o->other, "Field to average with, such as one with another message; for average")
      ->type_name("FIELD");
  app.add_option("--unmarked", o->unmarked, "Field before its mark was baked; for sign_flip and copy")
      ->type_name("FIELD");
  app.add_option("--marked", o->marked, "Field whose mark is copied; for copy")->type_name("FIELD");
  add_training_attack(app, o->training);
  return [o, app](Context& context) mutable {
    refuse_unused(app, o->attack);
    return run_attack_field(*o, context);
  };
}

}  // namespace fieldmark::cli
