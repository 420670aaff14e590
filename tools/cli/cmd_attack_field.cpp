#include <fieldmark/watermark/attacks/field_attack.h>

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

struct Options {
  std::string field, out, under;
  std::string other, unmarked, marked;
  TrainingAttackOptions training;
};

// A field that an attack needs besides the one attacked.
class Input {
 public:
  Input(const std::string& path, const char* option, bool needed) {
    if (needed && path.empty()) throw UsageError(std::string("--distort: needs ") + option + " FIELD");
    if (!needed && !path.empty()) throw UsageError(std::string(option) + ": --distort does not use it");
    if (needed) field_.emplace(nerf::RadianceField::load(path));
  }
  const nerf::RadianceField* get() const { return field_ ? &*field_ : nullptr; }

 private:
  std::optional<nerf::RadianceField> field_;
};

void check_out(const Options& options) {
  for (const std::string& input : {options.field, options.other, options.unmarked, options.marked})
    if (!input.empty() && std::filesystem::exists(options.out) && std::filesystem::exists(input) &&
        std::filesystem::equivalent(options.out, input))
      throw UsageError("--out: " + options.out + " would be overwritten by its own result");
  check_writable(options.out);
}

nerf::RadianceField changed_numbers(const Options& options, Context& context) {
  const auto attack = read_option("--distort", [&] { return watermark::parse_field_attack(options.under); });
  const bool copy = attack.has(FieldAttackKind::copy);
  const Input other(options.other, "--other", attack.has(FieldAttackKind::average)),
      unmarked(options.unmarked, "--unmarked", copy || attack.has(FieldAttackKind::sign_flip)),
      marked(options.marked, "--marked", copy);
  return watermark::apply_field_attack(
      attack, nerf::RadianceField::load(options.field), CounterRng(context.seed()),
      {.other = other.get(), .unmarked = unmarked.get(), .marked = marked.get()});
}

int run(const Options& options, Context& context) {
  check_out(options);
  Json json{{"under", options.under}, {"field", options.field}, {"out", options.out}};
  const InterruptGuard until_saved;  // between the last step and the file, Ctrl-C waits
  const auto result = is_training_attack(options.under)
                          ? run_training_attack(options.under, nerf::RadianceField::load(options.field),
                                                options.training, context, json)
                          : changed_numbers(options, context);
  result.save(options.out);
  json["file_bytes"] = std::filesystem::file_size(options.out);
  context.text() << options.out << ": " << options.field << " after " << options.under << "\n";
  context.result(json);
  return kOk;
}

}  // namespace

Command add_attack_field(CommandLine& app) {
  auto o = std::make_shared<Options>();
  app.add_option("field", o->field, "What `fieldmark bake` or `fieldmark train` wrote")
      ->required()
      ->type_name("FIELD")
      ->default_str("");
  app.add_option("--out", o->out, "File for the attacked field, as large as it was")
      ->required()
      ->type_name("FIELD");
  app.add_option("--distort", o->under,
                 "Names separated by commas, run left to right. Each tensor by itself:\n"
                 "weights_noise_A  Gaussian, A times the tensor's rms, 0 to 10\n"
                 "float16          rounded to half precision\n"
                 "int8             to whole numbers of 2 to 8 bits (int2 .. int8), one scale a tensor;\n"
                 "                 int8-blocks with one for each 32 numbers\n"
                 "prune_A          the fraction A of least size becomes 0, 0 to 1\n"
                 "Colours, before their sigmoid:\n"
                 "greyscale        luma in all three\n"
                 "hue_A            about the grey axis, -360 to 360 degrees\n"
                 "brightness_A     odds times A, 0.01 to 100\n"
                 "contrast_A       factor 0 to 10\n"
                 "With other fields of the same sizes:\n"
                 "average_A        (1 - A) FIELD + A OTHER, 0 to 1\n"
                 "sign_flip_A      FIELD + A (UNMARKED - FIELD), 0 to 4; 2 reverses every sign of the mark\n"
                 "copy_A           FIELD + A (MARKED - UNMARKED), -4 to 4\n"
                 "By training, each alone:\n"
                 "finetune         goes on, on the photographs of --data\n"
                 "finetune-renders goes on, on images of itself\n"
                 "remove           goes on, on images of itself turned against the extractor of --owner\n"
                 "retrain          a new field on images of this one")
      ->required()
      ->type_name("NAME[,NAME...]");
  app.add_option("--other", o->other, "For average: say, the same field with another message")
      ->type_name("FIELD");
  app.add_option("--unmarked", o->unmarked, "For sign_flip and copy: the field before its mark was baked")
      ->type_name("FIELD");
  app.add_option("--marked", o->marked, "For copy: the field whose mark is copied")->type_name("FIELD");
  add_training_attack(app, o->training);
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
