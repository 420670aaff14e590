#include <fieldmark/watermark/evidence/evidence_folder.h>

#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/images.h"
#include "cli/rounded_up.h"

namespace fieldmark::cli {
namespace {

struct CheckArguments {
  std::string folder, public_key;
  std::vector<std::string> images;
};

Json result(const watermark::EvidenceCheck& check, std::size_t given) {
  Json json{{"intact", check.faults.empty()},
            {"faults", check.faults},
            {"images", given},
            {"images_known", check.images + check.controls},
            {"images_tested", check.images},
            {"images_controls", check.controls}};
  if (const auto& s = check.summary) {
    json["public_key"] = to_hex(s->signer);
    json["commitment"] = s->commitment;
    json["owner_sha256"] = s->owner_sha256;
    json["message"] = to_hex(s->message);
    json["copy"] = s->copy.empty() ? Json(nullptr) : Json(s->copy);
    json["key_free"] = s->key_free;
    json["images_in_evidence"] = s->images.size();
    json["found"] = s->found;
    json["p_value"] = s->p_value;
  }
  return json;
}

int run_check(const CheckArguments& options, Context& context) {
  std::optional<watermark::PublicKey> signer;
  if (!options.public_key.empty())
    signer = read_option("--public-key", [&] { return watermark::public_key_from_hex(options.public_key); });
  const auto images = options.images.empty() ? std::vector<std::filesystem::path>{}
                                             : list_images(options.images, context, Videos::read);
  const auto check = watermark::check_evidence_folder(options.folder, images, signer);
  auto& out = context.text();
  for (const auto& fault : check.faults) out << fault << "\n";
  out << options.folder << (check.faults.empty() ? ": INTACT" : ": ALTERED") << "\n";
  if (const auto& s = check.summary; s && check.faults.empty()) {
    out << "verdict     " << (s->found ? "FOUND" : "NOT FOUND") << ", p " << rounded_up(s->p_value, 3)
        << ", message " << to_hex(s->message) << (s->copy.empty() ? "" : ", copy of " + s->copy)
        << (s->key_free ? "" : "; not proven: the networks were trained under the owner's key")
        << "\ncommitment  " << s->commitment << "\nsigned by   " << to_hex(s->signer)
        << (signer ? ", as expected" : ", not compared with a known key (see --public-key)")
        << "\nimages      " << check.images << " of " << s->images.size() << " tested images given, and "
        << check.controls << " images of controls\n";
  }
  context.result(result(check, images.size()));
  return check.faults.empty() ? kOk : kFailed;
}

}  // namespace

Command add_check(CommandLine& app) {
  auto o = std::make_shared<CheckArguments>();
  app.add_option("folder", o->folder, "Evidence folder from `fieldmark verify`")
      ->required()
      ->type_name("DIR");
  app.add_option("images", o->images,
                 "Images or videos, or folders of them, to compare by SHA-256 with those of the evidence")
      ->type_name("IMAGE|VIDEO|DIR")
      ->default_str("");
  app.add_option("--public-key", o->public_key,
                 "Public key of the signer, 64 digits, as `key`, `embed` and `bake` print it; default: any")
      ->type_name("HEX")
      ->default_str("");
  return [o](Context& context) { return run_check(*o, context); };
}

}  // namespace fieldmark::cli
